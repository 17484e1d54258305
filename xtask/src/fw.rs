//! `cargo fw`: builds the firmware with a compiler that can build it, and prints its size. `--board
//! NAME` builds for another board than the Discovery, `--machine FILE` for the machine of a file.
//! `--record` builds an image that reads its board from a record; with `--motors 4` it has four
//! motors, and the record says how they move the axes. `--run` also flashes the firmware and shows
//! its log.
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

const USAGE: &str = "usage: cargo fw [OPTIONS] [ARGUMENTS of `cargo rustc`]
    --board NAME|FILE  for a board of crates/boards, or a file that describes one; without it the
                       board of the machine's file, or the STM32F4-Discovery
    --machine FILE     for the machine of a file
    --record           without pins: it reads them from the board's record in the flash
    --motors 4         with --record: the record says how up to four motors move the axes
    --run              flash it and show its log (probe-rs)
The sizes that it prints, and their limits: bench/sizes.txt";

/// The chip of the STM32F4-Discovery, as probe-rs calls it.
pub(crate) const CHIP: &str = "STM32F407VGTx";

/// The chip of the board that a firmware is for, as probe-rs calls it.
fn chip(elf: &Path) -> Result<String, Failure> {
    let symbols = shell::output(Command::new("arm-none-eabi-nm").arg(elf))?;
    let value = |name| sizes::symbol(&symbols, name).ok_or_else(|| Failure::unreadable("nm", name));
    Ok(probe_name(value("__chip_pins")?, value("__chip_flash")?))
}

/// A chip by its pins and its bytes of flash, as probe-rs calls it.
fn probe_name(pins: u64, flash: u64) -> String {
    let pins = if pins > 100 { 'Z' } else { 'V' };
    let flash = if flash > 0x8_0000 { 'G' } else { 'E' };
    format!("STM32F407{pins}{flash}Tx")
}

/// The help for a user who has never flashed a board.
pub(crate) const NO_PROBE_RS: &str = "probe-rs flashes the board and shows its log; it is not installed. One of
    cargo install probe-rs-tools --locked
    https://probe.rs/docs/getting-started/installation
Without it the ELF above can be flashed by any other tool, OpenOCD or STM32CubeProgrammer; the log is not shown then.";

/// The arguments.
#[derive(Default)]
struct Request {
    /// A board's name or file.
    board: Option<String>,
    /// A machine's file.
    machine: Option<String>,
    /// True if to build an image without pins, which reads its board from a record.
    record: bool,
    /// The number of motors of such an image; its record says how they move the axes.
    motors: Option<String>,
    /// True if to flash the firmware and show its log.
    flashes: bool,
    /// The rest, for `cargo rustc`.
    others: Vec<String>,
}

impl Request {
    fn read(arguments: &[String]) -> Self {
        let mut request = Request::default();
        let mut words = arguments.iter();
        while let Some(word) = words.next() {
            match word.as_str() {
                "--run" => request.flashes = true,
                "--record" => request.record = true,
                "--board" => request.board = words.next().cloned(),
                "--motors" => request.motors = words.next().cloned(),
                "--machine" => request.machine = words.next().cloned(),
                other => request.others.push(other.to_owned()),
            }
        }
        request
    }
}

/// Builds `board-f407`. The `arguments` go to `cargo rustc`, except `--run`, `--record`, `--motors`,
/// `--board` and `--machine`.
pub(crate) fn run(arguments: &[String]) -> Result<(), Failure> {
    if arguments
        .iter()
        .any(|word| word == "--help" || word == "-h")
    {
        println!("{USAGE}");
        return Ok(());
    }
    let request = Request::read(arguments);
    let board = request.board.as_deref().map(place);
    let machine = request.machine.as_deref().map(place);
    let variables = [
        (BOARD, board.as_deref()),
        (MACHINE, machine.as_deref()),
        (RECORD, request.record.then_some("1")),
        (MOTORS, request.motors.as_deref()),
    ];
    let variables = variables
        .iter()
        .filter_map(|(name, value)| Some((*name, (*value)?)));
    let variables: Vec<_> = variables.collect();
    let elf = build_with(&Toolchain::find()?, &request.others, &variables)?;
    println!("{}", elf.display());
    print_sizes(&elf)?;
    if !request.flashes {
        return Ok(());
    }
    let mut probe = Command::new("probe-rs");
    let flashed = shell::run(probe.args(["run", "--chip", &chip(&elf)?]).arg(&elf));
    if let Err(Failure::NotStarted { .. }) = flashed {
        eprintln!("{NO_PROBE_RS}");
    }
    flashed
}

