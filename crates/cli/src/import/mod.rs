//! `leadscrew import`: converts job files of other machines to G-code.

mod direct;
mod drill;
mod others;
mod output;

use super::Unusable;
use clap::Subcommand;
use std::path::PathBuf;

/// The kind of a file.
#[derive(Subcommand, Debug)]
pub(super) enum ImportCommand {
    /// Holes of a circuit board: Excellon files, as KiCad, Eagle, Altium and FlatCAM write them.
    Drill(drill::DrillArgs),
    /// RP code of an extruding prototyping machine.
    Rp(others::RpArgs),
    /// Rows of an engraver: X, Y and burn.
    Rows(others::RowsArgs),
    /// A printer's G-code, as slicers write it for Marlin.
    Print(others::PrintArgs),
}

/// The output for the job.
#[derive(clap::Args, Debug)]
pub(super) struct OutputArgs {
    /// Write the job to this file; `-` writes to standard output.
    #[arg(long, short, value_name = "JOB.nc", default_value = "-")]
    pub(super) output: PathBuf,
    /// Print nothing but errors.
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// Imports a file; returns whether it was understood.
///
/// # Errors
/// If an option or a file cannot be used.
pub(super) fn run(command: &ImportCommand) -> Result<bool, Unusable> {
    match command {
        ImportCommand::Drill(args) => drill::run(args),
        ImportCommand::Rp(args) => others::rp(args),
        ImportCommand::Rows(args) => others::rows(args),
        ImportCommand::Print(args) => others::print(args),
    }
}

pub(super) use direct::direct;
pub(super) use output::{read, shown, write};
