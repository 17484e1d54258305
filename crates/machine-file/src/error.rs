//! The reason why a profile cannot be used: the place, the key and the expected value.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Why a profile cannot be used.
#[derive(Debug)]
pub enum ProfileError {
    /// The file cannot be read.
    Unreadable(PathBuf, io::Error),
    /// A value or key in the file is wrong.
    Wrong(Wrong),
}

/// A wrong value or key in a profile.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Wrong {
    /// The file.
    pub file: PathBuf,
    /// Its line, from 1.
    pub line: usize,
    /// The key, with the tables that it is in: `axes.x.travel`. Empty if the text is no TOML.
    pub key: String,
    /// The value that was found, and the expected one.
    pub message: String,
}

impl fmt::Display for ProfileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable(file, error) => {
                write!(
                    f,
                    "{}: cannot be read: {error}",
                    leadscrew_files::shown(file)
                )
            }
            Self::Wrong(wrong) => wrong.fmt(f),
        }
    }
}

impl fmt::Display for Wrong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: ", leadscrew_files::shown(&self.file), self.line)?;
        if !self.key.is_empty() {
            write!(f, "{}: ", self.key)?;
        }
        f.write_str(&self.message)
    }
}

impl std::error::Error for ProfileError {}

impl Wrong {
    /// The text of `file`, which has these bytes.
    pub(super) fn text<'a>(file: &Path, bytes: &'a [u8]) -> Result<&'a str, Self> {
        std::str::from_utf8(bytes).map_err(|error| {
            let before = bytes.get(..error.valid_up_to()).unwrap_or_default();
            let lines = before.iter().filter(|byte| **byte == b'\n').count();
            Self {
                file: file.to_owned(),
                line: lines + 1,
                key: String::new(),
                message: "expected text in UTF-8".to_owned(),
            }
        })
    }

    /// Describes the parser's error in `text`, the content of `file`.
    pub(super) fn new(file: &Path, text: &str, key: String, error: &toml::de::Error) -> Self {
        let start = error.span().map_or(0, |span| span.start);
        // The parser puts "expected …" on a line of its own.
        let message = error.message().trim().replace('\n', ", ");
        Self::at(file, text, start, key, in_words(message))
    }

    /// Describes a mistake in a key of the top level of `text`, the content of `file`.
    pub(super) fn at_key(file: &Path, text: &str, key: &str, message: &str) -> Self {
        let mut starts = text.match_indices(key).map(|(start, _)| start);
        let begins_line = |start: &usize| {
            text[..*start]
                .trim_end_matches([' ', '\t', '['])
                .ends_with('\n')
        };
        let first = |start: &usize| text[..*start].trim_end_matches('[').is_empty();
        let start = starts.find(|start| first(start) || begins_line(start));
        Self::at(
            file,
            text,
            start.unwrap_or(0),
            key.to_owned(),
            message.to_owned(),
        )
    }

    /// Describes a mistake at byte `start` of `text`, the content of `file`.
    pub(super) fn at(file: &Path, text: &str, start: usize, key: String, message: String) -> Self {
        let before = text.get(..start).unwrap_or(text);
        let line = before.matches('\n').count() + 1;
        Self {
            file: file.to_owned(),
            line,
            key,
            message,
        }
    }
}

/// Names the expected value as a person would, not by its type.
fn in_words(message: String) -> String {
    let words = [
        ("f64", "a number"),
        ("u16", "a whole number"),
        ("usize", "a whole number"),
        ("a boolean", "true or false"),
    ];
    let named = words.iter().find_map(|(kind, word)| {
        let begin = message.strip_suffix(kind)?.strip_suffix("expected ")?;
        Some(format!("{begin}expected {word}"))
    });
    let table = || {
        let (begin, _) = message.split_once("expected struct ")?;
        Some(format!("{begin}expected a table"))
    };
    named.or_else(table).unwrap_or(message)
}
