//! A file that a program keeps for itself, and replaces again and again.

use super::output::target;
use super::write_new;
use atomic_write_file::AtomicWriteFile;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

/// A file that begins as its program's files do, or a name that is free. Anything else is refused
/// and stays as it is.
#[derive(Clone, Debug)]
pub struct Kept {
    /// The file itself: if a link was given, its end.
    path: PathBuf,
    begins: &'static [u8],
}

/// Holds a file for one program as long as it lives.
#[derive(Debug)]
pub struct Lock(#[expect(dead_code, reason = "the open file holds the lock")] File);

impl Kept {
    /// Returns the file at `path`, or at the end of the links that begin there. It need not exist;
    /// its first bytes are `begins`.
    ///
    /// # Errors
    /// It is no file, does not begin so, or cannot be read.
    pub fn new(path: &Path, begins: &'static [u8]) -> io::Result<Self> {
        let path = match path.is_symlink() {
            true => target(path)?,
            false => path.to_owned(),
        };
        let kept = Self { path, begins };
        kept.look()?;
        Ok(kept)
    }

    /// Returns the file's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads the file, at most `most` bytes; the rest of a longer one is left out. `None` if
    /// there is none.
    ///
    /// # Errors
    /// As [`Kept::new`].
    pub fn read(&self, most: usize) -> io::Result<Option<Vec<u8>>> {
        let Some(file) = self.look()? else {
            return Ok(None);
        };
        super::read_all(file.take(most as u64), most).map(Some)
    }

    /// Replaces the file, which keeps its mode. A reader finds the old or the new contents, also
    /// after a power loss: file and folder are synced.
    ///
    /// # Errors
    /// Another file has come under the name, or it cannot be written; the old one is then
    /// unchanged.
    pub fn replace(&self, parts: &[&[u8]]) -> io::Result<()> {
        self.look()?;
        make_folder(&self.path)?;
        let mut file = AtomicWriteFile::open(&self.path)?;
        for part in parts {
            file.write_all(part)?;
        }
        file.commit()
    }

    /// Renames the file to the first of `NAME.kept-1`, `NAME.kept-2`, ... that is free.
    ///
    /// # Errors
    /// It is no longer ours, or cannot be renamed.
    pub fn set_aside(&self) -> io::Result<PathBuf> {
        self.look()?;
        let name = self.free_name()?;
        fs::rename(&self.path, &name)?;
        Ok(name)
    }

    /// Copies the file, at most `most` bytes, to a name as [`Kept::set_aside`] gives. A copy that
    /// is there already is not made again.
    ///
    /// # Errors
    /// It is no longer ours, or cannot be copied.
    pub fn copy(&self, most: usize) -> io::Result<PathBuf> {
        let bytes = self.read(most)?.ok_or(io::ErrorKind::NotFound)?;
        let mut taken = self.names().take_while(|name| name.exists());
        let same = taken.find(|name| super::read(name, most).is_ok_and(|kept| kept == bytes));
        if let Some(name) = same {
            return Ok(name);
        }
        let name = self.free_name()?;
        write_new(&name, &bytes)?;
        Ok(name)
    }

    /// Claims the file; `None` while another program has it. The lock is a file beside it
    /// (`NAME.lock`), since each [`Kept::replace`] replaces the file itself.
    ///
    /// # Errors
    /// The file beside it cannot be made, or something else has its name.
    pub fn lock(&self) -> io::Result<Option<Lock>> {
        make_folder(&self.path)?;
        let beside = self.path.with_added_extension("lock");
        if fs::symlink_metadata(&beside).is_ok_and(|there| !there.is_file()) {
            return Err(io::Error::other("its lock is no file"));
        }
        let mut options = OpenOptions::new();
        options.write(true).create(true).truncate(false);
        let beside = options.open(beside)?;
        match beside.try_lock() {
            Ok(()) => Ok(Some(Lock(beside))),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    /// Opens the file if it is there and ours.
    fn look(&self) -> io::Result<Option<File>> {
        let there = match fs::metadata(&self.path) {
            Ok(there) => there,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error),
        };
        // A pipe is not opened, since that would wait for its writer.
        if !there.is_file() {
            return Err(io::Error::other("it is no file"));
        }
        let mut file = File::open(&self.path)?;
        let mut first = Vec::new();
        let head = self.begins.len() as u64;
        (&mut file).take(head).read_to_end(&mut first)?;
        if first != self.begins {
            return Err(io::Error::other("it belongs to something else"));
        }
        file.rewind()?;
        Ok(Some(file))
    }

    fn free_name(&self) -> io::Result<PathBuf> {
        let free = |name: &PathBuf| fs::symlink_metadata(name).is_err();
        let free = self.names().find(free);
        free.ok_or_else(|| io::ErrorKind::AlreadyExists.into())
    }

    /// Names for what is set aside.
    fn names(&self) -> impl Iterator<Item = PathBuf> + use<'_> {
        let name = |count: u32| self.path.with_added_extension(format!("kept-{count}"));
        (1..).map(name)
    }
}

fn make_folder(path: &Path) -> io::Result<()> {
    path.parent().map_or(Ok(()), fs::create_dir_all)
}
