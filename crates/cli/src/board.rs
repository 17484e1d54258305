//! `leadscrew board`: files that describe boards for the firmware.

use super::said::{aside, say};
use super::{unusable, Unusable};
use clap::{Args, Subcommand};
use leadscrew_boards::{Board, BOARDS};
use leadscrew_files::is_stdout;
use leadscrew_record::{Image, Record, MAGIC};
use leadscrew_sim::profile::Profile;
use std::path::{Path, PathBuf};

/// Bytes of the smallest sector, which a record has for itself.
const SMALLEST_SECTOR: usize = 16 << 10;

/// The flash of the largest chip of the family, bytes.
const LARGEST_IMAGE: usize = 2 << 20;

/// The subcommands of `board`.
#[derive(Subcommand, Debug)]
pub(super) enum BoardCommand {
    /// List the boards that come with the firmware.
    List,
    /// Check boards against their chip: pins, functions, interrupt lines, clock, flash.
    Check(CheckArgs),
    /// Copy a board's file, to be changed.
    New(NewArgs),
    /// Print the function of each pin, and its place on the board.
    Pins {
        /// A board's file, or the name of one that comes with the firmware.
        #[arg(value_name = "BOARD")]
        board: String,
    },
    /// Make the record of a board, for a firmware that reads one (`cargo fw --record`).
    Pack(PackArgs),
}

