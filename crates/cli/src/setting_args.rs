//! The machine from the command line: a machine file, a settings file over that, then single
//! settings.

use super::{unusable, Unusable};
use clap::Args;
use leadscrew_jobs::{capped, settings_file, Machine};
use leadscrew_sim::profile::Profile;
use std::path::PathBuf;

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

/// Reads the machine's file and all settings, and puts them into effect one after the other.
///
/// # Errors
/// The first that is no setting or is refused, with where it came from and GRBL's words for it.
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

/// Says on the standard error output where motion is capped.
pub(super) fn say_capped(machine: &Machine) {
    for words in capped(machine) {
        eprintln!("note: {words}");
    }
}
