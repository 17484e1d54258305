//! The text of a command on standard output and standard error.

use super::{unusable, Unusable};
use leadscrew_files::{plain, unless_left};
use std::fmt::Display;
use std::io::{stderr, stdout, IsTerminal, Write};

/// Writes a text to standard output and ends its last line. Control characters are spelled.
///
/// # Errors
/// If standard output cannot be written, for example because a disk is full.
pub(super) fn say(text: impl Display) -> Result<(), Unusable> {
    put(format!("{}\n", plain(text.to_string().trim_end())).as_bytes())
}

/// Writes bytes to standard output.
///
/// # Errors
/// If it cannot be written.
pub(super) fn put(bytes: &[u8]) -> Result<(), Unusable> {
    let mut out = stdout().lock();
    let written = out.write_all(bytes).and_then(|()| out.flush());
    unless_left(written).map_err(|error| unusable(format!("standard output: {error}")))
}

/// Writes a line to standard error. If nobody reads it, or it is full, the command goes on. On a
/// terminal the kind of a message has a colour, unless `NO_COLOR` is set (<https://no-color.org>).
pub(super) fn aside(text: impl Display) {
    let mut line = format!("{}\n", plain(&text.to_string()));
    if stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|set| set.is_empty()) {
        line = coloured(&line);
    }
    let _ = stderr().write_all(line.as_bytes());
}

/// The words by which a message says its kind, and their colours, as a terminal takes them.
const KINDS: [(&str, &str); 4] = [
    ("error:", "1;31"),
    ("ALARM:", "1;31"),
    ("warning", "1;33"),
    ("note:", "36"),
];

/// A message whose first line has its kind in colour: `job.nc:3:1: error:20: ...`. The kind stands
/// at the line's start, or behind the place.
fn coloured(text: &str) -> String {
    let begin = |word: &str| match text.starts_with(word) {
        true => Some(0),
        false => text.find(&format!(": {word}")).map(|at| at + 2),
    };
    let ends_first_line = text.find('\n').unwrap_or(text.len());
    let kinds = KINDS.iter();
    let found = kinds.filter_map(|(word, colour)| begin(word).map(|at| (at, *colour)));
    let Some((at, colour)) = found.min().filter(|(at, _)| *at < ends_first_line) else {
        return text.to_owned();
    };
    let (before, rest) = text.split_at(at);
    let behind_number = |end: usize| {
        let digits = rest[end + 1..].find(|c: char| !c.is_ascii_digit());
        digits.map_or(rest.len(), |digits| end + 1 + digits)
    };
    let kind_ends = rest.find([':', ' ']).map_or(rest.len(), behind_number);
    let (kind, rest) = rest.split_at(kind_ends);
    format!("{before}\x1b[{colour}m{kind}\x1b[0m{rest}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kind_of_a_message_has_a_colour_and_nothing_else_has() {
        for (plain, expected) in [
            (
                "a.nc:3:1: error:20: no\n  error:1\n",
                "a.nc:3:1: \x1b[1;31merror:20\x1b[0m: no\n  error:1\n",
            ),
            (
                "a.nc:3: ALARM:2: no\n",
                "a.nc:3: \x1b[1;31mALARM:2\x1b[0m: no\n",
            ),
            (
                "a.nc:3: warning: error: so\n",
                "a.nc:3: \x1b[1;33mwarning:\x1b[0m error: so\n",
            ),
            ("note: a.drl\n", "\x1b[36mnote:\x1b[0m a.drl\n"),
            (
                "leadscrew: 3 jobs\n: error:1\n",
                "leadscrew: 3 jobs\n: error:1\n",
            ),
            ("3 lines, no error\n", "3 lines, no error\n"),
        ] {
            assert_eq!(coloured(plain), expected);
        }
    }
}
