//! `leadscrew board`: files that describe boards for the firmware.

use super::said::say;
use super::{unusable, Unusable};
use clap::{Args, Subcommand};
use leadscrew_boards::{Board, BOARDS};
use std::path::{Path, PathBuf};

/// The subcommands of `board`.
#[derive(Subcommand, Debug)]
pub(super) enum BoardCommand {
    /// List the boards that come with the firmware.
    List,
    /// Hold boards against their chip: pins, functions, interrupt lines, clock, flash.
    Check(CheckArgs),
    /// Copy a board's file, to be changed.
    New(NewArgs),
    /// Print the function of each pin, and its place on the board.
    Pins {
        /// A board's file, or the name of one that comes with the firmware.
        #[arg(value_name = "BOARD")]
        board: String,
    },
}

/// Options of `board check`.
#[derive(Args, Debug)]
pub(super) struct CheckArgs {
    /// Boards' files, or names of those that come with the firmware.
    #[arg(value_name = "BOARD", required = true)]
    boards: Vec<String>,
}

/// Options of `board new`.
#[derive(Args, Debug)]
pub(super) struct NewArgs {
    /// The board that comes closest; `leadscrew board list` names them.
    #[arg(long, value_name = "NAME", default_value = "discovery")]
    like: String,
    /// Write this file, which must not be there yet; without it standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Carries out the command; returns false where a board has a mistake.
///
/// # Errors
/// Where a file cannot be read or written, or does not describe a board.
pub(super) fn run(command: &BoardCommand) -> Result<bool, Unusable> {
    match command {
        BoardCommand::List => list(),
        BoardCommand::Check(args) => check(&args.boards),
        BoardCommand::New(args) => new(args),
        BoardCommand::Pins { board } => pins(board),
    }
}

/// The text of a board that comes with the firmware.
fn known(name: &str) -> Option<&'static str> {
    BOARDS
        .iter()
        .find(|(one, _)| *one == name)
        .map(|(_, text)| *text)
}

fn read(board: &str) -> Result<Board, Unusable> {
    Board::find(board, Path::new("")).map_err(unusable)
}

fn list() -> Result<bool, Unusable> {
    for (name, _) in BOARDS {
        say(format!("{name:14} {}", read(name)?.name))?;
    }
    Ok(true)
}

fn check(boards: &[String]) -> Result<bool, Unusable> {
    let mut right = true;
    for name in boards {
        let findings = read(name)?.check();
        for finding in &findings {
            say(format!("{name}: {finding}"))?;
        }
        if findings.is_empty() {
            say(format!("{name}: right"))?;
        }
        right &= findings.is_empty();
    }
    Ok(right)
}

fn new(args: &NewArgs) -> Result<bool, Unusable> {
    let like = &args.like;
    let text = known(like).ok_or_else(|| {
        unusable(format!(
            "no board is called `{like}`: `leadscrew board list` names them"
        ))
    })?;
    match &args.output {
        None => say(text.trim_end())?,
        Some(path) => super::machine::write_new(path, text)?,
    }
    Ok(true)
}

fn pins(board: &str) -> Result<bool, Unusable> {
    say_pins(&read(board)?)
}

/// Prints the board's name and its pins.
///
/// # Errors
/// Where standard output is closed.
pub(super) fn say_pins(board: &Board) -> Result<bool, Unusable> {
    say(&board.name)?;
    for (use_of_it, pin) in board.pins() {
        let place = board.at.get(&pin).map_or("", String::as_str);
        say(format!("{:5} {use_of_it:32} {place}", pin.to_string()))?;
    }
    Ok(true)
}
