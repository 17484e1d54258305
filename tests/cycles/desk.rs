//! Sends a program to a machine line by line, and records the moves, dwells and spindle commands
//! that result.

use leadscrew_machine::board::{ChannelId, SpindleOutput};
use leadscrew_machine::explain::PlannedMove;
use leadscrew_planner::{Cartesian, MoveKind};
use leadscrew_sim::{Cycle, Host, Memory, Observer, Simulation, Stopped};
use leadscrew_tests::{setup, MOVES};
use std::collections::VecDeque;

/// Fast axes: feeds take most of the time. No soft limits.
const SETTINGS: &str = "$0=5\n$100=250\n$101=250\n$102=250\n$110=9000\n$111=9000\n$112=9000\n\
    $120=2000\n$121=2000\n$122=2000\n$711=0.254\n";

/// A rest shorter than this is no dwell, s.
const SHORT: f64 = 0.04;

/// Something that a program makes the machine do.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Event {
    /// A move at the rapid rate to X, Y, Z.
    Rapid([f64; 3]),
    /// A move to X, Y, Z at this feed, mm/min.
    Feed([f64; 3], f64),
    /// Rest for this time, s.
    Dwell(f64),
    /// The spindle turns (true) or stands.
    Spindle(bool),
}

/// Records the events.
#[derive(Debug, Default)]
struct Watch {
    events: Vec<Event>,
    rest: Option<Rest>,
}

/// A rest of the motion. Moves that are planned meanwhile begin after all events of the rest.
#[derive(Clone, Copy, Debug)]
struct Rest {
    since: Cycle,
    /// The number of events before the rest.
    before: usize,
    /// The number of times that the spindle has changed since then.
    changes: usize,
}

impl Observer for Watch {
    fn move_planned(&mut self, planned: &PlannedMove<'_>) {
        let target = [0, 1, 2].map(|axis| planned.target[axis].nanos() as f64 / 1e9);
        self.events.push(match planned.kind {
            MoveKind::Rapid => Event::Rapid(target),
            _ => Event::Feed(target, f64::from(planned.feed) * 60.0),
        });
    }

    fn running(&mut self, cycle: Cycle, running: bool) {
        if !running {
            self.rest = Some(Rest {
                since: cycle,
                before: self.events.len(),
                changes: 0,
            });
        } else if let Some(rest) = self.rest.take() {
            let seconds = cycle.seconds() - rest.since.seconds();
            if seconds > SHORT {
                self.events.insert(rest.before, Event::Dwell(seconds));
            }
        }
    }

    fn spindle(&mut self, _: Cycle, output: SpindleOutput) {
        let turns = Event::Spindle(output != SpindleOutput::Off);
        match &mut self.rest {
            Some(rest) => {
                self.events.insert(rest.before + rest.changes, turns);
                rest.changes += 1;
            }
            None => self.events.push(turns),
        }
    }
}

/// A sender that sends a line once the line before was answered with `ok`, and none after an error.
#[derive(Debug, Default)]
struct Sender {
    lines: VecDeque<String>,
    bytes: VecDeque<u8>,
    heard: String,
    error: Option<u32>,
}

impl Sender {
    fn next_line(&mut self) {
        if let (Some(line), None) = (self.lines.pop_front(), self.error) {
            self.bytes.extend(line.as_bytes());
            self.bytes.push_back(b'\n');
        }
    }
}

impl Host for Sender {
    fn next_byte(&mut self, _: ChannelId) -> Option<u8> {
        self.bytes.pop_front()
    }

    fn receive(&mut self, _: ChannelId, byte: u8, _: Cycle) {
        if byte != b'\n' {
            self.heard.push(char::from(byte));
            return;
        }
        let line = std::mem::take(&mut self.heard);
        let line = line.trim_end();
        self.error = line
            .strip_prefix("error:")
            .map(|number| number.parse().unwrap());
        if line == "ok" {
            self.next_line();
        }
    }
}

/// Runs a program up to its first error. Returns the events and the number of the error.
pub(crate) fn run(program: &[String]) -> (Vec<Event>, Option<u32>) {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut sim: Simulation<'_, Cartesian, Watch, 3, 3, MOVES> =
        Simulation::new(&mut memory, &setup, Cartesian, Watch::default());
    let settings = SETTINGS.lines().map(str::to_owned);
    let mut sender = Sender {
        lines: settings.chain(program.iter().cloned()).collect(),
        ..Sender::default()
    };
    sender.next_line();
    let hours = Cycle::from_micros(10 * 3_600_000_000);
    assert_eq!(sim.run_until(&mut sender, hours), Stopped::Quiet);
    assert!(
        sender.error.is_some() || sender.lines.is_empty(),
        "the machine stands still"
    );
    let (outcome, watch) = sim.finish();
    assert!(outcome.violations.is_empty(), "{:?}", outcome.violations);
    (watch.events, sender.error)
}
