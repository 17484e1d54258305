//! Runs the program in tests.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

/// A folder of its own for one test.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn file(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        let path = self.path(name);
        fs::write(&path, content).unwrap();
        path.to_str().unwrap().to_owned()
    }
}

pub(crate) fn leadscrew(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_leadscrew"))
        .args(args)
        .output()
        .unwrap()
}

pub(crate) fn stderr(output: &Output) -> String {
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    assert!(!text.contains("panicked"), "{text}");
    text
}

pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Asks a program to end, as Ctrl-C does.
pub(crate) fn interrupt(id: u32) {
    let mut kill = Command::new("kill");
    assert!(kill
        .args(["-INT", &id.to_string()])
        .status()
        .unwrap()
        .success());
}

/// Runs the program; expects exit status 2 and one message that contains all of `parts`.
pub(crate) fn unusable(args: &[&str], parts: &[&str]) {
    let output = leadscrew(args);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    for part in parts {
        assert!(
            message.contains(part),
            "{args:?}: no {part:?} in: {message}"
        );
    }
    let messages = message
        .lines()
        .filter(|line| line.starts_with("leadscrew: "));
    assert_eq!(messages.count(), 1, "{message}");
}

/// Runs a job that must succeed without an error; returns its JSON report.
pub(crate) fn report(args: &[&str]) -> serde_json::Value {
    let output = leadscrew(&[&["run", "--json"], args].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    serde_json::from_str(&stdout(&output)).unwrap()
}

pub(crate) const SQUARE: &str = "G21 G90\nG1 F400\nX4\nY4\nX0\nY0\n";
