//! The project's own commands: `cargo xtask NAME`, or `cargo fw`.
mod fw;
mod shell;
mod toolchain;

use std::{env, process::ExitCode};

const USAGE: &str = "usage: cargo xtask COMMAND
    fw [ARGUMENTS]     build the firmware; ARGUMENTS go to `cargo build`";

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words.as_slice() {
        ["fw", ..] => fw::run(&arguments[1..]),
        _ => {
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
