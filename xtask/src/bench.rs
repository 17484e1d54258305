//! `cargo xtask bench COMMAND...`: x86-64 instructions per line, counted by callgrind.
//!
//! The command runs twice, with `{lines}` in it replaced by [`LINES`] and by twice that number. The
//! difference is the work for [`LINES`] lines, without the work that a program does once, at its
//! start and end.
use crate::{failure::Failure, shell};
use std::process::Command;

/// The lines of the shorter run. Every job of `bench/workloads` has more than twice as many.
const LINES: u64 = 20_000;
/// The text that stands for the number of lines in the command.
const PLACEHOLDER: &str = "{lines}";

/// Counts the instructions, and prints them per line.
pub(crate) fn run(command: &[String]) -> Result<(), Failure> {
    if !command.iter().any(|word| word.contains(PLACEHOLDER)) {
        return Err(Failure::NoPlaceholder);
    }
    let short = instructions(command, LINES)?;
    let long = instructions(command, 2 * LINES)?;
    let difference = long.checked_sub(short);
    let difference = difference.ok_or(Failure::FewerInstructions)?;
    println!(
        "{:.1} instructions per line",
        difference as f64 / LINES as f64
    );
    Ok(())
}

/// The instructions of one run of the command.
fn instructions(command: &[String], lines: u64) -> Result<u64, Failure> {
    let words = command
        .iter()
        .map(|word| word.replace(PLACEHOLDER, &lines.to_string()));
    let mut valgrind = Command::new("valgrind");
    valgrind
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .args(words);
    let report = shell::error_output(&mut valgrind)?;
    collected(&report).ok_or_else(|| Failure::unreadable("valgrind's report", report))
}

/// The count in callgrind's report, from a line like `==1234== Collected : 5678`.
fn collected(report: &str) -> Option<u64> {
    let line = report.lines().find(|line| line.contains("Collected :"))?;
    line.split_whitespace().last()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_count_is_found_among_what_valgrind_and_the_program_say() {
        let report = "==7== Callgrind\nprogram: 12\n==7== \n==7== Events    : Ir\n==7== Collected : 5678\n==7== \n";
        assert_eq!(collected(report), Some(5678));
        assert_eq!(collected("==7== Callgrind\n"), None);
    }

    #[test]
    fn a_command_that_does_not_take_the_number_of_lines_is_refused() {
        assert!(run(&["true".to_owned()]).is_err());
    }
}
