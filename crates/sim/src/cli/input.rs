//! Opens a job: a file or standard input that holds text.

use std::fmt;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};

/// Bytes at the start of a file that are looked at to tell text from a binary file.
const PROBE: u64 = 4096;

/// Why a job cannot be read.
#[derive(Debug)]
pub(super) enum InputError {
    /// The file cannot be opened or read.
    Io(String, io::Error),
    /// The name is that of a directory.
    Directory(String),
    /// There is nothing in the file.
    Empty(String),
    /// The file does not hold text; the offset of a byte that shows it.
    Binary(String, usize),
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io(name, error) => write!(f, "{name}: cannot be read: {error}"),
            Self::Directory(name) => write!(f, "{name}: is a directory, not a G-code file"),
            Self::Empty(name) => write!(f, "{name}: is empty, there is nothing to do"),
            Self::Binary(name, at) => {
                write!(
                    f,
                    "{name}: is not text (a binary file? see the byte at offset {at})"
                )
            }
        }
    }
}

impl std::error::Error for InputError {}

/// A job, ready to be read.
pub(super) struct Job {
    /// What messages call it.
    pub(super) name: String,
    /// Its size in bytes, where that is known.
    pub(super) size: Option<u64>,
    /// Its text.
    pub(super) text: Box<dyn BufRead>,
}

/// Opens the file `name`, standard input where it is `-`.
///
/// # Errors
/// [`InputError`] where it cannot be read or is no text.
pub(super) fn open(name: &str) -> Result<Job, InputError> {
    if name == "-" {
        return from_reader("standard input", None, io::stdin().lock());
    }
    let io_error = |error| InputError::Io(name.to_owned(), error);
    let file = File::open(name).map_err(io_error)?;
    let metadata = file.metadata().map_err(io_error)?;
    if metadata.is_dir() {
        return Err(InputError::Directory(name.to_owned()));
    }
    from_reader(name, Some(metadata.len()), file)
}

fn from_reader(
    name: &str,
    size: Option<u64>,
    mut input: impl Read + 'static,
) -> Result<Job, InputError> {
    let name = name.to_owned();
    let mut head = Vec::new();
    if let Err(error) = (&mut input).take(PROBE).read_to_end(&mut head) {
        return Err(InputError::Io(name, error));
    }
    if head.is_empty() {
        return Err(InputError::Empty(name));
    }
    if let Some(at) = binary_at(&head) {
        return Err(InputError::Binary(name, at));
    }
    let text = BufReader::new(io::Cursor::new(head).chain(input));
    Ok(Job {
        name,
        size,
        text: Box::new(text),
    })
}

/// The offset of the first control byte, where there are too many of them for text: more than one in
/// four. (A few NULs in a text do no harm: the machine drops them.)
fn binary_at(head: &[u8]) -> Option<usize> {
    let control = |b: &u8| *b < 0x20 && !matches!(b, b'\t' | b'\n' | b'\r' | 0x0B | 0x0C);
    let count = head.iter().filter(|b| control(b)).count();
    if count * 4 <= head.len() {
        return None;
    }
    head.iter().position(control)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(bytes: &'static [u8]) -> Result<String, InputError> {
        let mut text = String::new();
        let mut job = from_reader("test", None, bytes)?;
        job.text.read_to_string(&mut text).unwrap();
        Ok(text)
    }

    #[test]
    fn text_comes_through_whole_and_a_few_nuls_do_not_matter() {
        assert_eq!(
            text(b"G0 X1\0\nG1 X2 F100\n").unwrap(),
            "G0 X1\0\nG1 X2 F100\n"
        );
    }

    #[test]
    fn nothing_and_binary_data_are_refused() {
        assert!(matches!(text(b""), Err(InputError::Empty(_))));
        let elf = text(b"\x7fELF\x02\x01\x01\x00\x00\x00");
        assert!(matches!(elf, Err(InputError::Binary(_, 4))));
    }

    #[test]
    fn a_directory_is_named_as_one() {
        assert!(matches!(open("."), Err(InputError::Directory(_))));
        let missing = open("no/such/file").map(|_| ()).unwrap_err().to_string();
        assert!(
            missing.starts_with("no/such/file: cannot be read"),
            "{missing}"
        );
    }
}
