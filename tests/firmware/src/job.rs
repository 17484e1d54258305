//! The jobs: programs with their settings.
use crate::bench::Failure;
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// A program and the settings that it is made for.
#[derive(Clone, Debug)]
pub(crate) struct Job {
    pub(crate) name: String,
    /// Lines as `$$` prints them.
    pub(crate) settings: String,
    pub(crate) program: String,
}

/// The root of the repository.
pub(crate) fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(path: &Path) -> Result<String, Failure> {
    fs::read_to_string(path).map_err(|error| Failure(format!("{}: {error}", path.display())))
}

/// A file of `examples/`.
pub(crate) fn file(name: &str) -> Result<String, Failure> {
    read(&repository().join("examples").join(name))
}

/// The path of the file of a machine in `examples/machines/`.
pub(crate) fn machine(number: &str) -> PathBuf {
    let machines = repository().join("examples/machines");
    machines.join(number).join("machine.toml")
}

impl Job {
    /// A job of a few lines.
    pub(crate) fn new(name: &str, settings: &str, program: &str) -> Job {
        Job {
            name: name.into(),
            settings: settings.into(),
            program: program.into(),
        }
    }

    /// Lines that a sender sends, and that make no comment of their own.
    pub(crate) fn lines(&self) -> usize {
        self.program.lines().count()
    }

    /// A job of `examples/`, with the settings named in the table of its README.
    pub(crate) fn example(name: &str) -> Result<Job, Failure> {
        let folder = repository().join("examples");
        let readme = read(&folder.join("README.md"))?;
        let row = readme
            .lines()
            .find(|row| row.starts_with(&format!("| `{name}` |")));
        let settings = row.and_then(|row| row.split(" | ").nth(2));
        let settings = settings.ok_or_else(|| Failure(format!("{name} is in no table")))?;
        Ok(Job {
            name: name.into(),
            settings: read(&folder.join("settings").join(settings.trim_matches('`')))?,
            program: read(&folder.join(name))?,
        })
    }

    /// A program that was recorded with Grbl (`tests/conformance/traces`).
    pub(crate) fn trace(name: &str) -> Result<Job, Failure> {
        let path = repository().join("tests/conformance/traces").join(name);
        let recorded: Value = serde_json::from_str(&read(&path.with_extension("json"))?)?;
        let settings = recorded["settings"].as_object();
        let settings = settings.ok_or_else(|| Failure(format!("{name} has no settings")))?;
        Ok(Job {
            name: name.into(),
            settings: settings
                .iter()
                .map(|(name, value)| format!("{name}={value}\n"))
                .collect(),
            program: read(&path.with_extension("nc"))?,
        })
    }

    /// All recorded programs.
    pub(crate) fn traces() -> Result<Vec<Job>, Failure> {
        let folder = repository().join("tests/conformance/traces");
        let mut names: Vec<String> = fs::read_dir(folder)?
            .flatten()
            .filter_map(|entry| Some(entry.file_name().to_str()?.strip_suffix(".nc")?.to_owned()))
            .collect();
        names.sort();
        names.iter().map(|name| Job::trace(name)).collect()
    }
}
