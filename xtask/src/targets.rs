//! `cargo xtask targets`: checks the libraries for processors other than the F407's.
use crate::{
    failure::Failure,
    shell,
    toolchain::{self, Toolchain, BROWSER},
};
use std::{path::Path, process::Command};

/// The targets that the libraries are checked for, each chosen for a feature that it has or lacks,
/// with the features of the topmost library that it needs.
const TARGETS: [(&str, &[&str]); 7] = [
    // Cortex-M0: no compare-and-swap, no floating point.
    ("thumbv6m-none-eabi", &[]),
    // Cortex-M23 and M33.
    ("thumbv8m.base-none-eabi", &[]),
    ("thumbv8m.main-none-eabihf", &[]),
    // Another architecture: ESP32-C6.
    ("riscv32imac-unknown-none-elf", &[]),
    // The same without compare-and-swap: ESP32-C3 and C2, CH32V.
    ("riscv32imc-unknown-none-elf", SINGLE_CORE),
    // The same without multiplication.
    ("riscv32i-unknown-none-elf", SINGLE_CORE),
    (BROWSER, &[]),
];

/// The feature for a processor of one core that has no compare-and-swap.
const SINGLE_CORE: &[&str] = &["--features", "single-core"];

/// The topmost library, which depends on the others.
const LIBRARY: &str = "leadscrew";

/// The simulator and the page. They need a standard library, and in a browser that has neither
/// files nor threads nor a clock.
const SIMULATOR: &str = "leadscrew-wasm";

/// Checks every target.
pub(crate) fn run() -> Result<(), Failure> {
    for (target, features) in TARGETS {
        check(LIBRARY, target, features, Toolchain::cargo)?;
    }
    check(SIMULATOR, BROWSER, &[], Toolchain::cargo_with_std)
}

fn check(
    library: &str,
    target: &str,
    features: &[&str],
    cargo: fn(&Toolchain, &str, &str, &Path) -> Result<Command, Failure>,
) -> Result<(), Failure> {
    eprintln!("{library} for {target}");
    let toolchain = Toolchain::find_for(target)?;
    let mut check = cargo(&toolchain, "check", target, &toolchain::target_dir())?;
    check
        .args(["-p", library])
        .args(features)
        .current_dir(toolchain::root());
    shell::run(&mut check)
}
