//! Help for shells and their users: completions, manual pages, schemas of `--json`.

use super::args::{Cli, ManArgs, Shape};
use super::report::RunJson;
use super::said::say;
use super::{unusable, Unusable};
use clap::CommandFactory;
use clap_complete::{generate, Shell};
use leadscrew_files::Output;
use leadscrew_jobs::{CheckJson, ProfileJson};
use leadscrew_sim::profile::Profile;
use schemars::schema_for;
use std::path::Path;

const NAME: &str = "leadscrew";

/// Prints the completions for a shell.
///
/// # Errors
/// If standard output cannot be written.
pub(super) fn completions(shell: Shell) -> Result<bool, Unusable> {
    let mut text = Vec::new();
    generate(shell, &mut Cli::command(), NAME, &mut text);
    say(String::from_utf8_lossy(&text)).map(|()| true)
}

/// Prints the manual page, or writes the pages of all commands into a folder.
///
/// # Errors
/// If the folder or standard output cannot be written.
pub(super) fn man(args: &ManArgs) -> Result<bool, Unusable> {
    if let Some(folder) = &args.folder {
        let made = std::fs::create_dir_all(folder);
        made.map_err(|error| {
            unusable(format!(
                "{}: cannot be written: {error}",
                leadscrew_files::shown(folder)
            ))
        })?;
        let mut command = Cli::command().disable_help_subcommand(true);
        command.build();
        return write_pages(&command, folder).map(|()| true);
    }
    let mut text = Vec::new();
    let page = clap_mangen::Man::new(Cli::command());
    page.render(&mut text).map_err(unusable)?;
    say(String::from_utf8_lossy(&text)).map(|()| true)
}

/// Writes the manual pages of a command and of those under it.
fn write_pages(command: &clap::Command, folder: &Path) -> Result<(), Unusable> {
    let shown = |command: &&clap::Command| !command.is_hide_set();
    for below in command.get_subcommands().filter(shown) {
        write_pages(below, folder)?;
    }
    let page = clap_mangen::Man::new(command.clone());
    let output = Output::create(&folder.join(page.get_filename())).map_err(unusable)?;
    let written = page.render(&mut output.pen());
    output.complete(written).map_err(unusable)
}

/// Prints the JSON schema of a command's output, or of a machine file.
///
/// # Errors
/// If standard output cannot be written.
pub(super) fn schema(of: Shape) -> Result<bool, Unusable> {
    let schema = match of {
        Shape::Run => schema_for!(RunJson<'_>),
        Shape::Check => schema_for!(CheckJson<'_>),
        Shape::Profile => schema_for!(ProfileJson<'_>),
        Shape::Machine => schema_for!(Profile),
    };
    say(serde_json::to_string_pretty(&schema).map_err(unusable)?).map(|()| true)
}
