//! The machine's flash memory in a file, so that settings survive a restart.
//!
//! ```text
//!   LEADSCREW-STATE | version, 1 byte | the flash memory, byte for byte
//! ```
//!
//! A new file is written beside the old one and then replaces it. A reader finds the old or the new
//! contents, also after a power loss.

use leadscrew_files::{Kept, Lock};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 15] = b"LEADSCREW-STATE";

/// Version of the file's layout. The records in it belong to the settings store, which has its own
/// version.
const VERSION: u8 = 1;

const HEADER: usize = MAGIC.len() + 1;

/// The reason why the contents of a state file could not be used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Fault {
    /// Another version has written it.
    Version(u8),
    /// Another version has written the records in it.
    Records,
    /// Its size differs from the machine's flash memory.
    Size {
        /// Bytes that it should have.
        expected: usize,
        /// Bytes that it has.
        found: usize,
    },
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Version(version) => write!(f, "has version {version}, not {VERSION}"),
            Self::Records => write!(f, "holds settings of another version"),
            Self::Size { expected, found } if found < expected => {
                write!(f, "is cut short: {found} of {expected} bytes")
            }
            Self::Size { expected, .. } => write!(f, "has more than {expected} bytes"),
        }
    }
}

/// A state file that could not be used, and its new place.
#[derive(Debug)]
pub struct SetAside {
    file: PathBuf,
    fault: Fault,
    kept: io::Result<PathBuf>,
}

impl fmt::Display for SetAside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}: {}; ",
            leadscrew_files::shown(&self.file),
            self.fault
        )?;
        match &self.kept {
            Ok(name) => write!(
                f,
                "kept as {}, defaults loaded",
                leadscrew_files::shown(name)
            ),
            Err(error) => write!(f, "defaults loaded; it cannot be renamed: {error}"),
        }
    }
}

/// A damaged state file, and the copy that was made of it.
#[derive(Debug)]
pub struct Copied {
    file: PathBuf,
    copy: io::Result<PathBuf>,
}

impl fmt::Display for Copied {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = leadscrew_files::shown(&self.file);
        write!(
            f,
            "{file}: some stored settings are damaged, their defaults loaded; "
        )?;
        match &self.copy {
            Ok(name) => write!(
                f,
                "the file as it was is kept as {}",
                leadscrew_files::shown(name)
            ),
            Err(error) => write!(f, "the file cannot be copied: {error}"),
        }
    }
}

/// The finding at the path of the state file.
#[derive(Debug)]
pub(super) enum Found {
    /// No file: this is the first start.
    Nothing,
    /// The flash memory.
    Image(Vec<u8>),
    /// A file that cannot be used.
    Unusable(Fault),
}

/// The state file.
#[derive(Clone, Debug)]
pub struct StateFile(Kept);

/// A path that is no place for a state file. What is there stays as it is.
#[derive(Debug)]
pub struct NoStateFile(PathBuf, io::Error);

impl fmt::Display for NoStateFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(path, why) = self;
        write!(
            f,
            "{}: cannot keep the machine's state there: {why}; `--state FILE` takes a state file \
             or a new name",
            leadscrew_files::shown(path)
        )
    }
}

impl std::error::Error for NoStateFile {}

impl StateFile {
    /// Makes a state file at `path`, or at the end of the links that begin there. It need not
    /// exist.
    ///
    /// # Errors
    /// Something else is there, or it cannot be read.
    pub fn new(path: &Path) -> Result<Self, NoStateFile> {
        let kept = Kept::new(path, MAGIC);
        kept.map(Self)
            .map_err(|error| NoStateFile(path.to_owned(), error))
    }

    /// Returns the state file of the machine called `name`, in the user's data directory; `None` if
    /// there is no such directory.
    ///
    /// # Errors
    /// As [`StateFile::new`].
    pub fn of_user(name: &str) -> Result<Option<Self>, NoStateFile> {
        let folder = dirs::data_dir();
        let file = folder.map(|folder| folder.join("leadscrew").join(format!("{name}.state")));
        file.as_deref().map(Self::new).transpose()
    }

    /// Returns the file's path.
    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// Claims the file for as long as the returned lock lives; `None` while another program has it.
    ///
    /// # Errors
    /// Errors of making the lock.
    pub(super) fn claim(&self) -> io::Result<Option<Lock>> {
        self.0.lock()
    }

    /// Reads the flash memory, which has `size` bytes.
    ///
    /// # Errors
    /// Errors of reading, except for a missing file.
    pub(super) fn load(&self, size: usize) -> io::Result<Found> {
        let Some(bytes) = self.0.read(HEADER + size + 1)? else {
            return Ok(Found::Nothing);
        };
        Ok(match image(&bytes, size) {
            Ok(image) => Found::Image(image.to_vec()),
            Err(fault) => Found::Unusable(fault),
        })
    }

