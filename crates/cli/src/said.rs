//! The text of a command on standard output and standard error.

use super::{unusable, Unusable};
use leadscrew_files::{plain, unless_left};
use std::fmt::Display;
use std::io::{stderr, stdout, Write};

/// Writes a text to standard output and ends its last line. Control characters are spelled.
///
/// # Errors
/// Where standard output cannot be written, for example because a disk is full.
pub(super) fn say(text: impl Display) -> Result<(), Unusable> {
    put(format!("{}\n", plain(text.to_string().trim_end())).as_bytes())
}

/// Writes bytes to standard output.
///
/// # Errors
/// Where it cannot be written.
pub(super) fn put(bytes: &[u8]) -> Result<(), Unusable> {
    let mut out = stdout().lock();
    let written = out.write_all(bytes).and_then(|()| out.flush());
    unless_left(written).map_err(|error| unusable(format!("standard output: {error}")))
}

/// Writes a line to standard error. Where nobody reads it, or it is full, the command goes on.
pub(super) fn aside(text: impl Display) {
    let _ = stderr().write_all(format!("{}\n", plain(&text.to_string())).as_bytes());
}
