//! `bench/sizes.txt`: the firmware's use of flash and memory, and its limits.
//!
//! The room for the program follows from the board's sectors: the build's linker script has its end
//! and the chip's size as symbols (`leadscrew_boards::Board::memory`).
use crate::{failure::Failure, shell, toolchain};
use std::{collections::BTreeMap, fs, path::Path, process::Command};

/// The sizes of a program, in bytes, by the names of `bench/sizes.txt`.
pub(crate) type Sizes = BTreeMap<&'static str, u64>;

/// Measures a linked firmware.
///
/// # Errors
/// When a tool of `binutils-arm-none-eabi` is missing, or its output is not understood.
pub(crate) fn of(elf: &Path) -> Result<Sizes, Failure> {
    let tool =
        |name: &str, options: &[&str]| shell::output(Command::new(name).args(options).arg(elf));
    let sections = tool("arm-none-eabi-objdump", &["-h"])?;
    let section = |name: &str| section(&sections, name).map_or(0, |(size, _)| size);
    let symbols = tool("arm-none-eabi-nm", &[])?;
    let symbol = |name| symbol(&symbols, name).ok_or_else(|| Failure::unreadable("nm", name));
    let flash = [
        ".vector_table",
        ".front",
        ".text",
        ".rodata",
        ".fast_code",
        ".data",
        ".gnu.sgstubs",
    ];
    let end = flash.iter().filter_map(|name| end(&sections, name)).max();
    let left = symbol("__flash_end")?.saturating_sub(end.unwrap_or(0));
    let variables: u64 = [".data", ".bss", ".uninit"].map(section).iter().sum();
    let sram = variables + symbol("__fast_code_reserve")?;
    let ccm = symbol("__stack_top")? - symbol("_stack_end")? + section(".ccm_bss");
    let code = tool("arm-none-eabi-objdump", &["-d", "--no-show-raw-insn"])?;
    Ok(Sizes::from([
        ("flash", flash.map(section).iter().sum()),
        (left_of(symbol("__chip_flash")?), left),
        (sram_of(symbol("__axes_of_file").unwrap_or(0)), sram),
        ("ccm", ccm),
        ("frame", code.lines().filter_map(frame).max().unwrap_or(0)),
    ]))
}

/// The name of the flash that is left of a chip's: the limit is another for a small chip.
fn left_of(chip: u64) -> &'static str {
    match chip {
        ..=0x8_0000 => "left-512",
        _ => "left-1024",
    }
}

/// The name of the variables: a machine with more than four axes takes what is left of the SRAM.
fn sram_of(axes: u64) -> &'static str {
    match axes {
        ..=4 => "sram",
        _ => "sram-6",
    }
}

/// A limit of `bench/sizes.txt`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Limit {
    Most(u64),
    Least(u64),
}

/// Prints all sizes on standard output. Returns a message for each size beyond its limit.
///
/// # Errors
/// When the limits cannot be read.
pub(crate) fn check(sizes: &Sizes) -> Result<Vec<String>, Failure> {
    let limits = limits()?;
    let mut findings = Vec::new();
    for (name, size) in sizes {
        let limit = limits.get(*name).copied();
        println!("{}", row(name, *size, limit));
        findings.extend(limit.and_then(|limit| beyond(name, *size, limit)));
    }
    Ok(findings)
}

/// The limits of `bench/sizes.txt`.
fn limits() -> Result<BTreeMap<String, Limit>, Failure> {
    let path = toolchain::root().join("bench/sizes.txt");
    let text = fs::read_to_string(&path).map_err(Failure::file(&path))?;
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let limits = lines.map(|line| match limit(line) {
        Some((name, limit)) => Ok((name.to_owned(), limit)),
        None => Err(Failure::unreadable(path.display().to_string(), line)),
    });
    limits.collect()
}

/// A size beside its limit, if there is one.
fn row(name: &str, size: u64, limit: Option<Limit>) -> String {
    match limit {
        None => format!("{name:10} {size:7} bytes"),
        Some(Limit::Most(most)) => format!("{name:10} {size:7} of {most:7} bytes"),
        Some(Limit::Least(least)) => format!("{name:10} {size:7} bytes, at least {least}"),
    }
}

/// The message about a size beyond its limit.
fn beyond(name: &str, size: u64, limit: Limit) -> Option<String> {
    match limit {
        Limit::Most(most) if size > most => {
            Some(format!("{name}: {size} bytes, {most} are allowed"))
        }
        Limit::Least(least) if size < least => {
            Some(format!("{name}: {size} bytes, {least} are wanted"))
        }
        Limit::Most(_) | Limit::Least(_) => None,
    }
}

