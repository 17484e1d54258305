//! `leadscrew replay`: a recorded conversation with Grbl, held again with this machine in virtual time.

use super::said::say;
use super::{unusable, Unusable};
use crate::replay::{replay, Case, ReplayError};
use clap::Args;
use std::path::{Path, PathBuf};
use std::{fmt, fs, io};

/// Options of `replay`.
#[derive(Args, Debug)]
pub(super) struct ReplayArgs {
    /// The conversation, as JSON.
    case: PathBuf,
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

/// Prints the conversation with this machine's lines.
pub(super) fn run(args: &ReplayArgs) -> Result<bool, Unusable> {
    let case = load(&args.case).map_err(unusable)?;
    let answered =
        replay(&case).map_err(|error| unusable(Failure::BadOp(args.case.clone(), error)))?;
    let text = serde_json::to_string_pretty(&answered).map_err(unusable)?;
    say(text)?;
    Ok(true)
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
