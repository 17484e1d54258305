//! `leadscrew replay`: replays a recorded conversation with Grbl with this machine, in virtual
//! time.

use super::input::{self, is_stdin, shown};
use super::said::say;
use super::{all_done, unusable, Unusable};
use clap::Args;
use leadscrew_files::{plain_json, read, read_all};
use leadscrew_sim::replay::{judge, replay, Case, ReplayError};
use std::path::{Path, PathBuf};
use std::{fmt, io};

/// The most bytes of a conversation. The longest recorded one has 0.3 MB.
const LONGEST: usize = 64 << 20;

/// Options of `replay`.
#[derive(Args, Debug)]
pub(super) struct ReplayArgs {
    /// The conversation, as JSON; `-` reads standard input. With --judge there may be several, and
    /// folders of them.
    #[arg(required = true, value_name = "CASE")]
    cases: Vec<PathBuf>,
    /// Print whether this machine's answers agree with the recorded ones, in place of the answers.
    /// If they do not, print where they first differ. The exit status is 1 if any conversation
    /// differs.
    #[arg(long)]
    judge: bool,
}

/// The reason why a conversation cannot be replayed.
#[derive(Debug)]
enum Failure {
    Unreadable(String, io::Error),
    NotACase(String, serde_json::Error),
    BadOp(String, ReplayError),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable(file, error) => {
                write!(f, "{file}: cannot be read: {error}")
            }
            Self::NotACase(file, error) => {
                write!(f, "{file}: not a conversation: {error}")
            }
            Self::BadOp(file, error) => write!(f, "{file}: {error}"),
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
    say(plain_json(&text))?;
    Ok(true)
}

/// Prints for each conversation whether this machine agrees. Goes on after a file that is none.
fn judge_all(names: &[PathBuf]) -> Result<bool, Unusable> {
    let files = input::files(names, &["json"]).map_err(unusable)?;
    let (mut agreed, mut undone) = (0, Vec::new());
    for file in &files {
        let (recorded, answered) = match hold(file) {
            Ok(both) => both,
            Err(message) => {
                undone.push(message);
                continue;
            }
        };
        let name = shown(file);
        match judge(&recorded, &answered) {
            None => {
                agreed += 1;
                say(format!("{name}: agrees"))?;
            }
            Some(differs) => say(format!("{name}: differs: {differs}"))?,
        }
    }
    let judged = files.len() - undone.len();
    if files.len() > 1 {
        say(format!("{agreed} of {judged} conversations agree"))?;
    }
    all_done(&undone)?;
    Ok(agreed == judged)
}

/// Replays a conversation. Returns it as recorded, and with this machine's answers.
fn hold(file: &Path) -> Result<(Case, Case), Unusable> {
    let case = load(file).map_err(unusable)?;
    let answered = replay(&case).map_err(|error| unusable(Failure::BadOp(shown(file), error)))?;
    Ok((case, answered))
}

fn load(file: &Path) -> Result<Case, Failure> {
    let text = match is_stdin(file) {
        true => read_all(io::stdin(), LONGEST),
        false => read(file, LONGEST),
    };
    let text = text.map_err(|error| Failure::Unreadable(shown(file), error))?;
    serde_json::from_slice(&text).map_err(|error| Failure::NotACase(shown(file), error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_conversation_is_named_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("case.json");
        std::fs::write(&file, "{\"exchanges\":\n[{\"op\": 5}]}").unwrap();
        let message = load(&file).unwrap_err().to_string();
        assert!(
            message.contains("case.json: not a conversation") && message.contains("line 2"),
            "{message}"
        );
    }
}
