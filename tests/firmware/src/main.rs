//! Runs the unmodified firmware in an emulated STM32F407 and compares its pins with the
//! simulator's: `cargo fw-test`.
//!
//! ```text
//!  program --text--> Bench ==USART==> firmware (emulated) --edges, matches--> Tracker --Step--+
//!     |                                                                                       compare
//!     +------------> desk: Machine and step interrupt in the simulator ------------Planned----+
//! ```
//!
//! Each check boots a board of its own. Checks that measure interrupts empty the flash's caches at
//! every exception. `cargo fw-test --list` names the checks; `.ci/run firmware` runs them. `cargo
//! fw-test --planted` plants faults in the firmware, one after the other, and makes sure that the
//! checks find them.
#![forbid(unsafe_code)]
mod bench;
mod checks;
mod claims;
mod compare;
mod desk;
mod failure;
mod firmware;
mod job;
mod pins;
mod plant;
mod planted;
mod qemu;
mod steps;
mod stream;
mod windings;
mod wiring;

use crate::{
    bench::Failure,
    checks::{Check, Figures, CHECKS},
    firmware::Firmware,
    planted::PLANTED,
};
use std::{collections::BTreeSet, env, fs, process::ExitCode, sync::Mutex, thread, time::Instant};

const USAGE: &str =
    "usage: fw-test --needs [TASK]... | FOLDER [--list | --costs | --highest-rate | --rates | --planted [WORD] | qemu | NAME...]";
/// The images that `qemu` needs.
const QEMU: &[&str] = &["skr-2"];
/// The file that `--costs` writes.
const COSTS: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../crates/sim/src/measured.rs"
);

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    if let ["--needs", names @ ..] = words.as_slice() {
        return told(needs(names));
    }
    let [folder, names @ ..] = words.as_slice() else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    if names == ["--list"] {
        CHECKS.iter().for_each(|check| println!("{check}"));
        return ExitCode::SUCCESS;
    }
    let done = match names {
        ["--rates"] => Firmware::uncapped(folder).and_then(|build| checks::rates::table(&build)),
        ["--highest-rate"] => Firmware::uncapped(folder).and_then(|build| {
            println!("{}", checks::rate::highest(&build)?);
            Ok(())
        }),
        ["qemu"] => Firmware::read(folder, QEMU).and_then(|firmware| {
            println!("{}", qemu::check(firmware.build("skr-2")?)?);
            Ok(())
        }),
        names => with_images(folder, names),
    };
    told(done)
}

fn told(done: Result<(), Failure>) -> ExitCode {
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}

/// Does the tasks that need images of the table.
fn with_images(folder: &str, names: &[&str]) -> Result<(), Failure> {
    let firmware = Firmware::read(folder, &needed(names)?)?;
    match names {
        ["--costs"] => Ok(fs::write(COSTS, checks::costs::source(&firmware)?)?),
        names => run(&tasks(&firmware, names)?),
    }
}

/// Prints the names of the images that a task needs, for `xtask`, which builds them.
fn needs(names: &[&str]) -> Result<(), Failure> {
    needed(names)?.iter().for_each(|name| println!("{name}"));
    Ok(())
}

/// The names of the images that a task needs.
fn needed(names: &[&str]) -> Result<Vec<&'static str>, Failure> {
    let of = |checks: &[&'static Check]| {
        let all: BTreeSet<_> = checks
            .iter()
            .flat_map(|check| check.needs)
            .copied()
            .collect();
        all.into_iter().collect()
    };
    match names {
        ["--rates" | "--highest-rate"] => Ok(vec!["uncapped"]),
        ["qemu"] => Ok(QEMU.to_vec()),
        ["--list"] => Ok(Vec::new()),
        ["--costs"] => Ok(of(&[find("costs")?])),
        ["--planted", ..] => {
            let word = names.get(1).copied().unwrap_or_default();
            let faults = PLANTED.iter().filter(|planted| planted.name.contains(word));
            let checks: Vec<_> = faults.flat_map(|planted| planted.checks(CHECKS)).collect();
            Ok(of(&checks))
        }
        [] => Ok(of(&CHECKS.iter().collect::<Vec<_>>())),
        names => {
            let checks: Result<Vec<_>, Failure> = names.iter().map(|name| find(name)).collect();
            Ok(of(&checks?))
        }
    }
}