/// A board or machine in the form that the build script needs: the absolute path of a file, since
/// the script runs in another folder; or a name, unchanged.
fn place(name: &str) -> String {
    match Path::new(name).canonicalize() {
        Ok(path) if path.is_file() => path.display().to_string(),
        _ => name.to_owned(),
    }
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

/// The variable that names the board.
pub(crate) const BOARD: &str = "LEADSCREW_BOARD";

/// The variable that names the machine's file.
pub(crate) const MACHINE: &str = "LEADSCREW_MACHINE";

/// The file of a machine with six axes, on a Discovery.
pub(crate) const SIX_AXES: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../tests/firmware/six_axes.toml"
);

/// The variable that asks for an image which reads its board from a record.
pub(crate) const RECORD: &str = "LEADSCREW_RECORD";

/// The variable that says how many motors such an image has, if the record says how they move
/// the axes.
pub(crate) const MOTORS: &str = "LEADSCREW_MOTORS";

/// The file of a machine of `examples/machines`.
macro_rules! machine {
    ($number:literal) => {
        (
            $crate::fw::MACHINE,
            concat!(
                env!("CARGO_MANIFEST_DIR"),
                "/../examples/machines/",
                $number,
                "/machine.toml"
            ),
        )
    };
}
pub(crate) use machine;

/// The size of the log's buffer, bytes: a few lines are logged at the start, and then only errors.
const LOG_BYTES: &str = "512";

/// Inlines less than `.cargo/config.toml` has it: each instruction counts 8 in place of 5. An image
/// that has to be small takes 7 KB less. Only the board's own code is compiled so, and what is
/// generic with it: its dependencies stay as other images have them, and are compiled once.
const INLINES_LESS: [&str; 3] = ["--", "-C", "llvm-args=-inline-instr-cost=8"];

/// Builds `board-f407` and returns the path of its ELF. `variables` are the environment variables
/// that the firmware reads while it is built.
pub(crate) fn build_with(
    toolchain: &Toolchain,
    arguments: &[String],
    variables: &[(&str, &str)],
) -> Result<PathBuf, Failure> {
    let mut command = toolchain.cargo("rustc", toolchain::TARGET, &toolchain::target_dir())?;
    command.args([
        "-p",
        "board-f407",
        "--bin",
        "board-f407",
        "--profile",
        "firmware",
    ]);
    for config in without_masking::config(toolchain.sources())? {
        command.arg("--config").arg(config);
    }
    command.args(arguments);
    if has_to_be_small(variables) {
        command.arg("--no-default-features").args(INLINES_LESS);
    }
    command
        .env("DEFMT_RTT_BUFFER_SIZE", LOG_BYTES)
        .envs(variables.iter().copied());
    shell::run(command.current_dir(toolchain::root()))?;
    Ok(toolchain::firmware_dir().join("board-f407"))
}

/// Returns true if an image has to fit a chip of 512 KiB with all boards and machines of a record
/// in it: one that reads its board from a record. That for four motors is too long for such chips
/// anyway.
fn has_to_be_small(variables: &[(&str, &str)]) -> bool {
    let given = |name: &str| {
        let own = variables.iter().find(|(of, _)| *of == name);
        own.map(|(_, value)| (*value).to_owned())
            .or_else(|| std::env::var(name).ok())
    };
    given(RECORD).is_some() && given(MOTORS).as_deref() != Some("4")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chip_is_flashed_by_its_own_name() {
        assert_eq!(probe_name(100, 1 << 20), CHIP);
        assert_eq!(probe_name(100, 512 << 10), "STM32F407VETx");
        assert_eq!(probe_name(144, 512 << 10), "STM32F407ZETx");
        assert_eq!(probe_name(144, 1 << 20), "STM32F407ZGTx");
    }
}
