//! `cargo fw-test`: builds the firmware and runs it in the emulator (`tests/firmware`).
//!
//! `qemu` needs only the build for the SKR 2. `--highest-rate` and `--rates` need only the build
//! `uncapped`. All other tasks need two builds for the Discovery, which differ only in the rate of
//! the serial line: 115200 baud, and 2 Mbaud for checks that the line must not limit. They also
//! need a build for each other board, with other frequencies of power, a build for each machine
//! file, and builds without pins, one for each start address.
use crate::{
    failure::Failure,
    fw::{self, machine, BOARD},
    shell,
    toolchain::{self, Toolchain},
};
use std::{fs, path::Path, process::Command};

/// A build, by its name in `tests/firmware`.
struct Build {
    name: &'static str,
    /// The environment variables that the firmware reads while it is built.
    variables: &'static [(&'static str, &'static str)],
}

const fn build(name: &'static str, variables: &'static [(&'static str, &'static str)]) -> Build {
    Build { name, variables }
}

const FAST: (&str, &str) = ("LEADSCREW_BAUD", "2000000");

/// The only build that `--highest-rate` and `--rates` need: ticks may be 2 µs apart, which is 500
/// 000 steps/s.
const UNCAPPED: Build = build("uncapped", &[FAST, ("LEADSCREW_TICK_NS", "1400")]);

/// Six axes on a Discovery.
const SIX_AXES: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../tests/firmware/six_axes.toml"
);

/// Builds that the subset leaves out.
const MORE: [Build; 6] = [
    build("octopus", &[(BOARD, "octopus")]),
    build("fly-407zg", &[(BOARD, "fly-407zg")]),
    build("spider", &[(BOARD, "spider")]),
    build("robin-nano-v3", &[(BOARD, "robin-nano-v3")]),
    build(
        "record-behind-48",
        &[WITHOUT_PINS, (BOARD, "robin-nano-v3")],
    ),
    build("six-axes", &[(fw::MACHINE, SIX_AXES)]),
];

/// The build that `qemu` runs at an address behind a bootloader. Checks in the emulator use this
/// build, too.
const SKR_2: Build = build("skr-2", &[(BOARD, "skr-2")]);

/// The variable for builds that read the pins of a board with three motors from a record.
const WITHOUT_PINS: (&str, &str) = (fw::RECORD, "1");

/// The builds that most tasks need. The usual build is the last one, so that its ELF stays where
/// `cargo fw` puts it.
const BUILDS: [Build; 14] = [
    build("record", &[WITHOUT_PINS]),
    build("record-behind", &[WITHOUT_PINS, (BOARD, "octopus")]),
    build(
        "record-four",
        &[WITHOUT_PINS, (fw::MOTORS, "4"), (BOARD, "octopus")],
    ),
    build("machine-file-000", &[machine!("000")]),
    build("machine-file-001", &[machine!("001")]),
    build("machine-file-002", &[machine!("002")]),
    build("machine-file-003", &[machine!("003")]),
    build("machine-file-004", &[machine!("004")]),
    build("fast", &[FAST]),
    build(
        "machine-003",
        &[(BOARD, "machine-003"), ("LEADSCREW_POWER_HZ", "50")],
    ),
    SKR_2,
    build(
        "dual-y",
        &[(BOARD, "skr-2-dual-y"), ("LEADSCREW_POWER_HZ", "100000")],
    ),
    build(
        "core-xy",
        &[(BOARD, "skr-2-core-xy"), ("LEADSCREW_POWER_HZ", "1000")],
    ),
    build("usual", &[]),
];

/// Builds the firmware and runs the tests; `arguments` go to `fw-test`.
pub(crate) fn run(arguments: &[String]) -> Result<(), Failure> {
    let toolchain = Toolchain::find()?;
    let folder = toolchain::firmware_dir().join("fw-test");
    fs::create_dir_all(&folder).map_err(Failure::file(&folder))?;
    let asks = |word: &str| arguments.iter().any(|argument| argument == word);
    let more: &[Build] = match arguments.is_empty() || asks("more-boards") || asks("records") {
        true => &MORE,
        false => &[],
    };
    if asks("--highest-rate") || asks("--rates") {
        keep(&toolchain, &UNCAPPED, &folder)?;
    } else if asks("qemu") {
        keep(&toolchain, &SKR_2, &folder)?;
    } else {
        for build in more.iter().chain(&BUILDS) {
            keep(&toolchain, build, &folder)?;
        }
    }
    let mut tests = Command::new("cargo");
    tests
        .args(["run", "--quiet", "--profile", "fw-test"])
        .args(["-p", "leadscrew-fw-test", "--"])
        .arg(&folder)
        .args(arguments);
    shell::run(&mut tests)
}

/// Builds an ELF, and copies it to `folder` before the next build replaces it.
fn keep(toolchain: &Toolchain, build: &Build, folder: &Path) -> Result<(), Failure> {
    let elf = fw::build_with(toolchain, &[], build.variables)?;
    let kept = folder.join(build.name);
    fs::copy(elf, &kept).map_err(Failure::file(&kept))?;
    Ok(())
}
