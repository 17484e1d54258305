//! The destination of an output: a new file, standard output (`-`), or an existing pipe or device.
//!
//! A file appears under its name when it is complete. If the program is stopped before that, an
//! existing file of this name stays unchanged.

use super::shown;
use atomic_write_file::AtomicWriteFile;
use std::cell::RefCell;
use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, BufWriter, Stdout, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// An output that could not be made or written.
#[derive(Debug)]
pub struct OutputError {
    path: PathBuf,
    error: io::Error,
}

impl std::fmt::Display for OutputError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{}: cannot be written: {}",
            shown(&self.path),
            self.error
        )
    }
}

impl std::error::Error for OutputError {}

/// Returns true if an output goes to standard output. If so, messages about the job are not printed
/// there.
pub fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Returns true if a path leads to the same file as one of `inputs`: an output must not replace an
/// input. A device does not count, since it may be input and output.
pub fn is_input(path: &Path, inputs: &[&Path]) -> bool {
    let target = fs::canonicalize(path).ok().filter(|path| path.is_file());
    let is_target = |input: &&Path| target.is_some() && fs::canonicalize(input).ok() == target;
    inputs.iter().any(is_target)
}

/// Checks that no output would replace an input or another output.
///
/// # Errors
/// An output would replace one of these files.
pub fn spare<'a>(inputs: &[&Path], outputs: impl Iterator<Item = &'a Path>) -> Result<(), String> {
    let mut taken = Vec::new();
    for path in outputs {
        let name = shown(path);
        if is_input(path, inputs) {
            return Err(format!(
                "{name}: is a file that is read; the output needs another name"
            ));
        }
        let place = place(path);
        if place.is_some() && taken.contains(&place) {
            return Err(format!("{name}: two outputs have this name"));
        }
        taken.push(place);
    }
    Ok(())
}

/// The file that an output makes; `None` for standard output, a pipe or a device.
fn place(path: &Path) -> Option<PathBuf> {
    if is_stdout(path) {
        return None;
    }
    let path = &target(path).ok()?;
    if let Ok(there) = fs::canonicalize(path) {
        return Some(there).filter(|there| there.is_file());
    }
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let folder = fs::canonicalize(folder.unwrap_or(Path::new("."))).ok()?;
    Some(folder.join(path.file_name()?))
}

/// Returns the end of the symbolic links that begin at `path`, even if no file is there yet.
///
/// # Errors
/// The links lead nowhere, for example in a circle.
pub fn target(path: &Path) -> io::Result<PathBuf> {
    match (fs::canonicalize(path), fs::read_link(path)) {
        (Ok(there), _) => Ok(there),
        (Err(error), Ok(next)) if error.kind() == io::ErrorKind::NotFound => {
            target(&path.with_file_name(next))
        }
        (Err(error), Ok(_)) => Err(error),
        (Err(_), Err(_)) => Ok(path.to_owned()),
    }
}

/// Opens the pipe or the device at `path`; `None` if a file is there or nothing.
///
/// # Errors
/// It cannot be written, or is a disk.
fn there(path: &Path) -> io::Result<Option<File>> {
    let Ok(there) = fs::metadata(path) else {
        return Ok(None);
    };
    if is_disk(&there) {
        return Err(io::Error::other("is a disk, not a file"));
    }
    // A file that is write-protected must not be replaced, either.
    let file = OpenOptions::new().write(true).open(path)?;
    Ok((!there.is_file()).then_some(file))
}

#[cfg(unix)]
fn is_disk(metadata: &Metadata) -> bool {
    std::os::unix::fs::FileTypeExt::is_block_device(&metadata.file_type())
}

#[cfg(not(unix))]
fn is_disk(_: &Metadata) -> bool {
    false
}

/// Opens an output that is written as its program goes on, a log: a file is emptied.
///
/// # Errors
/// It cannot be written, or is a disk.
pub fn open_log(path: &Path) -> io::Result<File> {
    let path = target(path)?;
    match there(&path)? {
        Some(file) => Ok(file),
        None => File::create(path),
    }
}

