//! The machine's flash memory in a file, so that settings survive a restart.
//!
//! ```text
//!   LEADSCREW-STATE | version, 1 byte | the flash memory, byte for byte
//! ```
//!
//! A new file is written beside the old one and then replaces it. A reader finds the old or the new
//! contents, also after a power loss.

use atomic_write_file::AtomicWriteFile;
use std::fmt;
use std::fs::{File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 15] = b"LEADSCREW-STATE";

/// Version of the file's layout. The records in it belong to the settings store, which has its own
/// version.
const VERSION: u8 = 1;

const HEADER: usize = MAGIC.len() + 1;

/// Why a state file could not be used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Fault {
    /// It is no state file.
    Foreign,
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
            Self::Foreign => write!(f, "is no state file"),
            Self::Version(version) => write!(f, "has version {version}, not {VERSION}"),
            Self::Records => write!(f, "holds settings of another version"),
            Self::Size { expected, found } if found < expected => {
                write!(f, "is cut short: {found} of {expected} bytes")
            }
            Self::Size { expected, found } => write!(f, "has {found} bytes, not {expected}"),
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
        write!(f, "{}: {}; ", self.file.display(), self.fault)?;
        match &self.kept {
            Ok(name) => write!(f, "kept as {}, defaults loaded", name.display()),
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
        let file = self.file.display();
        write!(
            f,
            "{file}: some stored settings are damaged, their defaults loaded; "
        )?;
        match &self.copy {
            Ok(name) => write!(f, "the file as it was is kept as {}", name.display()),
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
    Unusable(SetAside),
}

/// The state file.
#[derive(Clone, Debug)]
pub struct StateFile {
    path: PathBuf,
}

impl StateFile {
    /// A state file at `path`, which need not exist.
    pub fn new(path: PathBuf) -> Self {
        Self { path }
    }

    /// The state file of the machine called `name`, in the user's data directory; `None` if there
    /// is no such directory.
    pub fn of_user(name: &str) -> Option<Self> {
        let file = format!("{name}.state");
        Some(Self::new(dirs::data_dir()?.join("leadscrew").join(file)))
    }

    /// The file's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Claims the file for as long as the returned lock lives; `None` while another program has it.
    /// The lock is a file beside the state file, because each [`StateFile::save`] replaces the
    /// state file.
    ///
    /// # Errors
    /// Errors of making the lock file.
    pub(super) fn claim(&self) -> io::Result<Option<File>> {
        self.make_folder()?;
        let beside = File::create(self.path.with_added_extension("lock"))?;
        match beside.try_lock() {
            Ok(()) => {
                self.remove_leftovers();
                Ok(Some(beside))
            }
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    /// Removes the leftovers of a program that was killed while it saved: files named `.NAME.` and
    /// six letters or digits. No other program is saving there.
    fn remove_leftovers(&self) {
        let folder = self.path.parent().and_then(|folder| folder.read_dir().ok());
        let name = self.path.file_name().and_then(|name| name.to_str());
        let (Some(folder), Some(name)) = (folder, name) else {
            return;
        };
        for entry in folder.flatten() {
            let found = entry.file_name().into_string().unwrap_or_default();
            let end = found
                .strip_prefix('.')
                .and_then(|rest| rest.strip_prefix(name));
            let random = end.and_then(|end| end.strip_prefix('.'));
            let is_ours = |random: &str| {
                random.len() == 6 && random.bytes().all(|byte| byte.is_ascii_alphanumeric())
            };
            if random.is_some_and(is_ours) {
                // A leftover that cannot be removed does no harm.
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }

    /// Reads the flash memory, which has `size` bytes. A file that cannot be used is renamed.
    ///
    /// # Errors
    /// Errors of reading, except for a missing file.
    pub(super) fn load(&self, size: usize) -> io::Result<Found> {
        let bytes = match std::fs::read(&self.path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Found::Nothing),
            Err(error) => return Err(error),
        };
        Ok(match image(&bytes, size) {
            Ok(image) => Found::Image(image.to_vec()),
            Err(fault) => Found::Unusable(self.set_aside(fault)),
        })
    }

    /// Writes the flash memory.
    ///
    /// # Errors
    /// Errors of writing; the file then keeps its old contents.
    pub(super) fn save(&self, image: &[u8]) -> io::Result<()> {
        self.make_folder()?;
        let mut file = AtomicWriteFile::open(&self.path)?;
        file.write_all(MAGIC)?;
        file.write_all(&[VERSION])?;
        file.write_all(image)?;
        // After the commit, file and folder are synced: the data is on the disk under its name.
        file.commit()
    }

    fn make_folder(&self) -> io::Result<()> {
        self.path.parent().map_or(Ok(()), std::fs::create_dir_all)
    }

    /// Renames the file.
    pub(super) fn set_aside(&self, fault: Fault) -> SetAside {
        let kept = self.free_name().and_then(|name| {
            std::fs::rename(&self.path, &name)?;
            Ok(name)
        });
        SetAside {
            file: self.path.clone(),
            fault,
            kept,
        }
    }

    /// Copies the file. Only parts of it can be used, and it is about to be overwritten.
    pub(super) fn copy(&self) -> Copied {
        Copied {
            file: self.path.clone(),
            copy: self.try_copy(),
        }
    }

    fn try_copy(&self) -> io::Result<PathBuf> {
        let bytes = std::fs::read(&self.path)?;
        // The file stays damaged until a setting is stored. Until then, one copy is enough for all
        // starts.
        let mut taken = self.names().take_while(|name| name.exists());
        let same = taken.find(|name| std::fs::read(name).is_ok_and(|kept| kept == bytes));
        if let Some(name) = same {
            return Ok(name);
        }
        let name = self.free_name()?;
        std::fs::write(&name, bytes)?;
        Ok(name)
    }

    fn free_name(&self) -> io::Result<PathBuf> {
        let free = self.names().find(|name| !name.exists());
        free.ok_or_else(|| io::ErrorKind::AlreadyExists.into())
    }

    /// Names for the files that are set aside.
    fn names(&self) -> impl Iterator<Item = PathBuf> + use<'_> {
        let name = |count: u32| self.path.with_added_extension(format!("kept-{count}"));
        (1..).map(name)
    }
}

fn image(bytes: &[u8], size: usize) -> Result<&[u8], Fault> {
    let expected = HEADER + size;
    let found = bytes.len();
    let begins = bytes.starts_with(MAGIC) || MAGIC.starts_with(bytes);
    match bytes.split_at_checked(HEADER) {
        _ if !begins => Err(Fault::Foreign),
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
        let file = StateFile::new(folder.path().join("deeper").join("router.state"));
        (folder, file)
    }

    fn load(file: &StateFile) -> Option<Vec<u8>> {
        match file.load(4).unwrap() {
            Found::Image(image) => Some(image),
            Found::Nothing => None,
            Found::Unusable(aside) => panic!("{aside}"),
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
        let table: [(&[u8], &str); 5] = [
            (b"$0=10\n", "is no state file"),
            (b"", "is cut short: 0 of 20 bytes"),
            (b"LEADSCREW-", "is cut short: 10 of 20 bytes"),
            (&short, "is cut short: 18 of 20 bytes"),
            (&other_version, "has version 9, not 1"),
        ];
        let (_folder, file) = file();
        file.save(&[0; 4]).unwrap();
        for (count, (bytes, fault)) in (1..).zip(table) {
            std::fs::write(file.path(), bytes).unwrap();
            let Found::Unusable(aside) = file.load(4).unwrap() else {
                panic!("{fault}")
            };
            let kept = file.path().with_added_extension(format!("kept-{count}"));
            let path = file.path().display();
            let expected = format!(
                "{path}: {fault}; kept as {}, defaults loaded",
                kept.display()
            );
            assert_eq!(aside.to_string(), expected);
            assert_eq!(std::fs::read(kept).unwrap(), bytes);
            assert_eq!(load(&file), None);
        }
    }

    #[test]
    fn what_a_killed_program_left_is_removed_and_nothing_else_is() {
        let (_folder, file) = file();
        file.save(&[1; 4]).unwrap();
        let folder = file.path().parent().unwrap();
        let left = ".router.state.aB3dE9";
        let others = [
            ".router.state.old",
            ".other.state.aB3dE9",
            "router.state.aB3dE9",
        ];
        for name in others.into_iter().chain([left]) {
            std::fs::write(folder.join(name), "").unwrap();
        }
        let _claim = file.claim().unwrap().unwrap();
        assert!(!folder.join(left).exists());
        assert!(others.iter().all(|name| folder.join(name).exists()));
        assert_eq!(load(&file), Some(vec![1; 4]));
    }

    #[test]
    fn a_damaged_file_is_copied_once() {
        let (folder, file) = file();
        file.save(&[1; 4]).unwrap();
        let first = file.copy().copy.unwrap();
        assert_eq!(file.copy().copy.unwrap(), first);
        file.save(&[2; 4]).unwrap();
        let second = file.copy().copy.unwrap();
        assert_eq!(first.extension().unwrap(), "kept-1");
        assert_eq!(second.extension().unwrap(), "kept-2");
        drop(folder);
        assert!(file.copy().copy.is_err());
    }

    #[test]
    fn a_place_that_cannot_be_written_is_an_error() {
        let (folder, _) = file();
        std::fs::write(folder.path().join("file"), "").unwrap();
        let file = StateFile::new(folder.path().join("file").join("state"));
        assert!(file.save(&[0; 4]).is_err());
    }
}
