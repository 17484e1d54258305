//! `cargo xtask targets`: checks the libraries for processors other than the F407's.
use crate::{
    failure::Failure,
    shell,
    toolchain::{self, Toolchain, BROWSER},
};
use std::{path::Path, process::Command};

/// The targets that the libraries are checked for, each chosen for a feature that it has or lacks.
const TARGETS: [&str; 3] = [
    // Cortex-M0: no compare-and-swap, no floating point.
    "thumbv6m-none-eabi",
    // Another architecture.
    "riscv32imac-unknown-none-elf",
    BROWSER,
];

/// The topmost library, which depends on the others.
const LIBRARY: &str = "leadscrew-machine";

/// The simulator and the page. They need a standard library, and in a browser that has neither
/// files nor threads nor a clock.
const SIMULATOR: &str = "leadscrew-wasm";

/// Checks every target.
pub(crate) fn run() -> Result<(), Failure> {
    for target in TARGETS {
        check(LIBRARY, target, Toolchain::cargo)?;
    }
    check(SIMULATOR, BROWSER, Toolchain::cargo_with_std)
}

fn check(
    library: &str,
    target: &str,
    cargo: fn(&Toolchain, &str, &str, &Path) -> Result<Command, Failure>,
) -> Result<(), Failure> {
    eprintln!("{library} for {target}");
    let toolchain = Toolchain::find_for(target)?;
    let mut check = cargo(&toolchain, "check", target, &toolchain::target_dir())?;
    check.args(["-p", library]).current_dir(toolchain::root());
    shell::run(&mut check)
}
