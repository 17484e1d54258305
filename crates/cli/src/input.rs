//! Opens a job: a file or standard input that holds text.

use leadscrew_jobs::drawing;
use std::fmt;
use std::fs;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Bytes at the start of a file that decide whether it is text or binary.
const PROBE: u64 = 4096;

/// The reason why a job cannot be read.
#[derive(Debug)]
pub(super) enum InputError {
    /// The file cannot be opened or read.
    Io(String, io::Error),
    /// The name is that of a directory.
    Directory(String),
    /// The directory has no file with one of these endings.
    NoJob(String, String),
    /// The file is empty.
    Empty(String),
    /// The file is text of 16 bits a character.
    Wide(String),
    /// The file is this, and no machine follows it.
    Drawing(String, &'static str),
    /// The file does not hold text; with the offset of the first control byte.
    Binary(String, usize),
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io(name, error) => write!(f, "{name}: cannot be read: {error}"),
            Self::Directory(name) => write!(f, "{name}: is a directory, not a G-code file"),
            Self::NoJob(name, endings) => write!(f, "{name}: no file in it is a *.{endings}"),
            Self::Empty(name) => write!(f, "{name}: is empty, there is nothing to do"),
            Self::Wide(name) => {
                write!(f, "{name}: is UTF-16 text: save it as UTF-8 or ASCII")
            }
            Self::Drawing(name, what) => write!(
                f,
                "{name}: is {what}. It is not supported: let a CAM program make G-code of it"
            ),
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
    /// The name in messages.
    pub(super) name: String,
    /// Its size in bytes, if that is known.
    pub(super) size: Option<u64>,
    /// Its first bytes.
    pub(super) head: Vec<u8>,
    /// Its text.
    pub(super) text: Box<dyn BufRead>,
}

impl Job {
    /// Reads the job into memory, so that it can be read more than once, from its start.
    ///
    /// # Errors
    /// [`InputError::Io`] if it cannot be read to its end.
    pub(super) fn keep(&mut self) -> Result<Rc<[u8]>, InputError> {
        let mut bytes = Vec::new();
        if let Err(error) = self.text.read_to_end(&mut bytes) {
            return Err(InputError::Io(self.name.clone(), error));
        }
        let bytes: Rc<[u8]> = bytes.into();
        self.text = Box::new(BufReader::new(io::Cursor::new(Rc::clone(&bytes))));
        Ok(bytes)
    }
}

/// The endings of G-code files; in folders, files with other endings are ignored.
const ENDINGS: [&str; 9] = ["nc", "gcode", "ngc", "gc", "g", "tap", "cnc", "ncc", "eia"];

/// The jobs that `names` stand for. A folder stands for all G-code in it and in its subfolders,
/// sorted by name.
///
/// # Errors
/// [`InputError`] if a folder cannot be read or has no such file.
pub(super) fn jobs(names: &[PathBuf]) -> Result<Vec<PathBuf>, InputError> {
    files(names, &ENDINGS)
}

/// As [`jobs`], for files with other endings.
///
/// # Errors
/// [`InputError`] if a folder cannot be read or has no such file.
pub(super) fn files(names: &[PathBuf], endings: &[&str]) -> Result<Vec<PathBuf>, InputError> {
    let mut all = Vec::new();
    for name in names {
        if !name.is_dir() {
            all.push(name.clone());
            continue;
        }
        let before = all.len();
        collect(name, endings, &mut all).map_err(|error| InputError::Io(shown(name), error))?;
        if all.len() == before {
            return Err(InputError::NoJob(shown(name), endings.join(", *.")));
        }
    }
    Ok(all)
}

fn collect(folder: &Path, endings: &[&str], all: &mut Vec<PathBuf>) -> io::Result<()> {
    let inside: io::Result<Vec<_>> = fs::read_dir(folder)?.collect();
    let mut inside = inside?;
    inside.sort_by_key(fs::DirEntry::file_name);
    for entry in inside {
        let path = entry.path();
        if entry.file_type()?.is_dir() {
            collect(&path, endings, all)?;
        } else if has_ending(&path, endings) {
            all.push(path);
        }
    }
    Ok(())
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    path.is_file() && endings.iter().any(|known| ending == **known)
}

/// Returns true if a name stands for standard input.
pub(super) fn is_stdin(name: &Path) -> bool {
    name.as_os_str() == "-"
}

/// The text of a name for messages.
pub(super) fn shown(name: &Path) -> String {
    match is_stdin(name) {
        true => "standard input".to_owned(),
        false => leadscrew_files::shown(name),
    }
}

/// Opens the file `name`, or standard input if `name` is `-`. A pipe can be read only once.
///
/// # Errors
/// [`InputError`] if it cannot be read or is no text.
pub(super) fn open(name: &Path) -> Result<Job, InputError> {
    if is_stdin(name) {
        return from_reader(&shown(name), None, io::stdin().lock());
    }
    match leadscrew_files::open(name) {
        Ok(opened) => from_reader(&shown(name), opened.size, opened.bytes),
        Err(error) if error.kind() == io::ErrorKind::IsADirectory => {
            Err(InputError::Directory(shown(name)))
        }
        Err(error) => Err(InputError::Io(shown(name), error)),
    }
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
    if is_wide(&head) {
        return Err(InputError::Wide(name));
    }
    if let Some(at) = binary_at(&head) {
        return Err(InputError::Binary(name, at));
    }
    if let Some(what) = drawing(&head) {
        return Err(InputError::Drawing(name, what));
    }
    let text = BufReader::new(io::Cursor::new(head.clone()).chain(input));
    Ok(Job {
        name,
        size,
        head,
        text: Box::new(text),
    })
}

/// Returns true if a file begins as UTF-16 does: with its mark, or with a NUL in every other byte.
fn is_wide(head: &[u8]) -> bool {
    let has_mark = head.starts_with(b"\xFF\xFE") || head.starts_with(b"\xFE\xFF");
    let nuls = |from: usize| head.iter().skip(from).step_by(2).all(|byte| *byte == 0);
    let is_plain = |from: usize| head.iter().skip(from).step_by(2).all(|byte| *byte != 0);
    has_mark || head.len() >= 4 && (nuls(0) && is_plain(1) || nuls(1) && is_plain(0))
}

/// The offset of the first control byte, if there are too many of them for text: more than one
/// byte in four. (A few NULs in a text do no harm: the machine drops them.)
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
        let svg = text(b"<svg width='1'/>\n");
        assert!(matches!(svg, Err(InputError::Drawing(..))));
        let elf = text(b"\x7fELF\x02\x01\x01\x00\x00\x00");
        assert!(matches!(elf, Err(InputError::Binary(_, 4))));
    }

    #[test]
    fn text_of_16_bits_is_called_so() {
        let wide = |text: &str, bytes: fn(u16) -> [u8; 2]| -> &'static [u8] {
            let bytes: Vec<u8> = text.encode_utf16().flat_map(bytes).collect();
            bytes.leak()
        };
        for text_of in [u16::to_le_bytes, u16::to_be_bytes] {
            for job in ["\u{FEFF}G0 X1\n", "G0 X1\r\n"] {
                let error = text(wide(job, text_of)).unwrap_err();
                assert!(matches!(error, InputError::Wide(_)), "{error}");
            }
        }
    }

    #[test]
    fn a_directory_is_named_as_one() {
        assert!(matches!(
            open(Path::new(".")),
            Err(InputError::Directory(_))
        ));
        let missing = open(Path::new("no/such/file"))
            .map(|_| ())
            .unwrap_err()
            .to_string();
        assert!(
            missing.starts_with("no/such/file: cannot be read"),
            "{missing}"
        );
    }
}