/// Options of `board pack`.
#[derive(Args, Debug)]
pub(super) struct PackArgs {
    /// A board's file, or the name of one that comes with the firmware.
    #[arg(value_name = "BOARD")]
    board: String,
    /// Make the record for the machine of this file, which may have a fourth motor.
    #[arg(long, value_name = "FILE")]
    machine: Option<PathBuf>,
    /// Put the record into this image (`NAME.bin`), so that one file is flashed.
    #[arg(long, value_name = "IMAGE")]
    into: Option<PathBuf>,
    /// Write the record as lines of text. A sender sends them to the firmware, which stores the
    /// record.
    #[arg(long, conflicts_with = "into")]
    lines: bool,
    /// Write this file, which must not be there yet; `-` writes to standard output.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
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
    /// The board to copy, which is most like yours; `leadscrew board list` names them all.
    #[arg(long, value_name = "NAME", default_value = "discovery")]
    like: String,
    /// Write this file, which must not be there yet; without it standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Carries out the command; returns false if a board has a mistake.
///
/// # Errors
/// If a file cannot be read or written, or does not describe a board.
pub(super) fn run(command: &BoardCommand) -> Result<bool, Unusable> {
    match command {
        BoardCommand::List => list(),
        BoardCommand::Check(args) => check(&args.boards),
        BoardCommand::New(args) => new(args),
        BoardCommand::Pins { board } => pins(board),
        BoardCommand::Pack(args) => pack(args),
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
        let is_right = say_findings(name, &read(name)?)?;
        if is_right {
            say(format!("{}: right", leadscrew_files::shown(name)))?;
        }
        right &= is_right;
    }
    Ok(right)
}

/// Prints the mistakes of a board. Returns whether there are none.
fn say_findings(name: &str, board: &Board) -> Result<bool, Unusable> {
    let findings = board.check();
    for finding in &findings {
        say(format!("{}: {finding}", leadscrew_files::shown(name)))?;
    }
    for warning in board.warnings() {
        aside(format!("{name}: warning: {warning}"));
    }
    Ok(findings.is_empty())
}

fn new(args: &NewArgs) -> Result<bool, Unusable> {
    let like = &args.like;
    let text = known(like).ok_or_else(|| {
        unusable(format!(
            "no board is called `{}`: `leadscrew board list` names them",
            leadscrew_files::shown(like)
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
/// If standard output is closed.
pub(super) fn say_pins(board: &Board) -> Result<bool, Unusable> {
    say(&board.name)?;
    for (use_of_it, pin) in board.pins() {
        let place = board.at.get(&pin).map_or("", String::as_str);
        say(format!("{:5} {use_of_it:32} {place}", pin.to_string()))?;
    }
    Ok(true)
}

fn pack(args: &PackArgs) -> Result<bool, Unusable> {
    let board = read(&args.board)?;
    if !say_findings(&args.board, &board)? {
        return Ok(false);
    }
    let place = board.record_sector().zip(board.record_end());
    let (sector, end) = place.ok_or_else(|| {
        unusable(format!(
            "{}: has no sector for its record, or no room for the program behind it",
            leadscrew_files::shown(&args.board)
        ))
    })?;
    let record = record(&board, args.machine.as_deref())?;
    if args.lines {
        let lines = Board::record_lines(&record);
        super::machine::write_new(&args.output, lines.join("\n") + "\n")?;
        let (count, file) = (lines.len(), leadscrew_files::shown(&args.output));
        let image = image_for(&record);
        tell(
            args,
            format!("{file}: {count} lines, to be sent to a firmware of `{image}`"),
        )?;
        return Ok(true);
    }
    let bytes = match &args.into {
        None => record.clone(),
        Some(path) => {
            let image = joined(path, &record, sector.begin - board.start)?;
            let room = end - board.start;
            if image.len() > room as usize {
                let (file, length) = (path.display(), image.len());
                return Err(unusable(format!(
                    "{file}: {length} bytes, and the board has {room} for it: take the image for \
                     boards with less flash"
                )));
            }
            image
        }
    };
    super::machine::write_new(&args.output, &bytes)?;
    let begin = match args.into {
        None => sector.begin,
        Some(_) => board.start,
    };
    let (length, file) = (record.len(), leadscrew_files::shown(&args.output));
    let image = image_for(&record);
    let text = format!(
        "{file}: a record of {length} bytes, to be flashed at {begin:#010x}, for a firmware \
         of `{image}`"
    );
    tell(args, text)?;
    Ok(true)
}

/// Prints `text`. The record may be on standard output itself; then `text` goes to standard error.
fn tell(args: &PackArgs, text: String) -> Result<(), Unusable> {
    if is_stdout(&args.output) {
        aside(text);
        return Ok(());
    }
    say(text)
}

/// The command that builds a firmware for this record.
fn image_for(record: &[u8]) -> &'static str {
    let content = Record::read(record).map(|(record, _)| record.content);
    match content.is_ok_and(|content| Image::Three.takes(&content.shape)) {
        true => "cargo fw --record",
        false => "cargo fw --record --motors 4",
    }
}

/// The record of a board, for the machine of a file if there is one.
fn record(board: &Board, machine: Option<&Path>) -> Result<Vec<u8>, Unusable> {
    let Some(file) = machine else {
        return board.record().map_err(unusable);
    };
    let profile = Profile::load(file).map_err(unusable)?;
    let named = |why: String| unusable(format!("{}: {why}", leadscrew_files::shown(file)));
    let machine = profile.recorded().map_err(|why| named(why.to_string()))?;
    let fitted = profile
        .fitted(board)
        .map_err(|why| named(why.to_string()))?;
    fitted
        .record_for(&machine)
        .map_err(|why| named(why.to_string()))
}

/// The image of `path` with the record put in at `offset`. The image must be empty there, or have
/// another record.
fn joined(path: &Path, record: &[u8], offset: u32) -> Result<Vec<u8>, Unusable> {
    let unread = |why: String| unusable(format!("{}: {why}", leadscrew_files::shown(path)));
    let mut image = leadscrew_files::read(path, LARGEST_IMAGE)
        .map_err(|error| unread(format!("cannot be read: {error}")))?;
    let begin = offset as usize;
    let place = image.get_mut(begin..begin + SMALLEST_SECTOR);
    let place = place.filter(|place| {
        let is_empty = place.iter().all(|byte| *byte == 0xFF);
        is_empty || place.starts_with(&MAGIC.to_le_bytes())
    });
    let place = place
        .ok_or_else(|| unread("has no place for a record where this board has it".to_owned()))?;
    place.fill(0xFF);
    place[..record.len()].copy_from_slice(record);
    Ok(image)
}
