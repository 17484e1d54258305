//! The example boards that no emulator here has: `cargo xtask boards --checked` checks that they
//! compile.
use crate::{
    failure::Failure,
    shell,
    toolchain::{Toolchain, TARGET},
};

/// For each board its folder in `examples/boards`, and its target. No other part of the gate compiles
/// the libraries for the first and the last: a Cortex-M33, a RISC-V without compare-and-swap.
const CHECKED: [(&str, &str); 3] = [
    ("rp2350", "thumbv8m.main-none-eabihf"),
    ("blackpill", TARGET),
    ("esp32c3", "riscv32imc-unknown-none-elf"),
];

/// The board that is checked without parts, too.
const SMALL: &str = "rp2350";

/// The parts that a small chip may leave out: each is left out of a build, and in another without the
/// rest.
const PARTS: [&[&str]; 3] = [
    &["--no-default-features"],
    &[
        "--no-default-features",
        "--features",
        "leadscrew/arcs,leadscrew/curves,leadscrew/cycles",
    ],
    &[
        "--no-default-features",
        "--features",
        "leadscrew/jerk,leadscrew/listings,leadscrew/probing,leadscrew/rasters",
    ],
];

/// Checks the boards that are named, or every one.
///
/// # Errors
/// A name is none of [`CHECKED`], or a board does not compile.
pub(crate) fn run(names: &[&str]) -> Result<(), Failure> {
    let is_known = |name: &&&str| CHECKED.iter().any(|(board, _)| board == *name);
    if let Some(name) = names.iter().find(|name| !is_known(name)) {
        let known = CHECKED.map(|(board, _)| board).join(", ");
        return Err(Failure::finding(format!(
            "no board `{name}`; there are: {known}"
        )));
    }
    let is_meant = |board| names.is_empty() || names.contains(&board);
    for (board, target) in CHECKED.into_iter().filter(|(board, _)| is_meant(*board)) {
        check(board, target, &[])?;
        if board == SMALL {
            for parts in PARTS {
                check(board, target, parts)?;
            }
        }
        println!("{board}: compiles");
    }
    Ok(())
}

/// Checks a board, with further `arguments`. Nothing runs: only `core` is compiled, and without
/// optimisation. What runs on the desk is shared with the boards that are built.
fn check(board: &str, target: &str, arguments: &[&str]) -> Result<(), Failure> {
    let toolchain = Toolchain::find_for(target)?;
    let mut check = toolchain.cargo("check", target, &crate::boards::target_dir())?;
    check
        .args(["--release", "--locked"])
        .args(arguments)
        .env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "0")
        .current_dir(crate::boards::folder(board));
    shell::run(&mut check)
}
