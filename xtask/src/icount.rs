//! `cargo xtask icount [--check]`: exact Cortex-M4F instruction counts, under QEMU.
//!
//! The programs in `bench/icount/firmware` mark the code that is counted, and
//! `bench/icount/plugin.c` counts its instructions. `bench/budgets.txt` describes each count and
//! gives its limits. In addition, the planner's results are compared, bit for bit, with those on
//! this computer.
use crate::{
    budget::{Budget, Count},
    failure::Failure,
    shell, thumb,
    toolchain::{self, Toolchain, TARGET},
};
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// The program that shows that the plugin counts right, and its known counts in regions 0, 1, 2,
/// ...
const CALIBRATION: (&str, [u64; 5]) = ("calibrate", [0, 5, 21, 4, 3]);
/// The program that prints a checksum of the planner's output, and the planner's example that does
/// the same on this computer.
const SAME_BITS: &str = "same_bits";
/// The longest time that QEMU may take for one program, s.
const TIME_LIMIT: &str = "300";

/// The counts of a program, by region.
type Counts = BTreeMap<usize, Count>;

/// Counts, and prints a table. With `check` it fails if a budget is exceeded.
pub(crate) fn run(check: bool) -> Result<(), Failure> {
    let bench = toolchain::root().join("bench");
    let budgets = Budget::read(&bench.join("budgets.txt"))?;
    let emulator = Emulator::prepare(&bench.join("icount"))?;
    emulator.calibrate()?;

    let mut exceeded = Vec::new();
    let mut programs: BTreeMap<&str, Counts> = BTreeMap::new();
    println!("{}", Budget::HEADING);
    for budget in &budgets {
        if !programs.contains_key(budget.program.as_str()) {
            programs.insert(&budget.program, emulator.count(&budget.program)?);
        }
        let count = programs[budget.program.as_str()].get(&budget.region);
        let count =
            count.ok_or_else(|| Failure::finding(format!("{}: nothing counted", budget.what)))?;
        println!("{}", budget.row(count));
        exceeded.extend(budget.exceeded_by(count));
    }
    emulator.compare_bits()?;
    if check && !exceeded.is_empty() {
        return Err(Failure::Findings(exceeded));
    }
    Ok(())
}

/// QEMU with the plugin, and the folder of the programs.
struct Emulator {
    plugin: PathBuf,
    programs: PathBuf,
}

impl Emulator {
    /// Compiles the plugin and the programs.
    fn prepare(sources: &Path) -> Result<Self, Failure> {
        let target_dir = toolchain::target_dir().join("icount");
        fs::create_dir_all(&target_dir).map_err(Failure::file(&target_dir))?;
        let plugin = target_dir.join("libicount.so");
        let interface = format!("-DQP_API={}", plugin_interface()?);
        let mut gcc = Command::new("gcc");
        gcc.args([
            "-O2",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-shared",
            "-fPIC",
            "-fvisibility=hidden",
        ]);
        shell::run(
            gcc.arg(interface)
                .arg("-o")
                .arg(&plugin)
                .arg(sources.join("plugin.c")),
        )?;

        let mut build = Toolchain::find()?.build(&target_dir)?;
        build
            .args(["--bins", "--profile", "firmware"])
            .current_dir(sources.join("firmware"));
        // `FLAGS` replace the flags for the board in the repository's cargo configuration. Only the
        // linker's flags differ.
        build.env("RUSTFLAGS", FLAGS);
        shell::run(&mut build)?;
        Ok(Emulator {
            plugin,
            programs: target_dir.join(TARGET).join("firmware"),
        })
    }

    /// Fails unless the plugin's counts are the known ones.
    fn calibrate(&self) -> Result<(), Failure> {
        let (program, expected) = CALIBRATION;
        let counts = self.count(program)?;
        for (region, expected) in expected.into_iter().enumerate() {
            let exact = counts
                .get(&region)
                .is_some_and(|count| count.smallest == expected && count.largest == expected);
            if !exact {
                let found = counts.get(&region);
                return Err(Failure::finding(format!(
                    "{program}: region {region} has {expected} instructions, not {found:?}"
                )));
            }
        }
        Ok(())
    }

    /// Fails unless the planner makes the same moves and segments, bit for bit, on the
    /// microcontroller and on this computer.
    fn compare_bits(&self) -> Result<(), Failure> {
        let elf = self.programs.join(SAME_BITS);
        let there = shell::output(&mut machine(&elf))?;
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(["run", "--quiet", "-p", "leadscrew-planner", "--example"]);
        let here = shell::output(cargo.arg(SAME_BITS).current_dir(toolchain::root()))?;
        let (there, here) = (there.trim(), here.trim());
        if there.len() != 16 || there != here {
            return Err(Failure::finding(format!(
                "random programs: the planner's checksum is {there} on a Cortex-M4F and {here} here"
            )));
        }
        println!("{there}: checksum of the planner's moves and segments, the same as here");
        Ok(())
    }

