//! The text of a command on standard output and standard error.

use super::{unusable, Unusable};
use std::fmt::Display;
use std::io::{self, stderr, stdout, ErrorKind, Write};

/// Writes a text to standard output and ends its last line.
///
/// # Errors
/// Where standard output cannot be written, for example because a disk is full.
pub(super) fn say(text: impl Display) -> Result<(), Unusable> {
    put(format!("{}\n", text.to_string().trim_end()).as_bytes())
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
    let _ = stderr().write_all(format!("{text}\n").as_bytes());
}

/// The outcome of writing to standard output. A reader that has closed it early (`| head`) is no
/// failure.
///
/// # Errors
/// Every other failure.
pub(super) fn unless_left(written: io::Result<()>) -> io::Result<()> {
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}
