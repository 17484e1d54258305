//! `cargo fw-test`: builds the firmware and runs it in the emulator (`tests/firmware`).
//!
//! Two builds that differ in the rate of the serial line only: 115200 baud, and 2 Mbaud for what the line must not limit.
use crate::{failure::Failure, fw, shell, toolchain::Toolchain};
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// The fast line's rate in baud.
const FAST: &str = "2000000";
/// What the firmware's build reads the rate from.
const RATE: &str = "LEADSCREW_BAUD";

/// Builds and runs; `arguments` go to `fw-test`.
pub(crate) fn run(arguments: &[String]) -> Result<(), Failure> {
    let toolchain = Toolchain::find()?;
    // The usual build last: it is what stays where `cargo fw` puts it.
    let fast = keep(&fw::build_with(&toolchain, &[], Some((RATE, FAST)))?)?;
    let elf = fw::build(&toolchain, &[])?;
    let mut tests = Command::new("cargo");
    tests
        .args(["run", "--quiet", "--profile", "fw-test"])
        .args(["-p", "leadscrew-fw-test", "--"])
        .args([&elf, &fast])
        .args(arguments);
    shell::run(&mut tests)
}

/// Puts an ELF aside before the next build replaces it.
fn keep(elf: &Path) -> Result<PathBuf, Failure> {
    let kept = elf.with_extension(FAST);
    fs::copy(elf, &kept).map_err(Failure::file(&kept))?;
    Ok(kept)
}
