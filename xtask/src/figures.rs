//! `cargo xtask figures`: runs the commands that measure, and writes their output to
//! `docs/figures.md`, to which documents link. Checks that measure no speed are left out;
//! tests/firmware/README.md lists them.
use crate::{failure::Failure, shell, toolchain};
use std::{fmt::Write, fs, path::Path, process::Command};

const FILE: &str = "docs/figures.md";

const HEAD: &str = "# Figures of the last run\n
`cargo xtask figures` writes this file: each command, and its answer. It takes twenty minutes of a
core. What the figures mean, and what was to be met, stands in [benchmarks.md](benchmarks.md) and
[hardware.md](hardware.md).\n";

/// Commands that only prepare the measurements.
const READY: [&str; 2] = [
    "python3 bench/workloads/gen.py target/workloads",
    "cargo build --quiet --profile fast -p leadscrew-machine --example plan_lines",
];

/// The measurements: a heading, and the commands under it.
const SECTIONS: [(&str, &[&str]); 4] = [
    (
        "x86-64 instructions from a line's bytes to its planned move",
        &[
            "cargo xtask bench target/fast/examples/plan_lines target/workloads/raster.gcode {lines}",
            "cargo xtask bench target/fast/examples/plan_lines target/workloads/raster.gcode {lines} grbl",
            "cargo xtask bench target/fast/examples/plan_lines target/workloads/spiral.gcode {lines}",
            "cargo xtask bench target/fast/examples/plan_lines target/workloads/spiral.gcode {lines} grbl",
        ],
    ),
    ("Cortex-M4F instructions", &["cargo xtask icount"]),
    (
        "Flash and memory of the firmware",
        &[
            "cargo fw",
            "cargo fw --board skr-2-dual-y",
            "cargo fw --machine examples/machines/004/machine.toml",
        ],
    ),
    (
        "The firmware, emulated",
        &[
            "cargo fw-test step-interrupt jitter together rate raster",
            "cargo fw-test --rates",
        ],
    ),
];

/// Measures, and writes the file.
///
/// # Errors
/// When a command fails; then the file is not changed.
pub(crate) fn run() -> Result<(), Failure> {
    let root = toolchain::root();
    for command in READY {
        said(&root, command)?;
    }
    let mut text = HEAD.to_owned();
    for (heading, commands) in SECTIONS {
        let _ = write!(text, "\n## {heading}\n");
        for command in commands {
            eprintln!("{command}");
            let said = said(&root, command)?;
            let _ = write!(text, "\n`{command}`\n\n```text\n{}```\n", figures(&said));
        }
    }
    let file = root.join(FILE);
    fs::write(&file, text).map_err(Failure::file(&file))
}

/// The standard output of a command.
fn said(root: &Path, command: &str) -> Result<String, Failure> {
    let mut words = command.split(' ');
    let program = words.next().unwrap_or_default();
    shell::output(Command::new(program).args(words).current_dir(root))
}

/// The lines of an output that are the same in every folder and at every speed: without paths, and
/// without the time that a check took. A count that is repeated at other settings (`... at`) is left
/// out.
fn figures(said: &str) -> String {
    let kept = |line: &&str| !line.starts_with('/') && !line.contains("  ... at ");
    let lines = said.lines().filter(kept);
    lines.fold(String::new(), |text, line| match line.strip_prefix("ok ") {
        Some(check) => {
            let name = check.split_whitespace().next().unwrap_or_default();
            text + name + "\n"
        }
        None => text + line + "\n",
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_times_and_repeated_counts_are_left_out() {
        let said =
            "/work/target/board-f407\nflash 5 of 9 bytes\nok     rate   12.5 s\n    3 lines\n  9  ... at 5 mm/s\n";
        assert_eq!(figures(said), "flash 5 of 9 bytes\nrate\n    3 lines\n");
    }
}
