//! `leadscrew machine`: begins a machine file.

use super::said::say;
use super::{unusable, Unusable};
use clap::{Args, Subcommand, ValueEnum};
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The subcommands of `machine`.
#[derive(Subcommand, Debug)]
pub(super) enum MachineCommand {
    /// Copy a machine file with every key explained, to be changed.
    New(NewArgs),
}

/// Options of `machine new`.
#[derive(Args, Debug)]
pub(super) struct NewArgs {
    /// The machine that comes closest.
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
}

impl Example {
    fn text(self) -> &'static str {
        match self {
            Self::Router => include_str!("../machines/router.toml"),
            Self::Laser => include_str!("../machines/laser.toml"),
        }
    }
}

/// Writes the file.
///
/// # Errors
/// Where it is there already or cannot be written.
pub(super) fn run(command: &MachineCommand) -> Result<bool, Unusable> {
    let MachineCommand::New(args) = command;
    let text = args.like.text();
    let Some(path) = &args.output else {
        return say(text.trim_end()).map(|()| true);
    };
    write_new(path, text).map(|()| true)
}

/// Writes a file that must not be there yet.
///
/// # Errors
/// Where it is there already or cannot be written.
pub(super) fn write_new(path: &Path, text: &str) -> Result<(), Unusable> {
    let file = OpenOptions::new().write(true).create_new(true).open(path);
    let written = file.and_then(|mut file| file.write_all(text.as_bytes()));
    written.map_err(|error| {
        let name = path.display();
        match error.kind() {
            ErrorKind::AlreadyExists => unusable(format!("{name}: is there already")),
            _ => unusable(format!("{name}: cannot be written: {error}")),
        }
    })
}
