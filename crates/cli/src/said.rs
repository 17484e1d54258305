//! The text of a command on standard output.

use super::{unusable, Unusable};
use std::fmt::Display;
use std::io::{stdout, ErrorKind, Write};

/// Writes a text to standard output and ends its last line; a reader who has seen enough (`| head`)
/// is no failure.
///
/// # Errors
/// Where standard output cannot be written: a full disk.
pub(super) fn say(text: impl Display) -> Result<(), Unusable> {
    let mut out = stdout().lock();
    let text = text.to_string();
    match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(unusable(format!("standard output: {error}")))
        }
        Ok(()) | Err(_) => Ok(()),
    }
}
