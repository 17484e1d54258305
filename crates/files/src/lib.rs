//! Every path that a user gives: how it is read, written and kept.
//!
//! No read is larger than its caller says, so that an endless device ends nothing. An output is
//! whole or not there. What another program may have put under a name is never done away with.
#![forbid(unsafe_code)]

#[cfg(feature = "write")]
mod kept;
#[cfg(feature = "write")]
mod new;
#[cfg(feature = "write")]
mod output;

mod shown;

pub use shown::{plain, plain_json, shown};

#[cfg(feature = "write")]
pub use kept::{Kept, Lock};
#[cfg(feature = "write")]
pub use new::write_new;
#[cfg(feature = "write")]
pub use output::{
    is_input, is_stdout, open_log, spare, target, unless_left, Output, OutputError, Pen,
};

use std::fs::{File, Metadata};
use std::io::{self, Cursor, IsTerminal, Read};
use std::path::Path;

/// A file, a pipe or a terminal that is open to be read.
#[derive(Debug)]
pub struct Opened {
    /// Its size in bytes; `None` for a pipe or a terminal.
    pub size: Option<u64>,
    /// Its bytes.
    pub bytes: io::Chain<Cursor<Vec<u8>>, File>,
}

/// Opens `path` to be read. A pipe waits for its writer.
///
/// # Errors
/// It cannot be opened, is a folder, or is a device that has bytes.
pub fn open(path: &Path) -> io::Result<Opened> {
    let mut file = File::open(path)?;
    let metadata = file.metadata()?;
    if metadata.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    let mut first = Vec::new();
    if is_device(&metadata) && !file.is_terminal() {
        // `/dev/null` is an empty file. Other devices may never end.
        (&mut file).take(1).read_to_end(&mut first)?;
        if !first.is_empty() {
            return Err(io::Error::other("is a device, not a file"));
        }
    }
    Ok(Opened {
        size: metadata.is_file().then_some(metadata.len()),
        bytes: Cursor::new(first).chain(file),
    })
}

/// Reads all of `path`, at most `most` bytes.
///
/// # Errors
/// As [`open`], and if there are more bytes.
pub fn read(path: &Path, most: usize) -> io::Result<Vec<u8>> {
    read_all(open(path)?.bytes, most)
}

/// Reads all of `from`, at most `most` bytes.
///
/// # Errors
/// Errors of reading, and if there are more bytes.
pub fn read_all(from: impl Read, most: usize) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(most as u64 + 1).read_to_end(&mut bytes)?;
    if bytes.len() > most {
        return Err(io::Error::other(format!("has more than {}", size(most))));
    }
    Ok(bytes)
}

/// As [`read`], for text.
///
/// # Errors
/// As [`read`], and if it is no UTF-8.
pub fn read_text(path: &Path, most: usize) -> io::Result<String> {
    let text = String::from_utf8(read(path, most)?);
    text.map_err(|_| io::Error::other("is not text"))
}

/// The most bytes of a file that a person writes: a machine, a board, a list of settings.
pub const WRITTEN_BY_HAND: usize = 4 << 20;

fn size(bytes: usize) -> String {
    match bytes >> 20 {
        0 => format!("{bytes} bytes"),
        mega => format!("{mega} MB"),
    }
}

#[cfg(unix)]
fn is_device(metadata: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    let kind = metadata.file_type();
    kind.is_block_device() || kind.is_char_device()
}

#[cfg(not(unix))]
fn is_device(_: &Metadata) -> bool {
    false
}

/// The examples of the package's README, compiled as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn what_never_ends_is_refused_after_a_byte_and_nothing_is_an_empty_file() {
        for endless in ["/dev/zero", "/dev/urandom"] {
            let error = read(Path::new(endless), 10).unwrap_err();
            assert_eq!(error.to_string(), "is a device, not a file", "{endless}");
        }
        assert_eq!(read(Path::new("/dev/null"), 0).unwrap(), b"");
        let folder = read(Path::new("/"), 10).unwrap_err();
        assert_eq!(folder.kind(), io::ErrorKind::IsADirectory);
    }

    #[test]
    fn a_file_is_read_up_to_its_bound_and_no_further() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), "1234").unwrap();
        assert_eq!(read(file.path(), 4).unwrap(), b"1234");
        assert_eq!(open(file.path()).unwrap().size, Some(4));
        let error = read_all(io::repeat(b'x'), 3 << 20).unwrap_err();
        assert_eq!(error.to_string(), "has more than 3 MB");
    }
}