    /// Runs a program and returns its counts. Before that, it searches the ELF for software double
    /// precision: the program compiles generic functions of the libraries, which the firmware
    /// compiles only as far as it uses them.
    fn count(&self, program: &str) -> Result<Counts, Failure> {
        let elf = self.programs.join(program);
        let doubles = thumb::software_doubles(&elf)?;
        if !doubles.is_empty() {
            return Err(Failure::Findings(doubles));
        }
        let report = self.programs.join(format!("{program}.icount"));
        let plugin = format!("{},out={}", self.plugin.display(), report.display());
        shell::run(machine(&elf).arg("-plugin").arg(plugin))?;
        let text = fs::read_to_string(&report).map_err(Failure::file(&report))?;
        text.lines()
            .map(|line| parse_count(line).ok_or_else(|| Failure::unreadable(program, line)))
            .collect()
    }
}

/// The command that runs a program in QEMU.
fn machine(elf: &Path) -> Command {
    let mut qemu = Command::new("timeout");
    qemu.args([TIME_LIMIT, "qemu-system-arm"]);
    qemu.args(["-M", "mps2-an386", "-cpu", "cortex-m4"]);
    qemu.args(["-display", "none", "-monitor", "none", "-serial", "none"]);
    qemu.args(["-semihosting-config", "enable=on,target=native"]);
    qemu.arg("-kernel").arg(elf);
    qemu
}

/// The flags with which the programs are compiled and linked.
const FLAGS: &str = "-C link-arg=-Tlink.x -C link-arg=--nmagic \
                     -C llvm-args=-inline-threshold=70 -C target-cpu=cortex-m4";

/// The version of the plugin interface that the installed QEMU requires.
fn plugin_interface() -> Result<u32, Failure> {
    let version = shell::output(Command::new("qemu-system-arm").arg("--version"))?;
    let major =
        major_version(&version).ok_or_else(|| Failure::unreadable("QEMU's version", &version))?;
    Ok(if major >= 9 { 4 } else { 1 })
}

/// The major version: 7 from `QEMU emulator version 7.2.22 (Debian ...)`.
fn major_version(text: &str) -> Option<u32> {
    let (_, version) = text.split_once("version ")?;
    version.split('.').next()?.parse().ok()
}

/// Region and count from a line of the plugin's report: region, samples, sum, smallest, largest.
fn parse_count(line: &str) -> Option<(usize, Count)> {
    let numbers: Vec<u64> = line
        .split_whitespace()
        .map(str::parse)
        .collect::<Result<_, _>>()
        .ok()?;
    let [region, samples, sum, smallest, largest] = numbers[..] else {
        return None;
    };
    Some((
        usize::try_from(region).ok()?,
        Count {
            samples,
            sum,
            smallest,
            largest,
        },
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plugin_interface_follows_from_the_first_number_of_the_version() {
        assert_eq!(
            major_version("QEMU emulator version 7.2.22 (Debian 1:7.2+dfsg-7)"),
            Some(7)
        );
        assert_eq!(major_version("QEMU emulator version 10.0.2"), Some(10));
        assert_eq!(major_version("qemu: command not found"), None);
    }

    #[test]
    fn the_programs_are_compiled_with_the_flags_of_the_firmware() {
        let config = fs::read_to_string(toolchain::root().join(".cargo/config.toml")).unwrap();
        let board: Vec<&str> = config
            .split('"')
            .filter(|flag| flag.starts_with("llvm-args="))
            .collect();
        let counted: Vec<&str> = FLAGS
            .split(' ')
            .filter(|flag| flag.starts_with("llvm-args="))
            .collect();
        assert_eq!(counted, board);
    }

    #[test]
    fn a_report_line_has_five_numbers() {
        let count = Count {
            samples: 3,
            sum: 15,
            smallest: 5,
            largest: 5,
        };
        assert_eq!(parse_count("1 3 15 5 5"), Some((1, count)));
        assert_eq!(parse_count("1 3 15 5"), None);
        assert_eq!(parse_count("1 3 15 5 x"), None);
    }

    /// The counted code must be compiled in the same way as the firmware.
    #[test]
    fn the_programs_are_built_with_the_profile_of_the_firmware() {
        let firmware_profile = |path: PathBuf| {
            let text = fs::read_to_string(path).unwrap();
            let start = text.find("[profile.firmware]").unwrap();
            text[start..].trim().to_owned()
        };
        let programs = toolchain::root().join("bench/icount/firmware/Cargo.toml");
        assert_eq!(
            firmware_profile(programs).replace("icount-firmware", "board-f407"),
            firmware_profile(toolchain::root().join("Cargo.toml"))
        );
    }
}
