//! The project's own commands: `cargo xtask NAME`, or `cargo fw`.
#![forbid(unsafe_code)]
mod api;
mod bench;
mod boards;
mod budget;
mod call_graph;
mod checked_boards;
mod circles;
mod failure;
mod figures;
mod fw;
mod fw_test;
mod hil;
mod icount;
mod page;
mod release;
mod senders;
mod shell;
mod sizes;
mod targets;
mod thumb;
mod toolchain;
mod without_masking;

use std::{env, process::ExitCode};

const USAGE: &str = "usage: cargo xtask COMMAND
    fw [OPTIONS]       build the firmware: `cargo fw --help`
    fw-test [NAME...]  run the firmware in an emulated STM32F407; --list, --costs,
                       --highest-rate, --rates, --planted; qemu: in QEMU instead
    hil --flash | --port NAME | --emulated | --planted | --wires
                       the self-test of a board that measures its own edges (docs/hil.md);
                       --baud RATE, --report FILE
    thumb [FILE...]    build libraries and firmware for the microcontroller, and check what is in
                       them; with FILEs, check the firmware in these files and build none
    targets [TARGET...]
                       check the libraries for other processors, all or those named
    api                compare what the facade shows to its users with crates/leadscrew/api.txt
    circles            look for files of a crate that import each other in a circle
    boards [--parts | --checked [BOARD...]]
                       build the boards in examples/boards, run them in emulators, and watch their
                       pins; with --parts, only print the flash of each part of the machine; with
                       --checked, only check the boards that no emulator has
    bench COMMAND...   count x86-64 instructions per line; COMMAND says {lines} for their number
    page PAGE.html [MACHINE.toml]
                       write the page of a machine as one file that needs no server: the simulator
                       is in it
    release [--twice] [NAME...]
                       make the files that are handed out, for all images or those named; --twice
                       makes them in a second folder, too, and compares
    figures            run what measures, and write docs/figures.md
    icount [--check]   count instructions under QEMU; fail above the budgets
    senders [NAME...]  run real senders (meerk40t, grbl-streamer, bcnc, websockets, cncjs) against
                       `leadscrew serve`";

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words.as_slice() {
        ["fw", ..] => fw::run(&arguments[1..]),
        ["fw-test", ..] => fw_test::run(&arguments[1..]),
        ["hil", _, ..] => hil::run(&arguments[1..]),
        ["boards"] => boards::run(),
        ["boards", "--parts"] => boards::parts(),
        ["boards", "--checked", names @ ..] => checked_boards::run(names),
        ["api"] => api::run(),
        ["circles"] => circles::run(),
        ["bench", ..] => bench::run(&arguments[1..]),
        ["figures"] => figures::run(),
        ["icount"] => icount::run(false),
        ["icount", "--check"] => icount::run(true),
        ["page", _] | ["page", _, _] => page::run(&arguments[1..]),
        ["release", ..] => release::run(&arguments[1..]),
        ["senders", ..] => senders::run_all(&arguments[1..]),
        ["targets", ..] => targets::run(&arguments[1..]),
        ["thumb", ..] => thumb::run(&arguments[1..]),
        ["--help" | "-h" | "help"] => {
            println!("{USAGE}");
            Ok(())
        }
        words => {
            if let Some(word) = words.first() {
                eprintln!("no command `{}`, or not with these arguments", word);
            }
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}
