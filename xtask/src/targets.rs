//! `cargo xtask targets [TARGET...]`: checks the libraries for processors other than the F407's, and
//! the simulator for a browser; or only for the targets that are named.
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

/// Checks the targets that are named, or every one and the simulator.
///
/// # Errors
/// A name is none of [`TARGETS`], or a library does not compile.
pub(crate) fn run(names: &[String]) -> Result<(), Failure> {
    let is_known = |name: &&String| TARGETS.iter().any(|(target, _)| target == name);
    if let Some(name) = names.iter().find(|name| !is_known(name)) {
        let known = TARGETS.map(|(target, _)| target).join(", ");
        return Err(Failure::finding(format!(
            "no target '{name}'; there are: {known}"
        )));
    }
    for (target, features) in TARGETS {
        if !names.is_empty() && names.iter().all(|name| name != target) {
            continue;
        }
        check(LIBRARY, target, features, Toolchain::cargo)?;
    }
    if !names.is_empty() {
        return Ok(());
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
