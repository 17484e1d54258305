//! The reasons why a task stops, with messages for the user.
use std::{fmt, io, path::PathBuf, process::ExitStatus};

/// The reason why a task stopped.
#[derive(Debug)]
pub(crate) enum Failure {
    /// A program could not be started.
    NotStarted {
        /// The program's name.
        program: String,
        /// The system's message.
        error: io::Error,
    },
    /// A program ran and did not succeed.
    NotDone {
        /// The program's name.
        program: String,
        /// The status with which it ended.
        status: ExitStatus,
        /// Its text on standard error, unless that was shown already.
        words: String,
    },
    /// A file could not be read or written.
    File {
        /// The path of the file.
        path: PathBuf,
        /// The system's message.
        error: io::Error,
    },
    /// A text has the wrong form.
    Unreadable {
        /// The source of the text: a file and a line, or a program.
        place: String,
        /// The text.
        text: String,
    },
    /// No compiler can build for this target.
    NoCompiler(String),
    /// The command to be counted has no placeholder for the number of lines.
    NoPlaceholder,
    /// The run with twice the lines took fewer instructions.
    FewerInstructions,
    /// Checks failed: one message for each.
    Findings(Vec<String>),
}

impl Failure {
    /// Adds the file to an error of the system; for `map_err`.
    pub(crate) fn file(path: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |error| Failure::File { path, error }
    }

    /// A text has the wrong form.
    pub(crate) fn unreadable(place: impl Into<String>, text: impl Into<String>) -> Self {
        Failure::Unreadable {
            place: place.into(),
            text: text.into(),
        }
    }

    /// Makes the failure of one check.
    pub(crate) fn finding(words: impl Into<String>) -> Self {
        Failure::Findings(vec![words.into()])
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::NotStarted { program, error } => write!(f, "{program}: {error}"),
            Failure::NotDone {
                program,
                status,
                words,
            } => write!(f, "{program}: {status}\n{words}"),
            Failure::File { path, error } => write!(f, "{}: {error}", path.display()),
            Failure::Unreadable { place, text } => write!(f, "{place}: cannot read `{text}`"),
            Failure::NoCompiler(target) => write!(
                f,
                "no Rust compiler for {target}. With rustup:
    rustup target add {target}
On Debian 12:
    apt install rustc-web cargo-web rust-web-src"
            ),
            Failure::NoPlaceholder => {
                f.write_str("the command must say {lines} where the number of lines goes")
            }
            Failure::FewerInstructions => {
                f.write_str("more lines took fewer instructions: is {lines} obeyed?")
            }
            Failure::Findings(findings) => f.write_str(&findings.join("\n")),
        }
    }
}

impl core::error::Error for Failure {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_compiler_that_is_missing_is_named_by_its_target() {
        let words = Failure::NoCompiler("wasm32-unknown-unknown".into()).to_string();
        assert!(words.contains("rustup target add wasm32-unknown-unknown"));
        assert!(!words.contains("thumb"));
    }
}
