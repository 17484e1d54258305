//! `cargo xtask thumb`: builds the libraries and the firmware for the microcontroller, and checks
//! that forbidden things are not in them. `cargo xtask thumb FILE...` checks these firmwares, which
//! somebody has built, in place of its own.
//!
//! | what | where | why |
//! |---|---|---|
//! | software double precision | the libraries' own code, the whole firmware | the FPU is single precision: 84 instructions a product |
//! | 64-bit division | whatever the step interrupt reaches | 198 to 287 instructions (u64 by u64, by u32), the whole budget of a tick is 100 |
//! | `cpsid`, a write to PRIMASK or FAULTMASK | the whole firmware, but for the first instructions and the start of `main` | it would mask the step interrupt |
//! | less flash left, or more memory or stack, than allowed | the whole firmware, for the Discovery, two motors on Y, four motors without pins on a chip of 512 KiB, and three machines with a file | `bench/sizes.txt` |
//! | code in the flash | whatever the step interrupt reaches | it waits there, five cycles a line of 16 bytes |
//! | a panic, a call through a register | whatever the step interrupt reaches | it cannot fail, and its cost must be known |
use crate::{
    call_graph::CallGraph,
    failure::Failure,
    fw::{self, machine},
    shell, sizes,
    toolchain::{self, Toolchain},
};
use std::{path::Path, process::Command};

/// The library crates that run on the microcontroller.
const LIBRARIES: [&str; 8] = [
    "leadscrew-gcode",
    "leadscrew-stepper",
    "leadscrew-planner",
    "leadscrew-program",
    "leadscrew-interpreter",
    "leadscrew-protocol",
    "leadscrew-settings",
    "leadscrew-machine",
];
/// The builds, each with the board or machine that it is for. The build for four motors without
/// pins is too long for boards of 512 KiB by some 3.5 KB (bench/sizes.txt). Machine 001 has motors
/// without drivers and outputs that the step interrupt changes, machine 004 has the largest firmware
/// with a file, and six axes take the most SRAM. The Discovery's build is the last one, so that it stays where `cargo fw`
/// puts it.
const BUILDS: [&[(&str, &str)]; 6] = [
    &[(fw::RECORD, "1"), (fw::MOTORS, "4"), (fw::BOARD, "skr-2")],
    &[(fw::BOARD, "skr-2-dual-y")],
    &[machine!("001")],
    &[machine!("004")],
    &[(fw::MACHINE, fw::SIX_AXES)],
    &[(fw::BOARD, "discovery")],
];
/// The handlers of the step timer and of the timer that ends a pulse.
const STEP_INTERRUPTS: [&str; 2] = ["TIM2", "TIM1_TRG_COM_TIM11"];

/// Code that runs before any interrupt: the first instructions after a reset, and the start of
/// RTIC's `main`.
const BEFORE_INTERRUPTS: [&str; 2] = ["__pre_init", "main"];

/// The first address of the flash, for which the core has to wait; the step interrupts are in SRAM.
const FLASH: u64 = 0x0800_0000;

/// Builds the libraries and checks them, and checks the firmware in `files`. Without `files` it
/// builds the firmware of [`BUILDS`] and checks it.
pub(crate) fn run(files: &[String]) -> Result<(), Failure> {
    let toolchain = Toolchain::find()?;
    let mut findings = check_libraries(&toolchain)?;
    for file in files {
        println!("thumb: {file}");
        findings.extend(check_firmware(Path::new(file))?);
    }
    let builds: &[&[(&str, &str)]] = if files.is_empty() { &BUILDS } else { &[] };
    for build in builds {
        let names: Vec<&str> = build.iter().map(|(_, name)| *name).collect();
        println!("thumb: {}", names.join(", "));
        let elf = fw::build_with(&toolchain, &[], build)?;
        findings.extend(check_firmware(&elf)?);
    }
    if findings.is_empty() {
        Ok(())
    } else {
        Err(Failure::Findings(findings))
    }
}

fn check_firmware(elf: &Path) -> Result<Vec<String>, Failure> {
    let mut findings = software_doubles(elf)?;
    findings.extend(check_step_interrupt(elf)?);
    findings.extend(sizes::check(&sizes::of(elf)?)?);
    Ok(findings)
}

/// Builds the libraries one by one, without link-time optimisation, so that their objects hold
/// machine code that can be checked.
fn check_libraries(toolchain: &Toolchain) -> Result<Vec<String>, Failure> {
    let mut build = toolchain.build(&toolchain::target_dir())?;
    build.args([
        "--profile",
        "firmware",
        "--config",
        "profile.firmware.lto=false",
    ]);
    for library in LIBRARIES {
        build.args(["-p", library]);
    }
    shell::run(build.current_dir(toolchain::root()))?;
    let mut findings = Vec::new();
    for library in LIBRARIES {
        let file = format!("lib{}.rlib", library.replace('-', "_"));
        findings.extend(software_doubles(&toolchain::firmware_dir().join(file))?);
    }
    println!("thumb: {} libraries built", LIBRARIES.len());
    Ok(findings)
}

/// The double-precision routines that an object, a library or a program mentions.
pub(crate) fn software_doubles(file: &Path) -> Result<Vec<String>, Failure> {
    let listing = shell::output(Command::new("arm-none-eabi-nm").arg(file))?;
    let symbols = listing
        .lines()
        .filter_map(|line| line.split_whitespace().last());
    let found = symbols.filter(|symbol| is_software_double(symbol));
    Ok(found
        .map(|symbol| format!("{}: software double precision: {symbol}", file.display()))
        .collect())
}

