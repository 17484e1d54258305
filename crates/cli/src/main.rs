//! The `leadscrew` command line.
#![forbid(unsafe_code)]
// `println!` and `eprintln!` panic if nobody reads: `said` takes their place.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod align;
mod args;
mod baud;
mod board;
mod calibrate;
mod causes;
mod check;
mod cores;
mod course;
mod import;
mod input;
mod level;
mod machine;
mod picture;
mod playback;
mod profile;
mod replay;
mod report;
mod resume;
mod run;
mod said;
mod serve;
mod serve_args;
mod setting_args;
mod shell;
mod steps_csv;
mod told;
mod trials;
mod vcd;
mod watchers;

use args::{Cli, Command};
use clap::Parser;
use std::fmt::Display;
use std::process::ExitCode;

/// The job met an error or an alarm.
const JOB_FAILED: u8 = 1;
/// Bad usage, unreadable input, unwritable output.
const UNUSABLE: u8 = 2;

/// Runs the command that the process was called with.
///
/// Exit status: 0 done, 1 the job met an error or an alarm, 2 bad usage or unreadable input.
fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Run(args) => run::run(&args),
        Command::Profile(args) => profile::profile(&args),
        Command::Check(args) => check::check(&args),
        Command::Serve(args) => serve::run(&args),
        Command::Replay(args) => replay::run(&args),
        Command::Import(command) => import::run(&command),
        Command::Align(args) => align::align(&args),
        Command::Level(args) => level::level(&args),
        Command::Resume(args) => resume::resume(&args),
        Command::Calibrate(args) => calibrate::calibrate(&args),
        Command::Completions { shell } => shell::completions(shell),
        Command::Machine(command) => machine::run(&command),
        Command::Board(command) => board::run(&command),
        Command::Man(args) => shell::man(&args),
        Command::Schema { of } => shell::schema(of),
    };
    match result {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(JOB_FAILED),
        Err(unusable) => {
            said::aside(format!("leadscrew: {unusable}"));
            ExitCode::from(UNUSABLE)
        }
    }
}

/// The message of a command that could not be carried out at all.
type Unusable = Box<dyn Display>;

fn unusable<E: Display + 'static>(error: E) -> Unusable {
    Box::new(error)
}

/// The result of a command that went on after jobs which could not be done. The error has their
/// messages, one a line.
fn all_done(undone: &[Unusable]) -> Result<(), Unusable> {
    let messages: Vec<String> = undone.iter().map(ToString::to_string).collect();
    match messages.as_slice() {
        [] => Ok(()),
        messages => Err(unusable(messages.join("\nleadscrew: "))),
    }
}