/// A line like `sram <= 106496`.
fn limit(line: &str) -> Option<(&str, Limit)> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [name, sign, bytes] = words[..] else {
        return None;
    };
    let bytes = bytes.parse().ok()?;
    match sign {
        "<=" => Some((name, Limit::Most(bytes))),
        ">=" => Some((name, Limit::Least(bytes))),
        _ => None,
    }
}

/// Size and load address of a section, from a line of `objdump -h` like
/// `  1 .text  000239c4  0800c000  0800c000  00004000  2**4`.
fn section(listing: &str, name: &str) -> Option<(u64, u64)> {
    listing.lines().find_map(|line| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [_, found, size, _, load, ..] = words[..] else {
            return None;
        };
        let number = |digits| u64::from_str_radix(digits, 16).ok();
        (found == name).then(|| Some((number(size)?, number(load)?)))?
    })
}

/// The load address behind a section; `None` if there is none, or if it is empty.
fn end(listing: &str, name: &str) -> Option<u64> {
    let (size, load) = section(listing, name)?;
    (size > 0).then_some(load + size)
}

/// The value of a symbol, from a line like `10004000 A __stack_top`.
pub(crate) fn symbol(listing: &str, name: &str) -> Option<u64> {
    let line = listing
        .lines()
        .find(|line| line.split_whitespace().last() == Some(name))?;
    u64::from_str_radix(line.split_whitespace().next()?, 16).ok()
}

/// The bytes by which an instruction lowers the stack pointer: `sub sp, #32`, `sub.w sp, sp,
/// #7072`.
fn frame(line: &str) -> Option<u64> {
    let (_, instruction) = line.split_once(":\tsub")?;
    let (_, operands) = instruction.split_once("\tsp, ")?;
    operands
        .rsplit_once('#')?
        .1
        .split_whitespace()
        .next()?
        .parse()
        .ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_and_symbols_are_read_by_their_whole_names() {
        let sections = "\
Idx Name          Size      VMA       LMA       File off  Algn
  1 .text         000239e4  0800c000  0800c000  0000c000  2**4
                  CONTENTS, ALLOC, LOAD, READONLY, CODE
  5 .data         000006e8  20001000  0802fa40  00031000  2**2
  6 .gnu.sgstubs  00000000  08030140  08030140  00031700  2**5
";
        assert_eq!(section(sections, ".data"), Some((1768, 0x0802_FA40)));
        assert_eq!(section(sections, ".tex"), None);
        assert_eq!(end(sections, ".data"), Some(0x0803_0128));
        assert_eq!(end(sections, ".gnu.sgstubs"), None);
        let symbols = "10000000 A _stack_end\n10004000 A __stack_top\n";
        assert_eq!(symbol(symbols, "__stack_top"), Some(0x1000_4000));
        assert_eq!(symbol(symbols, "stack_top"), None);
    }

    #[test]
    fn only_what_lowers_the_stack_pointer_is_a_frame() {
        assert_eq!(
            frame(" 8010000:\tsub.w\tsp, sp, #7072\t@ 0x1ba0"),
            Some(7072)
        );
        assert_eq!(frame(" 8010000:\tsub\tsp, #32"), Some(32));
        assert_eq!(frame(" 8010000:\tsubs\tr0, #32"), None);
        assert_eq!(frame(" 8010000:\tadd\tsp, #32"), None);
    }

    #[test]
    fn a_limit_is_the_most_or_the_least() {
        assert_eq!(limit("sram   <= 9"), Some(("sram", Limit::Most(9))));
        assert_eq!(limit("left-512 >= 9"), Some(("left-512", Limit::Least(9))));
        for wrong in ["sram 9", "sram = 9", "sram <= 9 bytes", "sram <= nine"] {
            assert_eq!(limit(wrong), None, "{wrong}");
        }
        assert_eq!(beyond("sram", 9, Limit::Most(9)), None);
        assert!(beyond("sram", 10, Limit::Most(9)).is_some());
        assert_eq!(beyond("left-512", 9, Limit::Least(9)), None);
        assert!(beyond("left-512", 8, Limit::Least(9)).is_some());
    }

    #[test]
    fn every_size_but_the_flash_itself_has_a_limit() {
        let limits = limits().unwrap();
        let names: Vec<&str> = limits.keys().map(String::as_str).collect();
        assert_eq!(
            names,
            ["ccm", "frame", "left-1024", "left-512", "sram", "sram-6"]
        );
    }

    #[test]
    fn a_chip_is_small_up_to_512_kib() {
        assert_eq!(left_of(512 << 10), "left-512");
        assert_eq!(left_of(1024 << 10), "left-1024");
    }

    #[test]
    fn more_than_four_axes_have_a_row_of_their_own() {
        assert_eq!(
            [0, 4, 5, 6].map(sram_of),
            ["sram", "sram", "sram-6", "sram-6"]
        );
    }
}
