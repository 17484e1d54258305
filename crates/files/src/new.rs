//! Files that must not be there yet.

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

/// Writes a file that must not be there yet. If that fails, nothing is left of it.
///
/// # Errors
/// `AlreadyExists` if it is there; errors of writing.
pub fn write_new(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
    // Only a file that was synced is on the disk: a full disk may tell so as late as that.
    let written = file.write_all(bytes).and_then(|()| file.sync_all());
    if written.is_err() {
        // The file is ours and unfinished. If it cannot be removed, the error is said all the same.
        let _ = fs::remove_file(path);
    }
    written
}
