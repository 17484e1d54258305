//! `cargo hil`: the self-test of a board, real or emulated (docs/hil.md, `tests/hil`).
use crate::{
    failure::Failure,
    fw::{self, BOARD},
    shell,
    toolchain::{self, Toolchain},
};
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// The board's file, with its wires.
const BOARD_FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/hil/discovery.toml");
/// The rate of the image's serial line, baud, unless `--baud` gives another.
const BAUD: &str = "1000000";

/// Builds, flashes or measures, as the arguments say. The arguments of a measurement go to `hil`.
pub(crate) fn run(arguments: &[String]) -> Result<(), Failure> {
    let after = |word: &str| {
        let place = arguments.iter().position(|argument| argument == word)?;
        arguments.get(place + 1).map(String::as_str)
    };
    let baud = after("--baud").unwrap_or(BAUD);
    match arguments.first().map(String::as_str) {
        Some("--flash") => flash(&image(baud)?),
        Some(task @ ("--emulated" | "--planted")) => {
            let elf = image(BAUD)?;
            let mut tests = tests()?;
            tests.arg(task).arg(elf).args(&arguments[1..]);
            shell::run(&mut tests)
        }
        _ => shell::run(tests()?.args(arguments)),
    }
}

/// The program that measures.
fn tests() -> Result<Command, Failure> {
    let mut command = toolchain::program("hil")?;
    command.env("LEADSCREW_SOURCES", sources());
    Ok(command)
}

/// The commit of the sources for the report, and whether they were changed since then.
fn sources() -> String {
    let mut git = Command::new("git");
    git.args(["describe", "--always", "--dirty", "--abbrev=12"]);
    let named = shell::output(git.current_dir(toolchain::root()));
    named.map_or("without git".into(), |name| name.trim().to_owned())
}

/// Builds the self-test's image. Returns its path.
fn image(baud: &str) -> Result<PathBuf, Failure> {
    let variables = [(BOARD, BOARD_FILE), ("LEADSCREW_BAUD", baud)];
    let elf = fw::build_with(&Toolchain::find()?, &[], &variables)?;
    let kept = toolchain::firmware_dir().join("hil");
    fs::copy(elf, &kept).map_err(Failure::file(&kept))?;
    Ok(kept)
}

/// Flashes the image with the board's own probe, and starts it.
fn flash(elf: &Path) -> Result<(), Failure> {
    let probe = |words: &[&str]| {
        let mut command = Command::new("probe-rs");
        command.args(words).args(["--chip", fw::CHIP]);
        command
    };
    let flashed = shell::run(probe(&["download"]).arg(elf));
    if let Err(Failure::NotStarted { .. }) = flashed {
        eprintln!("{}", fw::NO_PROBE_RS);
    }
    flashed?;
    shell::run(&mut probe(&["reset"]))
}
