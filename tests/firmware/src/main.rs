//! Runs the unmodified firmware in an emulated STM32F407 and holds its pins against the simulator's: `cargo fw-test`.
//!
//! ```text
//!  program --text--> Bench ==USART==> firmware (emulated) --edges, matches--> Tracker --Step--+
//!     |                                                                                       compare
//!     +------------> desk: Machine and step interrupt in the simulator ------------Planned----+
//! ```
//!
//! Each check boots a board of its own; those of the interrupts' time empty the flash's caches at every exception.
//! `cargo fw-test --list` names the checks; those of the subset run in `.ci/run firmware`.
#![forbid(unsafe_code)]
mod bench;
mod checks;
mod compare;
mod desk;
mod firmware;
mod job;
mod pins;
mod steps;
mod stream;

use crate::{
    bench::Failure,
    checks::{Check, CHECKS},
    firmware::Firmware,
};
use std::{env, process::ExitCode, sync::Mutex, thread, time::Instant};

const USAGE: &str = "usage: fw-test ELF ELF-AT-2-MBAUD [--subset | --list | NAME...]";

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let [elf, fast, names @ ..] = words.as_slice() else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    if names == ["--list"] {
        CHECKS.iter().for_each(|check| println!("{check}"));
        return ExitCode::SUCCESS;
    }
    match select(names).and_then(|checks| run(&Firmware::read(elf, fast)?, &checks)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}

/// The checks that were asked for; all where none was.
fn select(names: &[&str]) -> Result<Vec<&'static Check>, Failure> {
    match names {
        [] => Ok(CHECKS.iter().collect()),
        ["--subset"] => Ok(CHECKS.iter().filter(|check| check.subset).collect()),
        names => names.iter().map(|name| find(name)).collect(),
    }
}

fn find(name: &str) -> Result<&'static Check, Failure> {
    let check = CHECKS.iter().find(|check| check.name == name);
    check.ok_or_else(|| Failure(format!("no check '{name}'; `--list` names them")))
}

/// Runs checks on all cores, and prints what each has found in their order.
fn run(firmware: &Firmware, checks: &[&Check]) -> Result<(), Failure> {
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let queue = Mutex::new(checks.iter().enumerate());
    let outcomes = thread::scope(|scope| {
        let workers: Vec<_> = (0..cores)
            .map(|_| scope.spawn(|| work(firmware, &queue)))
            .collect();
        let finished = workers.into_iter().flat_map(|worker| worker.join());
        finished.flatten().collect::<Vec<(usize, bool)>>()
    });
    let failed: Vec<&str> = (0..checks.len())
        .filter(|&index| !outcomes.contains(&(index, true)))
        .map(|index| checks[index].name)
        .collect();
    if failed.is_empty() {
        return Ok(());
    }
    bench::fail(format!("failed: {}", failed.join(", ")))
}

/// What is left to do.
type Queue<'a, 'b> = Mutex<std::iter::Enumerate<std::slice::Iter<'a, &'b Check>>>;

/// Takes checks until none is left; which of them held.
fn work(firmware: &Firmware, queue: &Queue<'_, '_>) -> Vec<(usize, bool)> {
    let mut held = Vec::new();
    loop {
        let next = queue.lock().ok().and_then(|mut queue| queue.next());
        let Some((index, check)) = next else {
            return held;
        };
        let started = Instant::now();
        let outcome = (check.run)(firmware);
        let seconds = started.elapsed().as_secs_f64();
        held.push((index, outcome.is_ok()));
        let text = match outcome {
            Ok(figures) => format!("ok     {:<16} {seconds:6.1} s\n{figures}", check.name),
            Err(failure) => format!("FAILED {:<16} {seconds:6.1} s\n    {failure}\n", check.name),
        };
        print!("{text}");
    }
}