/// The forbidden things that the step interrupt can reach in the linked firmware.
fn check_step_interrupt(elf: &Path) -> Result<Vec<String>, Failure> {
    let mut objdump = Command::new("arm-none-eabi-objdump");
    let code = shell::output(objdump.args(["-d", "--no-show-raw-insn"]).arg(elf))?;
    let graph = CallGraph::parse(&code);
    let mut all = masks(&code);
    for interrupt in STEP_INTERRUPTS {
        if !graph.contains(interrupt) {
            let elf = elf.display();
            return Err(Failure::finding(format!("{elf}: no function {interrupt}")));
        }
        println!(
            "thumb: {interrupt} reaches {} functions",
            graph.reach(interrupt)
        );
        let mut findings = graph.findings(interrupt, forbidden_in_a_step);
        findings.extend(graph.reach_beyond(interrupt, FLASH));
        let reached = findings
            .into_iter()
            .map(|finding| format!("{}: {}", finding.path.join(" > "), finding.reason));
        all.extend(reached);
    }
    Ok(all)
}

/// The functions that mask all interrupts, and so the step interrupts as well. Only functions that
/// run before the first interrupt is enabled may do so.
fn masks(code: &str) -> Vec<String> {
    let (mut function, mut findings) = ("", Vec::new());
    for line in code.lines() {
        if let Some((_, name)) = line.split_once(" <").filter(|_| line.ends_with(">:")) {
            function = name.trim_end_matches(">:");
        }
        let instruction = line.split_once(":\t").map_or("", |(_, rest)| rest);
        let masks = instruction.starts_with("cpsid")
            || instruction.starts_with("msr\tPRIMASK")
            || instruction.starts_with("msr\tFAULTMASK");
        if masks && !BEFORE_INTERRUPTS.contains(&function) {
            findings.push(format!(
                "{function}: masks the step interrupt: `{instruction}`"
            ));
        }
    }
    findings
}

/// The reason why the step interrupt must not reach this symbol, if there is one.
fn forbidden_in_a_step(symbol: &str) -> Option<&'static str> {
    if is_long_division(symbol) {
        Some("divides 64-bit integers")
    } else if is_software_double(symbol) {
        Some("software double precision")
    } else if symbol.contains("panic") {
        Some("can panic")
    } else {
        None
    }
}

/// Returns true if a symbol is a 64-bit division: a name of the run-time ABI for the Arm
/// architecture (IHI 0043) section 4.2, GCC's name for the same routine, or the function of
/// `compiler_builtins` behind them.
fn is_long_division(symbol: &str) -> bool {
    const NAMES: [&str; 8] = [
        "__aeabi_uldivmod",
        "__aeabi_ldivmod",
        "__udivmoddi4",
        "__divmoddi4",
        "__udivdi3",
        "__umoddi3",
        "__divdi3",
        "__moddi3",
    ];
    NAMES.contains(&symbol) || symbol.contains("u64_div_rem")
}

/// Returns true if a symbol is arithmetic, comparison or conversion of doubles: a name of the
/// run-time ABI for the Arm architecture (IHI 0043) section 4.1, or GCC's name, which has `df`
/// (double float) in it: `__muldf3`, `__extendsfdf2`, `__floatsidf`.
fn is_software_double(symbol: &str) -> bool {
    let converts_to = ["i2d", "ui2d", "f2d", "l2d", "ul2d"];
    match symbol.strip_prefix("__aeabi_") {
        Some(name) => {
            name.starts_with('d') || name.starts_with("cd") || converts_to.contains(&name)
        }
        None => symbol
            .strip_prefix("__")
            .is_some_and(|name| name.contains("df") && !name.contains(['_', '.'])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_main_may_mask_all_interrupts() {
        let code = "08000100 <main>:\n 8000100:\tcpsid\ti\n 8000102:\tmsr\tBASEPRI, r0\n";
        assert_eq!(masks(code), [""; 0]);
        for instruction in ["cpsid\ti", "msr\tPRIMASK, r0", "msr\tFAULTMASK, r1"] {
            let more = format!("{code}08000200 <acquire>:\n 8000200:\t{instruction}\n");
            let masks = masks(&more);
            assert_eq!(masks.len(), 1, "{instruction}");
            assert!(masks[0].starts_with("acquire: "));
        }
    }

    #[test]
    fn every_family_of_double_routines_is_known() {
        let names = [
            "__aeabi_dmul",
            "__aeabi_drsub",
            "__aeabi_cdcmple",
            "__aeabi_d2f",
            "__aeabi_f2d",
            "__aeabi_ul2d",
        ];
        for name in names.into_iter().chain([
            "__muldf3",
            "__extendsfdf2",
            "__fixdfsi",
            "__floatunsidf",
            "__ltdf2",
        ]) {
            assert!(is_software_double(name), "{name}");
        }
    }

    #[test]
    fn integer_and_single_routines_are_not_doubles() {
        let names = [
            "__aeabi_memcpy",
            "__aeabi_fmul",
            "__aeabi_uldivmod",
            "__mulsf3",
            "__udivmoddi4",
            "__pre_init",
            "handfed",
        ];
        for name in names {
            assert!(!is_software_double(name), "{name}");
        }
    }

    #[test]
    fn long_division_is_known_under_all_its_names() {
        for name in [
            "__aeabi_ldivmod",
            "__udivdi3",
            "_ZN17compiler_builtins3int19specialized_div_rem11u64_div_rem17hE",
        ] {
            assert!(is_long_division(name), "{name}");
        }
        assert!(!is_long_division("__aeabi_lmul"));
    }
}
