//! Golden files of step events, the output of the step interrupt: each small program
//! `golden/NAME.nc` has its events in `golden/NAME.steps`.
//!
//! Lines of a program that begin with `$` are settings. In the step file each row is a run of
//! events along one parabola:
//!
//! ```text
//!      at     interval       add  -   power  steps
//!   12860     4243.250   -12.500  y  0.2500  3x xy 2x
//! ```
//!
//! The run's first event is `at` timer counts (84 MHz) after the first event since the last rest.
//! Event *k* of the run, counted from 0, follows the run's first event, within one count, after
//!
//! ```text
//! k·interval + k(k−1)/2·add
//! ```
//!
//! The letters under `-` name the motors that turn in the negative direction (`.`: none). A pause
//! of more than 0.1 s is a rest and has a row of its own, in ms: the main loop ends it, so that its
//! length depends on how busy the CPU is. `power` is a share of full power. `steps` says which
//! motors step at each event: `3x xy` is x, x, x, then both.
//!
//! After a change that is meant, `BLESS=1 cargo test -p leadscrew-tests golden_steps` writes the
//! step files anew. Look at the difference.

use leadscrew_sim::clock::{CYCLES_PER_COUNT, TIMER_HZ};
use leadscrew_sim::StepEvent;
use leadscrew_tests::{programs, run_program};
use std::fmt::Write;
use std::fs;

const HEADER: &str = "      at     interval       add  -   power  steps\n";

/// Timer counts in a millisecond.
const MILLISECOND: i64 = TIMER_HZ as i64 / 1000;

/// An interval longer than this is a rest, timer counts.
const REST: i64 = 100 * MILLISECOND;

/// One step event. Times are counts of the step timer since the first event.
#[derive(Clone, Copy)]
struct Event {
    at: i64,
    step: u8,
    negative: u8,
    power: f64,
}

impl Event {
    fn new(event: &StepEvent, first: &StepEvent) -> Self {
        Self {
            at: ((event.cycle - first.cycle) / CYCLES_PER_COUNT) as i64,
            step: event.motors.bits(),
            negative: event.negative.bits(),
            power: event.power.share().to_num(),
        }
    }

    /// Returns true if two events may stand in one row.
    fn goes_with(&self, other: &Self) -> bool {
        self.negative == other.negative && self.power == other.power
    }
}

/// Events that lie on one parabola.
struct Row<'a> {
    events: &'a [Event],
    interval: f64,
    add: f64,
}

impl<'a> Row<'a> {
    /// The longest row at the start of `events`, which are not empty.
    fn longest(events: &'a [Event]) -> Self {
        let alike = events
            .iter()
            .take_while(|event| event.goes_with(&events[0]))
            .count();
        let mut best = Self::through(&events[..1]);
        for count in 2..=alike {
            let longer = Self::through(&events[..count]);
            if longer.fits() {
                best = longer;
            } else if count > best.events.len() + 8 {
                break;
            }
        }
        best
    }

    /// The parabola through the first, the middle and the last event.
    fn through(events: &'a [Event]) -> Self {
        let after = |k: usize| (events[k].at - events[0].at) as f64;
        let (n, m) = (events.len() - 1, (events.len() - 1) / 2);
        let (interval, add) = match n {
            0 => (0.0, 0.0),
            1 => (after(1), 0.0),
            _ => {
                let (of_n, of_m) = (after(n) / n as f64, after(m) / m as f64);
                let add = 2.0 * (of_n - of_m) / (n - m) as f64;
                (of_n - add * (n - 1) as f64 / 2.0, add)
            }
        };
        Self {
            events,
            interval,
            add,
        }
    }

    fn fits(&self) -> bool {
        self.events.iter().enumerate().all(|(k, event)| {
            let k = k as f64;
            let said = k * self.interval + k * (k - 1.0) / 2.0 * self.add;
            ((event.at - self.events[0].at) as f64 - said).abs() <= 1.0
        })
    }

