//! Help for shells and their users: completions, manual pages, schemas of `--json`.

use super::args::{Cli, ManArgs, Shape};
use super::report::RunJson;
use super::said::say;
use super::{unusable, Unusable};
use clap::CommandFactory;
use clap_complete::{generate, Shell};
use leadscrew_jobs::{CheckJson, ProfileJson};
use leadscrew_sim::profile::Profile;
use schemars::schema_for;

const NAME: &str = "leadscrew";

/// Prints the completions for a shell.
///
/// # Errors
/// Where standard output cannot be written.
pub(super) fn completions(shell: Shell) -> Result<bool, Unusable> {
    let mut text = Vec::new();
    generate(shell, &mut Cli::command(), NAME, &mut text);
    say(String::from_utf8_lossy(&text)).map(|()| true)
}

/// Prints the manual page, or writes the pages of all commands into a folder.
///
/// # Errors
/// Where the folder or standard output cannot be written.
pub(super) fn man(args: &ManArgs) -> Result<bool, Unusable> {
    if let Some(folder) = &args.folder {
        let written = clap_mangen::generate_to(Cli::command(), folder);
        let unwritable =
            |error| unusable(format!("{}: cannot be written: {error}", folder.display()));
        return written.map(|()| true).map_err(unwritable);
    }
    let mut text = Vec::new();
    let page = clap_mangen::Man::new(Cli::command());
    page.render(&mut text).map_err(unusable)?;
    say(String::from_utf8_lossy(&text)).map(|()| true)
}

/// Prints the JSON schema of a command's output, or of a machine file.
///
/// # Errors
/// Where standard output cannot be written.
pub(super) fn schema(of: Shape) -> Result<bool, Unusable> {
    let schema = match of {
        Shape::Run => schema_for!(RunJson<'_>),
        Shape::Check => schema_for!(CheckJson<'_>),
        Shape::Profile => schema_for!(ProfileJson<'_>),
        Shape::Machine => schema_for!(Profile),
    };
    say(serde_json::to_string_pretty(&schema).map_err(unusable)?).map(|()| true)
}