/// Returns the outcome of writing to standard output. A reader that has closed it early (`| head`)
/// is no failure.
///
/// # Errors
/// Every other failure.
pub fn unless_left(written: io::Result<()>) -> io::Result<()> {
    match written {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

/// An output to be written.
pub struct Output {
    path: PathBuf,
    to: Rc<RefCell<To>>,
}

/// Writes to an [`Output`].
pub struct Pen(Rc<RefCell<To>>);

/// The device, file or pipe of an output.
enum To {
    Stdout(Stdout),
    /// A new file that does not have its name yet.
    Beside(BufWriter<AtomicWriteFile>),
    /// A pipe or a device, which no new file can replace.
    There(BufWriter<File>),
    /// The output is complete.
    Done,
}

impl Output {
    /// Checks that `path` can be written, before the work begins.
    ///
    /// # Errors
    /// If it cannot.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let to = To::open(path).map_err(|error| OutputError {
            path: path.to_owned(),
            error,
        })?;
        Ok(Self {
            path: path.to_owned(),
            to: Rc::new(RefCell::new(to)),
        })
    }

    /// Returns a writer to this output.
    pub fn pen(&self) -> Pen {
        Pen(Rc::clone(&self.to))
    }

    /// Gives the written file its name. `written` tells whether everything could be written.
    ///
    /// # Errors
    /// The first failure; the file then stays as it was before.
    pub fn complete(self, written: io::Result<()>) -> Result<(), OutputError> {
        let path = self.path;
        let to = self.to.replace(To::Done);
        let mut completed = written.and_then(|()| to.complete());
        if is_stdout(&path) {
            completed = unless_left(completed);
        }
        completed.map_err(|error| OutputError { path, error })
    }
}

impl To {
    fn open(path: &Path) -> io::Result<Self> {
        if is_stdout(path) {
            return Ok(Self::Stdout(io::stdout()));
        }
        let path = target(path)?;
        if let Some(file) = there(&path)? {
            return Ok(Self::There(BufWriter::new(file)));
        }
        let beside = AtomicWriteFile::open(&path)?;
        Ok(Self::Beside(BufWriter::new(beside)))
    }

    fn complete(self) -> io::Result<()> {
        match self {
            Self::Stdout(mut out) => out.flush(),
            Self::Beside(out) => out.into_inner().map_err(io::Error::from)?.commit(),
            Self::There(mut out) => out.flush(),
            Self::Done => Ok(()),
        }
    }
}

impl Write for Pen {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut *self.0.borrow_mut() {
            To::Stdout(out) => out.write(bytes),
            To::Beside(out) => out.write(bytes),
            To::There(out) => out.write(bytes),
            To::Done => Err(io::ErrorKind::BrokenPipe.into()),
        }
    }

    /// Does nothing: only [`Output::complete`] completes the file.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_appears_when_it_is_complete_and_the_one_before_stays_until_then() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out");
        fs::write(&path, "before").unwrap();
        let output = Output::create(&path).unwrap();
        output.pen().write_all(b"after").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"before");
        output.complete(Ok(())).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"after");
        let failed = Output::create(&path).unwrap();
        failed.pen().write_all(b"half").unwrap();
        assert!(failed.complete(Err(io::ErrorKind::Other.into())).is_err());
        assert_eq!(fs::read(&path).unwrap(), b"after");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_followed_and_a_device_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let [real, link] = ["real", "link"].map(|name| folder.path().join(name));
        fs::write(&real, "").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        let output = Output::create(&link).unwrap();
        output.pen().write_all(b"text").unwrap();
        output.complete(Ok(())).unwrap();
        assert_eq!(fs::read(&real).unwrap(), b"text");
        assert!(link.is_symlink());
        let null = Output::create(Path::new("/dev/null")).unwrap();
        null.pen().write_all(b"text").unwrap();
        null.complete(Ok(())).unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_no_file_makes_the_file_that_it_names() {
        use std::os::unix::fs::{symlink, PermissionsExt};
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let write = |name: &str| {
            let output = Output::create(&at(name)).unwrap();
            output.pen().write_all(b"text").unwrap();
            output.complete(Ok(())).unwrap();
            fs::metadata(at(name)).unwrap().permissions().mode()
        };
        symlink("second", at("first")).unwrap();
        symlink(at("real"), at("second")).unwrap();
        assert_eq!(place(&at("first")), place(&at("real")));
        assert_eq!(write("first"), write("plain"));
        assert!(at("first").is_symlink() && at("second").is_symlink());
        assert_eq!(fs::read(at("real")).unwrap(), b"text");
        symlink("circle", at("circle")).unwrap();
        assert!(Output::create(&at("circle")).is_err());
    }
}