    /// Writes the flash memory.
    ///
    /// # Errors
    /// Errors of writing; the file then keeps its old contents.
    pub(super) fn save(&self, image: &[u8]) -> io::Result<()> {
        self.0.replace(&[MAGIC, &[VERSION], image])
    }

    /// Renames the file.
    pub(super) fn set_aside(&self, fault: Fault) -> SetAside {
        SetAside {
            file: self.path().to_owned(),
            fault,
            kept: self.0.set_aside(),
        }
    }

    /// Copies the file, for a flash memory of `size` bytes. Only parts of it can be used, and it is
    /// about to be overwritten. It stays damaged until a setting is stored; until then one copy is
    /// enough for all starts.
    pub(super) fn copy(&self, size: usize) -> Copied {
        Copied {
            file: self.path().to_owned(),
            copy: self.0.copy(HEADER + size),
        }
    }
}

fn image(bytes: &[u8], size: usize) -> Result<&[u8], Fault> {
    let expected = HEADER + size;
    let found = bytes.len();
    match bytes.split_at_checked(HEADER) {
        None => Err(Fault::Size { expected, found }),
        Some((header, _)) if header[MAGIC.len()] != VERSION => {
            Err(Fault::Version(header[MAGIC.len()]))
        }
        Some((_, image)) if image.len() == size => Ok(image),
        Some(_) => Err(Fault::Size { expected, found }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> (tempfile::TempDir, StateFile) {
        let folder = tempfile::tempdir().unwrap();
        let file = StateFile::new(&folder.path().join("deeper").join("router.state")).unwrap();
        (folder, file)
    }

    fn load(file: &StateFile) -> Option<Vec<u8>> {
        match file.load(4).unwrap() {
            Found::Image(image) => Some(image),
            Found::Nothing => None,
            Found::Unusable(fault) => panic!("{fault}"),
        }
    }

    #[test]
    fn what_was_saved_is_loaded() {
        let (_folder, file) = file();
        assert_eq!(load(&file), None);
        file.save(&[1, 2, 3, 4]).unwrap();
        file.save(&[5, 6, 7, 8]).unwrap();
        assert_eq!(load(&file), Some(vec![5, 6, 7, 8]));
    }

    #[test]
    fn what_cannot_be_used_is_kept_under_another_name_and_said() {
        let mut other_version = MAGIC.to_vec();
        other_version.extend([9, 1, 2, 3, 4]);
        let mut short = MAGIC.to_vec();
        short.extend([VERSION, 1, 2]);
        let long = [MAGIC, &[VERSION; 6][..]].concat();
        let table: [(&[u8], &str); 4] = [
            (MAGIC, "is cut short: 15 of 20 bytes"),
            (&long, "has more than 20 bytes"),
            (&short, "is cut short: 18 of 20 bytes"),
            (&other_version, "has version 9, not 1"),
        ];
        let (_folder, file) = file();
        file.save(&[0; 4]).unwrap();
        for (count, (bytes, fault)) in (1..).zip(table) {
            std::fs::write(file.path(), bytes).unwrap();
            let Found::Unusable(found) = file.load(4).unwrap() else {
                panic!("{fault}")
            };
            let aside = file.set_aside(found);
            let kept = file.path().with_added_extension(format!("kept-{count}"));
            let path = leadscrew_files::shown(file.path());
            let expected = format!(
                "{path}: {fault}; kept as {}, defaults loaded",
                leadscrew_files::shown(&kept)
            );
            assert_eq!(aside.to_string(), expected);
            assert_eq!(std::fs::read(kept).unwrap(), bytes);
            assert_eq!(load(&file), None);
        }
    }

    #[test]
    fn a_damaged_file_is_copied_once() {
        let (folder, file) = file();
        file.save(&[1; 4]).unwrap();
        let first = file.copy(4).copy.unwrap();
        assert_eq!(file.copy(4).copy.unwrap(), first);
        file.save(&[2; 4]).unwrap();
        let second = file.copy(4).copy.unwrap();
        assert_eq!(first.extension().unwrap(), "kept-1");
        assert_eq!(second.extension().unwrap(), "kept-2");
        drop(folder);
        assert!(file.copy(4).copy.is_err());
    }

    #[test]
    fn a_place_that_is_none_is_refused_in_a_sentence() {
        let (folder, _) = file();
        let other = folder.path().join("file");
        std::fs::write(&other, "").unwrap();
        let beyond = other.join("state");
        let unread = std::fs::metadata(&beyond).unwrap_err().to_string();
        for (place, why) in [
            (folder.path(), "it is no file"),
            (&other, "it belongs to something else"),
            (&beyond, &unread),
        ] {
            let expected = format!(
                "{}: cannot keep the machine's state there: {why}; `--state FILE` takes a state \
                 file or a new name",
                leadscrew_files::shown(place)
            );
            assert_eq!(StateFile::new(place).unwrap_err().to_string(), expected);
        }
    }
}
