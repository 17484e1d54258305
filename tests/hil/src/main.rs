//! Compares the edges that a board has captured at its own pins with the simulator's: `cargo hil`,
//! docs/hil.md.
//!
//! ```text
//!  job --text--> Board ==serial line==> self-test's image: steps, power --wires--> captures
//!   |              ^                                                                  |
//!   |              +------------------- edges ----------------------------------------+
//!   +----------> plan: the same job in the simulator ------> checks ------> report
//! ```
#![forbid(unsafe_code)]
mod board;
mod checks;
mod edges;
mod emulated;
#[path = "../../firmware/src/failure.rs"]
mod failure;
mod link;
mod plan;
mod planted;
mod report;
mod wires;

use crate::{
    board::Board,
    checks::CHECKS,
    emulated::{Emulated, Fault},
    failure::{fail, Failure},
    link::{Link, Port, BAUD},
    planted::PLANTED,
    report::Report,
    wires::Wires,
};
use std::{env, fs, process::ExitCode};

const USAGE: &str = "usage: hil --port NAME [--baud RATE] [--report FILE]
       hil --emulated ELF [--report FILE]
       hil --planted ELF
       hil --wires";

/// The report's file, unless another is named.
const REPORT: &str = "hil-report.txt";

/// The variable in which `cargo hil` passes the version of the sources.
const SOURCES: &str = "LEADSCREW_SOURCES";

/// The task.
enum Task {
    /// A board at a serial port.
    Board { port: String, baud: u32 },
    /// An emulated board that runs this image.
    Emulated { elf: String },
    /// Emulated boards, each with one planted fault.
    Planted { elf: String },
    /// The table of wires.
    Wires,
}

/// The arguments.
struct Request {
    task: Task,
    report: String,
}

impl Request {
    /// Reads the arguments; `None` if they are not valid.
    fn read(mut words: impl Iterator<Item = String>) -> Option<Self> {
        let (mut task, mut baud, mut report) = (None, BAUD, REPORT.to_owned());
        while let Some(word) = words.next() {
            match word.as_str() {
                "--wires" => task = Some(Task::Wires),
                "--baud" => baud = words.next()?.parse().ok()?,
                "--report" => report = words.next()?,
                "--port" => {
                    let port = words.next()?;
                    task = Some(Task::Board { port, baud });
                }
                "--emulated" => {
                    let elf = words.next()?;
                    task = Some(Task::Emulated { elf });
                }
                "--planted" => {
                    let elf = words.next()?;
                    task = Some(Task::Planted { elf });
                }
                _ => return None,
            }
        }
        if let Some(Task::Board { baud: named, .. }) = &mut task {
            *named = baud;
        }
        Some(Request {
            task: task?,
            report,
        })
    }
}

fn main() -> ExitCode {
    let Some(request) = Request::read(env::args().skip(1)) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    match run(&request) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(Failure(words)) => {
            eprintln!("error: {words}");
            ExitCode::FAILURE
        }
    }
}

/// Does the task. Returns whether everything holds.
fn run(request: &Request) -> Result<bool, Failure> {
    let wires = Wires::read()?;
    let report = match &request.task {
        Task::Wires => {
            print!("{wires}");
            return Ok(true);
        }
        Task::Planted { elf } => return find_planted(&read(elf)?, &wires),
        Task::Emulated { elf } => {
            let mut link = Emulated::switch_on(&read(elf)?, &wires, Fault::None)?;
            Board::new(&mut link).hear_boot()?;
            measure(&mut link, true)?
        }
        Task::Board { port, baud } => measure(&mut Port::open(port, *baud)?, false)?,
    };
    print!("{report}");
    let file = &request.report;
    let unwritten = |error| Failure(format!("{file}: {error}"));
    fs::write(file, report.to_string()).map_err(unwritten)?;
    println!("\nwritten to {file}");
    Ok(report.holds())
}

fn read(elf: &str) -> Result<Vec<u8>, Failure> {
    fs::read(elf).map_err(|error| Failure(format!("{elf}: {error}")))
}

/// Runs all checks on one board.
fn measure(link: &mut dyn Link, is_emulated: bool) -> Result<Report, Failure> {
    let name = link.name();
    let mut board = Board::new(link);
    board.reset()?;
    let build = board.command("$I")?;
    if board.command("M122").is_err() {
        return fail(
            "the board answers, but not as the self-test's image does: `cargo hil --flash`",
        );
    }
    let mut sections = Vec::new();
    for check in CHECKS {
        let section = check.run(&mut board);
        let verdict = if section.holds() { "ok" } else { "FAILED" };
        eprintln!("{verdict:<7}{}", check.name);
        sections.push(section);
    }
    // Restore the default settings. If that fails, the report must not be lost.
    let forgotten = board.reset().and_then(|()| board.command("$RST=$"));
    if let Err(Failure(words)) = forgotten {
        eprintln!("note: the board keeps the last job's settings: {words}");
    }
    Ok(Report {
        sources: env::var(SOURCES).unwrap_or_else(|_| "unknown".into()),
        link: name,
        build,
        is_emulated,
        sections,
    })
}

/// Runs the check for each planted fault. Returns whether all faults are found.
fn find_planted(elf: &[u8], wires: &Wires) -> Result<bool, Failure> {
    let mut all = true;
    for planted in PLANTED {
        match planted.hold(elf, wires) {
            Ok(found) => println!("found   {:<45} {found}", planted.name),
            Err(Failure(words)) => {
                println!("MISSED  {:<45} {words}", planted.name);
                all = false;
            }
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(words: &str) -> Option<Request> {
        Request::read(words.split(' ').map(str::to_owned))
    }

    #[test]
    fn a_port_has_its_rate_wherever_that_is_named() {
        for words in ["--port /dev/x --baud 115200", "--baud 115200 --port /dev/x"] {
            let task = request(words).map(|request| request.task);
            assert!(
                matches!(task, Some(Task::Board { baud: 115_200, .. })),
                "{words}"
            );
        }
        assert!(request("--port").is_none() && request("--report x").is_none());
    }
}