/// Work that is done on one core.
struct Task<'a> {
    name: String,
    run: Box<dyn Fn() -> Result<Figures, Failure> + Sync + 'a>,
}

/// The requested tasks: checks by their names, all checks if none is named, or planted faults.
fn tasks<'a>(firmware: &'a Firmware, names: &[&str]) -> Result<Vec<Task<'a>>, Failure> {
    match names {
        [] => Ok(CHECKS
            .iter()
            .map(|check| of_check(firmware, check))
            .collect()),
        ["--planted"] => Ok(of_planted(firmware, "")),
        ["--planted", word] => Ok(of_planted(firmware, word)),
        names => {
            let checks = names.iter().map(|name| find(name));
            checks.map(|check| Ok(of_check(firmware, check?))).collect()
        }
    }
}

fn of_check<'a>(firmware: &'a Firmware, check: &'a Check) -> Task<'a> {
    Task {
        name: check.name.into(),
        run: Box::new(|| (check.run)(&firmware.only(check.needs))),
    }
}

/// The faults with `word` in their names, each with every check that must find it.
fn of_planted<'a>(firmware: &'a Firmware, word: &str) -> Vec<Task<'a>> {
    let faults = PLANTED.iter().filter(|planted| planted.name.contains(word));
    faults
        .flat_map(|planted| {
            planted.checks(CHECKS).map(move |check| Task {
                name: planted.name.into(),
                run: Box::new(move || planted.hold(firmware, check)),
            })
        })
        .collect()
}

fn find(name: &str) -> Result<&'static Check, Failure> {
    let check = CHECKS.iter().find(|check| check.name == name);
    check.ok_or_else(|| Failure(format!("no check '{name}'; `--list` names them")))
}

/// Runs tasks on all cores, and prints the findings of each.
fn run(tasks: &[Task<'_>]) -> Result<(), Failure> {
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let queue = Mutex::new(tasks.iter().enumerate());
    let outcomes = thread::scope(|scope| {
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(|| work(&queue))).collect();
        let finished = workers.into_iter().flat_map(|worker| worker.join());
        finished.flatten().collect::<Vec<(usize, bool)>>()
    });
    let failed: Vec<&str> = tasks
        .iter()
        .enumerate()
        .filter(|(index, _)| !outcomes.contains(&(*index, true)))
        .map(|(_, task)| task.name.as_str())
        .collect();
    if failed.is_empty() {
        return Ok(());
    }
    bench::fail(format!("failed: {}", failed.join(", ")))
}

/// The tasks left to do.
type Queue<'a, 'b> = Mutex<std::iter::Enumerate<std::slice::Iter<'a, Task<'b>>>>;

/// Takes tasks until none is left. Returns the index of each, and whether it held.
fn work(queue: &Queue<'_, '_>) -> Vec<(usize, bool)> {
    let mut held = Vec::new();
    loop {
        let next = queue.lock().ok().and_then(|mut queue| queue.next());
        let Some((index, task)) = next else {
            return held;
        };
        let started = Instant::now();
        let outcome = (task.run)();
        let seconds = started.elapsed().as_secs_f64();
        held.push((index, outcome.is_ok()));
        let text = match outcome {
            Ok(figures) => format!("ok     {:<16} {seconds:6.1} s\n{figures}", task.name),
            Err(failure) => format!("FAILED {:<16} {seconds:6.1} s\n    {failure}\n", task.name),
        };
        print!("{text}");
    }
}
