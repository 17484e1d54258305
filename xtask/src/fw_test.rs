//! `cargo fw-test`: builds the firmware and runs it in the emulator (`tests/firmware`).
//!
//! Builds for the Discovery that differ in the rate of the serial line only, 115200 baud, and 2 Mbaud for what the line must
//! not limit; and one for each other board, with other frequencies of power.
use crate::{
    failure::Failure,
    fw, shell,
    toolchain::{self, Toolchain},
};
use std::{fs, path::Path, process::Command};

/// A build, as `tests/firmware` knows it.
struct Build {
    name: &'static str,
    /// For `cargo build`.
    arguments: &'static [&'static str],
    /// What the firmware reads while it is built.
    variables: &'static [(&'static str, &'static str)],
}

/// A build with the profile of this name.
const fn profile(
    name: &'static str,
    arguments: &'static [&'static str],
    variables: &'static [(&'static str, &'static str)],
) -> Build {
    Build {
        name,
        arguments,
        variables,
    }
}

const FAST: (&str, &str) = ("LEADSCREW_BAUD", "2000000");

/// For `--highest-rate`: ticks may be 2 µs apart, 500 000 steps/s.
const UNCAPPED: Build = Build {
    name: "uncapped",
    arguments: &[],
    variables: &[FAST, ("LEADSCREW_TICK_NS", "1400")],
};

/// The usual build last: it is what stays where `cargo fw` puts it.
const BUILDS: [Build; 6] = [
    Build {
        name: "fast",
        arguments: &[],
        variables: &[FAST],
    },
    profile(
        "machine-003",
        &["--features", "machine-003"],
        &[("LEADSCREW_POWER_HZ", "50")],
    ),
    profile("skr-2", &["--features", "skr-2"], &[]),
    profile(
        "dual-y",
        &["--features", "dual-y"],
        &[("LEADSCREW_POWER_HZ", "100000")],
    ),
    profile(
        "core-xy",
        &["--features", "core-xy"],
        &[("LEADSCREW_POWER_HZ", "1000")],
    ),
    profile("usual", &[], &[]),
];

/// Builds and runs; `arguments` go to `fw-test`.
pub(crate) fn run(arguments: &[String]) -> Result<(), Failure> {
    let toolchain = Toolchain::find()?;
    let folder = toolchain::firmware_dir().join("fw-test");
    fs::create_dir_all(&folder).map_err(Failure::file(&folder))?;
    let searches = arguments.iter().any(|word| word == "--highest-rate");
    for build in searches.then_some(&UNCAPPED).into_iter().chain(&BUILDS) {
        keep(&toolchain, build, &folder)?;
    }
    let mut tests = Command::new("cargo");
    tests
        .args(["run", "--quiet", "--profile", "fw-test"])
        .args(["-p", "leadscrew-fw-test", "--"])
        .arg(&folder)
        .args(arguments);
    shell::run(&mut tests)
}

/// Puts an ELF aside before the next build replaces it.
fn keep(toolchain: &Toolchain, build: &Build, folder: &Path) -> Result<(), Failure> {
    let arguments: Vec<String> = build.arguments.iter().map(|&word| word.into()).collect();
    let elf = fw::build_with(toolchain, &arguments, build.variables)?;
    let kept = folder.join(build.name);
    fs::copy(elf, &kept).map_err(Failure::file(&kept))?;
    Ok(())
}
