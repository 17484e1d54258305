//! The machine from the command line: a machine file, overridden by a settings file, overridden by
//! single settings.

use super::said::aside;
use super::{unusable, Unusable};
use clap::Args;
use leadscrew_jobs::{capped, settings_file, Machine};
use leadscrew_sim::profile::Profile;
use std::path::{Path, PathBuf};

/// The machine's settings.
#[derive(Args, Debug)]
pub(super) struct SettingArgs {
    /// The machine, a TOML file; without it a stock Grbl without switches. See `leadscrew machine
    /// new`.
    #[arg(long, value_name = "FILE")]
    pub(super) machine: Option<PathBuf>,
    /// A file of settings, lines as `$$` prints them.
    #[arg(long, value_name = "FILE")]
    pub(super) settings: Option<PathBuf>,
    /// One setting, such as '$110=6000'; may be repeated, later ones win.
    #[arg(long = "set", value_name = "$N=VALUE")]
    pub(super) set: Vec<String>,
}

impl SettingArgs {
    /// The files that are read for a job: the job itself, and the machine's.
    pub(super) fn inputs<'a>(&'a self, job: &'a Path) -> Vec<&'a Path> {
        let files = [&self.machine, &self.settings].into_iter().flatten();
        files.map(PathBuf::as_path).chain([job]).collect()
    }
}

/// Reads the machine's file and all settings, and puts them into effect one after the other.
///
/// # Errors
/// The first line that is no setting or is refused, with its origin and GRBL's words.
pub(super) fn machine(args: &SettingArgs) -> Result<Machine, Unusable> {
    let file = args.machine.as_deref().map(Profile::load).transpose();
    let file = file.map_err(unusable)?.unwrap_or_default();
    let mut lines = match &args.settings {
        Some(path) => settings_file::read(path).map_err(unusable)?,
        None => Vec::new(),
    };
    for option in &args.set {
        lines.push(settings_file::option(option).map_err(unusable)?);
    }
    Machine::new(file, &lines).map_err(unusable)
}

/// Prints on standard error which rates the machine cannot reach.
pub(super) fn say_capped(machine: &Machine) {
    for words in capped(machine) {
        aside(format!("note: {words}"));
    }
}
