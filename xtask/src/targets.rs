//! `cargo xtask targets`: the libraries checked for processors other than the F407's.
use crate::{
    failure::Failure,
    shell,
    toolchain::{self, Toolchain},
};

/// The targets that the libraries are checked for, each for a property or a lack.
const TARGETS: [&str; 3] = [
    // Cortex-M0: no compare-and-swap, no floating point.
    "thumbv6m-none-eabi",
    // Another architecture.
    "riscv32imac-unknown-none-elf",
    // A browser.
    "wasm32-unknown-unknown",
];

/// The topmost library, which brings the other three.
const LIBRARY: &str = "leadscrew-machine";

/// Checks every target.
pub(crate) fn run() -> Result<(), Failure> {
    TARGETS.into_iter().try_for_each(check)
}

fn check(target: &str) -> Result<(), Failure> {
    eprintln!("{LIBRARY} for {target}");
    let toolchain = Toolchain::find_for(target)?;
    let mut check = toolchain.cargo("check", target, &toolchain::target_dir());
    check.args(["-p", LIBRARY]).current_dir(toolchain::root());
    shell::run(&mut check)
}
