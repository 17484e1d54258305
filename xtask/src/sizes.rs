//! `bench/sizes.txt`: the firmware's use of flash and memory, and its limits.
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
    let sections = tool("arm-none-eabi-size", &["-A"])?;
    let section = |name: &str| section(&sections, name);
    let symbols = tool("arm-none-eabi-nm", &[])?;
    let symbol = |name| symbol(&symbols, name).ok_or_else(|| Failure::unreadable("nm", name));
    let flash = [
        ".vector_table",
        ".text",
        ".rodata",
        ".fast_code",
        ".data",
        ".gnu.sgstubs",
    ];
    let variables: u64 = [".data", ".bss", ".uninit"].map(section).iter().sum();
    let sram = variables + symbol("__fast_code_reserve")?;
    let ccm = symbol("__stack_top")? - symbol("_stack_end")? + section(".ccm_bss");
    let code = tool("arm-none-eabi-objdump", &["-d", "--no-show-raw-insn"])?;
    Ok(Sizes::from([
        ("flash", flash.map(section).iter().sum()),
        ("sram", sram),
        ("ccm", ccm),
        ("frame", code.lines().filter_map(frame).max().unwrap_or(0)),
    ]))
}

/// Prints all sizes on standard output. Returns a message for each size above its limit.
///
/// # Errors
/// When the limits cannot be read.
pub(crate) fn check(sizes: &Sizes) -> Result<Vec<String>, Failure> {
    let path = toolchain::root().join("bench/sizes.txt");
    let text = fs::read_to_string(&path).map_err(Failure::file(&path))?;
    let mut findings = Vec::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let (name, size, limit) = limit(line, sizes)
            .ok_or_else(|| Failure::unreadable(path.display().to_string(), line))?;
        println!("{name:10} {size:7} of {limit:7} bytes");
        if size > limit {
            findings.push(format!("{name}: {size} bytes, {limit} are allowed"));
        }
    }
    Ok(findings)
}

fn limit<'a>(line: &'a str, sizes: &Sizes) -> Option<(&'a str, u64, u64)> {
    let (name, limit) = line.split_once(' ')?;
    Some((name, *sizes.get(name)?, limit.trim().parse().ok()?))
}

/// The size of a section, from a line like `.text   145892   134266880`; 0 where there is none.
fn section(listing: &str, name: &str) -> u64 {
    let words = |line: &str| {
        let mut words = line.split_whitespace();
        (words.next()? == name).then(|| words.next()?.parse().ok())?
    };
    listing.lines().find_map(words).unwrap_or(0)
}

/// The value of a symbol, from a line like `10004000 A __stack_top`.
fn symbol(listing: &str, name: &str) -> Option<u64> {
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
        let sections = ".text        145892   134266880\n.data          1768   536870912\n";
        assert_eq!(section(sections, ".data"), 1768);
        assert_eq!(section(sections, ".tex"), 0);
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
    fn a_line_without_a_size_is_not_understood() {
        let sizes = Sizes::from([("flash", 5)]);
        assert_eq!(limit("flash     9", &sizes), Some(("flash", 5, 9)));
        assert_eq!(limit("flesh     9", &sizes), None);
    }
}
