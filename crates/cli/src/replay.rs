//! `leadscrew replay`: replays a recorded conversation with Grbl with this machine, in virtual
//! time.

use super::input;
use super::said::say;
use super::{unusable, Unusable};
use clap::Args;
use leadscrew_sim::replay::{judge, replay, Case, ReplayError};
use std::path::{Path, PathBuf};
use std::{fmt, fs, io};

/// Options of `replay`.
#[derive(Args, Debug)]
pub(super) struct ReplayArgs {
    /// The conversation, as JSON. With --judge there may be several, and folders of them.
    #[arg(required = true, value_name = "CASE")]
    cases: Vec<PathBuf>,
    /// Print whether this machine's answers agree with the recorded ones, in place of the answers.
    /// If they do not, print where they first differ. The exit status is 1 if any conversation
    /// differs.
    #[arg(long)]
    judge: bool,
}

/// Why a conversation cannot be replayed.
#[derive(Debug)]
enum Failure {
    Unreadable(PathBuf, io::Error),
    NotACase(PathBuf, serde_json::Error),
    BadOp(PathBuf, ReplayError),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable(file, error) => {
                write!(f, "{}: cannot be read: {error}", file.display())
            }
            Self::NotACase(file, error) => {
                write!(f, "{}: not a conversation: {error}", file.display())
            }
            Self::BadOp(file, error) => write!(f, "{}: {error}", file.display()),
        }
    }
}

/// Prints the conversation with this machine's lines, or the verdicts on several.
pub(super) fn run(args: &ReplayArgs) -> Result<bool, Unusable> {
    if args.judge {
        return judge_all(&args.cases);
    }
    let [file] = &args.cases[..] else {
        return Err(unusable(
            "without --judge one conversation is answered: name one file",
        ));
    };
    let (_, answered) = hold(file)?;
    let text = serde_json::to_string_pretty(&answered).map_err(unusable)?;
    say(text)?;
    Ok(true)
}

/// Prints for each conversation whether this machine agrees.
fn judge_all(names: &[PathBuf]) -> Result<bool, Unusable> {
    let files = input::files(names, &["json"]).map_err(unusable)?;
    let mut agreed = 0;
    for file in &files {
        let (recorded, answered) = hold(file)?;
        let name = file.display();
        match judge(&recorded, &answered) {
            None => {
                agreed += 1;
                say(format!("{name}: agrees"))?;
            }
            Some(differs) => say(format!("{name}: differs: {differs}"))?,
        }
    }
    if files.len() > 1 {
        say(format!("{agreed} of {} conversations agree", files.len()))?;
    }
    Ok(agreed == files.len())
}

/// Replays a conversation. Returns it as recorded, and with this machine's answers.
fn hold(file: &Path) -> Result<(Case, Case), Unusable> {
    let case = load(file).map_err(unusable)?;
    let answered =
        replay(&case).map_err(|error| unusable(Failure::BadOp(file.to_owned(), error)))?;
    Ok((case, answered))
}

fn load(file: &Path) -> Result<Case, Failure> {
    let text =
        fs::read_to_string(file).map_err(|error| Failure::Unreadable(file.to_owned(), error))?;
    serde_json::from_str(&text).map_err(|error| Failure::NotACase(file.to_owned(), error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_conversation_is_named_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("case.json");
        fs::write(&file, "{\"exchanges\":\n[{\"op\": 5}]}").unwrap();
        let message = load(&file).unwrap_err().to_string();
        assert!(
            message.contains("case.json: not a conversation") && message.contains("line 2"),
            "{message}"
        );
    }
}