    fn print(&self, out: &mut String) {
        let first = &self.events[0];
        write!(
            out,
            "{:>8} {:>12.3} {:>9.3}  {}  {:.4} ",
            first.at,
            self.interval,
            self.add,
            letters(first.negative),
            first.power
        )
        .unwrap();
        for alike in self.events.chunk_by(|a, b| a.step == b.step) {
            let step = letters(alike[0].step);
            match alike.len() {
                1 => write!(out, " {step}").unwrap(),
                count => write!(out, " {count}{step}").unwrap(),
            }
        }
        out.push('\n');
    }
}

/// The letters `x`, `y`, `z` of the motors in a mask, `.` for none.
fn letters(mask: u8) -> String {
    if mask == 0 {
        return ".".into();
    }
    let named = ['x', 'y', 'z'].into_iter().enumerate();
    named
        .filter(|(bit, _)| mask >> bit & 1 == 1)
        .map(|(_, letter)| letter)
        .collect()
}

/// The step file of a program.
fn steps_of(program: &str) -> String {
    let (settings, program): (Vec<&str>, Vec<&str>) =
        program.lines().partition(|line| line.starts_with('$'));
    let steps = run_program(&settings.join("\n"), &program.join("\n")).steps;
    let events: Vec<Event> = steps
        .iter()
        .map(|event| Event::new(event, &steps[0]))
        .collect();
    let mut out = HEADER.to_owned();
    let mut end = None;
    for moving in events.chunk_by(|a, b| b.at - a.at <= REST) {
        let begin = moving[0].at;
        if let Some(end) = end.replace(moving[moving.len() - 1].at) {
            let rest = (begin - end + MILLISECOND / 2) / MILLISECOND;
            writeln!(out, "rest {rest} ms").unwrap();
        }
        let since = |event: &Event| Event {
            at: event.at - begin,
            ..*event
        };
        print_rows(&moving.iter().map(since).collect::<Vec<_>>(), &mut out);
    }
    out
}

fn print_rows(events: &[Event], out: &mut String) {
    let mut rest = events;
    while !rest.is_empty() {
        let row = Row::longest(rest);
        row.print(out);
        rest = &rest[row.events.len()..];
    }
}

/// The first row that differs, as text for the failure message.
fn difference(golden: &str, ours: &str) -> Option<String> {
    let mut rows = golden.lines().zip(ours.lines()).enumerate();
    match rows.find(|(_, (golden, ours))| golden != ours) {
        Some((row, (golden, ours))) => Some(format!(
            "row {}\n  golden {golden}\n  ours   {ours}",
            row + 1
        )),
        None if golden.lines().count() != ours.lines().count() => {
            Some("one is longer than the other".into())
        }
        None => None,
    }
}

#[test]
fn programs_step_as_they_did_when_they_were_blessed() {
    let bless = std::env::var_os("BLESS").is_some();
    let programs = programs("golden");
    assert!(programs.len() >= 6);
    let mut changed = Vec::new();
    for path in programs {
        let ours = steps_of(&fs::read_to_string(&path).unwrap());
        let golden = path.with_extension("steps");
        if bless {
            fs::write(&golden, &ours).unwrap();
        }
        if let Some(what) = difference(&fs::read_to_string(&golden).unwrap(), &ours) {
            changed.push(format!("{}: {what}", path.display()));
        }
    }
    assert!(changed.is_empty(), "\n{}", changed.join("\n"));
}

#[test]
fn rows_hold_every_event_once_and_in_its_place() {
    // Constant speed, then an acceleration, then a sudden long interval.
    let gaps = [100, 100, 100, 90, 80, 70, 60, 400, 400];
    let mut at = 0;
    let events: Vec<Event> = gaps
        .iter()
        .map(|gap| {
            at += gap;
            Event {
                at,
                step: 1,
                negative: 0,
                power: 0.0,
            }
        })
        .collect();
    let mut lengths = Vec::new();
    let mut rest = events.as_slice();
    while !rest.is_empty() {
        let row = Row::longest(rest);
        assert!(row.fits());
        lengths.push(row.events.len());
        rest = &rest[row.events.len()..];
    }
    assert_eq!(lengths, [3, 4, 2]);
}
