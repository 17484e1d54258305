//! `leadscrew machine`: makes a new machine file, and prints how the machine is wired to its board.

use super::board::say_pins;
use super::said::{put, say};
use super::{unusable, Unusable};
use clap::{Args, Subcommand, ValueEnum};
use leadscrew_boards::Board;
use leadscrew_files::is_stdout;
use leadscrew_sim::profile::Profile;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The subcommands of `machine`.
#[derive(Subcommand, Debug)]
pub(super) enum MachineCommand {
    /// Copy a machine file with every key explained, to be changed.
    New(NewArgs),
    /// Print the pins of the machine's board: the function of each, and its place on the board.
    Pins(PinsArgs),
}

/// Options of `machine pins`.
#[derive(Args, Debug)]
pub(super) struct PinsArgs {
    /// The machine's file.
    #[arg(value_name = "FILE")]
    machine: PathBuf,
    /// A board's file, or the name of one that comes with the firmware, in place of the board that
    /// the machine's file names.
    #[arg(long, value_name = "BOARD")]
    board: Option<String>,
}

/// The board of a machine whose file gives none.
const DISCOVERY: &str = "discovery";

/// Options of `machine new`.
#[derive(Args, Debug)]
pub(super) struct NewArgs {
    /// The machine to copy, which is most like yours.
    #[arg(long, value_name = "MACHINE", default_value = "router")]
    like: Example,
    /// Write this file, which must not be there yet; without it standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Machines that a file can begin as.
#[derive(Clone, Copy, ValueEnum, Debug)]
enum Example {
    /// Three screws, switches at both ends, a touch plate, a door: every key explained.
    Router,
    /// A diode laser on belts.
    Laser,
    /// A drill for circuit boards: M6 for its bits.
    Drill,
    /// Three screws without switches.
    Engraver,
    /// A pen on crossed belts (CoreXY).
    Plotter,
    /// A filament printer: nozzle, bed, fan, E.
    Printer,
}

impl Example {
    fn text(self) -> &'static str {
        match self {
            Self::Router => include_str!("../machines/router.toml"),
            Self::Laser => include_str!("../machines/laser.toml"),
            Self::Drill => include_str!("../machines/drill.toml"),
            Self::Engraver => include_str!("../machines/engraver.toml"),
            Self::Plotter => include_str!("../machines/plotter.toml"),
            Self::Printer => include_str!("../machines/printer.toml"),
        }
    }
}

/// Carries out the command.
///
/// # Errors
/// If a file cannot be read or written, or the machine does not fit its board.
pub(super) fn run(command: &MachineCommand) -> Result<bool, Unusable> {
    match command {
        MachineCommand::New(args) => new(args),
        MachineCommand::Pins(args) => pins(args),
    }
}

fn new(args: &NewArgs) -> Result<bool, Unusable> {
    let text = args.like.text();
    let Some(path) = &args.output else {
        return say(text.trim_end()).map(|()| true);
    };
    write_new(path, text).map(|()| true)
}

fn pins(args: &PinsArgs) -> Result<bool, Unusable> {
    let file = &args.machine;
    let profile = Profile::load(file).map_err(unusable)?;
    let (asked, folder) = match (&args.board, &profile.board) {
        (Some(asked), _) => (asked.as_str(), Path::new("")),
        (None, Some(named)) => (named.as_str(), file.parent().unwrap_or(Path::new(""))),
        (None, None) => (DISCOVERY, Path::new("")),
    };
    let board = Board::find(asked, folder).map_err(unusable)?;
    let unfit = |why| unusable(format!("{}: {why}", leadscrew_files::shown(file)));
    let board = profile.fitted(&board).map_err(unfit)?;
    say(motors(&profile))?;
    say_pins(&board)
}

/// The motors, named by the numbers that the list of pins uses.
fn motors(profile: &Profile) -> String {
    let mut motors: Vec<String> = profile.letters().iter().map(char::to_string).collect();
    let second = profile.second_motor.map(|second| second.axis.number());
    motors.extend(second.map(|axis| format!("second {}", motors[axis])));
    let places = (1..=3).map(|number| format!("motor {number}"));
    let places = places.chain((1..).map(|number| format!("spare motor {number}")));
    let named = places.zip(motors);
    let named: Vec<String> = named
        .map(|(place, motor)| format!("{place} {motor}"))
        .collect();
    named.join(", ")
}

/// Writes a file that must not exist yet; `-` is standard output.
///
/// # Errors
/// If it exists already or cannot be written.
pub(super) fn write_new(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Unusable> {
    if is_stdout(path) {
        return put(bytes.as_ref());
    }
    leadscrew_files::write_new(path, bytes.as_ref()).map_err(|error| {
        let name = leadscrew_files::shown(path);
        match error.kind() {
            ErrorKind::AlreadyExists => {
                unusable(format!("{name}: is there already: choose another name"))
            }
            _ => unusable(format!("{name}: cannot be written: {error}")),
        }
    })
}
