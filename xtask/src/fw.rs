//! `cargo fw`: builds the firmware with whichever compiler can, and prints its size; `cargo fw --run` flashes it, too, and
//! shows its log.
use crate::{
    failure::Failure,
    shell, sizes,
    toolchain::{self, Toolchain},
    without_masking,
};
use std::{
    path::{Path, PathBuf},
    process::Command,
};

/// The chip of the STM32F4-Discovery, as probe-rs calls it.
const CHIP: &str = "STM32F407VGTx";

/// For whoever has never flashed one.
const NO_PROBE_RS: &str = "probe-rs flashes the board and shows its log; it is not installed. One of
    cargo install probe-rs-tools --locked
    https://probe.rs/docs/getting-started/installation
Without it the ELF above can be flashed by any other tool, OpenOCD or STM32CubeProgrammer; the log is not shown then.";

/// Builds `board-f407`; `arguments` go to `cargo build`, but for `--run`.
pub(crate) fn run(arguments: &[String]) -> Result<(), Failure> {
    let (ours, others): (Vec<String>, Vec<String>) = arguments
        .iter()
        .cloned()
        .partition(|argument| argument == "--run");
    let elf = build(&Toolchain::find()?, &others)?;
    println!("{}", elf.display());
    print_sizes(&elf)?;
    if ours.is_empty() {
        return Ok(());
    }
    let mut probe = Command::new("probe-rs");
    let flashed = shell::run(probe.args(["run", "--chip", CHIP]).arg(&elf));
    if let Err(Failure::NotStarted { .. }) = flashed {
        eprintln!("{NO_PROBE_RS}");
    }
    flashed
}

fn print_sizes(elf: &Path) -> Result<(), Failure> {
    match sizes::of(elf) {
        Err(Failure::NotStarted { program, .. }) => {
            eprintln!("note: no sizes without {program} (Debian: binutils-arm-none-eabi)");
            Ok(())
        }
        sizes => {
            for finding in sizes::check(&sizes?)? {
                eprintln!("note: {finding}");
            }
            Ok(())
        }
    }
}

/// Builds `board-f407` and returns the path of its ELF.
pub(crate) fn build(toolchain: &Toolchain, arguments: &[String]) -> Result<PathBuf, Failure> {
    build_with(toolchain, arguments, &[])
}

/// As [`build`], with variables of the environment that the firmware reads while it is built.
pub(crate) fn build_with(
    toolchain: &Toolchain,
    arguments: &[String],
    variables: &[(&str, &str)],
) -> Result<PathBuf, Failure> {
    let mut command = toolchain.build(&toolchain::target_dir());
    command
        .args(["-p", "board-f407", "--profile", "firmware", "--config"])
        .arg(without_masking::config()?)
        .args(arguments)
        .envs(variables.iter().copied());
    shell::run(command.current_dir(toolchain::root()))?;
    Ok(toolchain::firmware_dir().join("board-f407"))
}
