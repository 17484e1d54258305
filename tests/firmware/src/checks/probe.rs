//! Carriages that work switches: the probe, and homing.
use super::Figures;
use crate::{
    bench::{ensure, fail, Bench, Failure},
    desk,
    firmware::{Build, Firmware},
    pins::{LIMIT, PROBE},
    steps::net,
};

/// 250 steps/mm; Z up to 50 000 steps/s.
const SETTINGS: &str = "$0=5\n$701=0\n$102=250\n$112=12000\n$122=1000\n";
/// Probing feeds in mm/min with the steps to the contact: slow, and in the cruise of the fastest.
const PROBINGS: [(&str, usize); 3] = [
    ("G38.2Z-20F60", 100),
    ("G38.3Z-60F3000", 1501),
    ("G38.2Z-200F12000", 7003),
];
/// The instants of the contact between two steps, of 16.
const PLACES: [u64; 4] = [2, 5, 10, 14];

/// What the machine says of a probing that meets something between the steps `contact` and `contact + 1`, at `place`
/// sixteenths of the time between them.
fn report(bench: &Bench, line: &str, contact: usize, place: u64) -> Result<Vec<String>, Failure> {
    // Where the steps will be: the emulator does the same in every run.
    let mut ahead = bench.clone();
    ahead.send(format!("{line}\n"));
    while ahead.pins.steps.len() <= contact {
        ahead.run_for(0.001)?;
    }
    let (before, after) = (
        ahead.pins.steps[contact - 1].edge(),
        ahead.pins.steps[contact].edge(),
    );
    let edge = before + (after - before) * place / 16;
    let mut bench = bench.clone();
    bench.machine.pin_at(edge, PROBE, false);
    let mut heard = bench.say(line)?;
    let touched = bench
        .pins
        .steps
        .iter()
        .filter(|step| step.edge() <= edge)
        .count();
    ensure(touched == contact, || {
        format!("{touched} steps before the contact, not {contact}")
    })?;
    heard.retain(|line| line.starts_with("[PRB:"));
    Ok(heard)
}

pub(crate) fn probe(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut bench = Bench::boot(&firmware.usual)?;
    bench.commands(SETTINGS)?;
    bench.cold();
    bench.pins.clear();
    let mut figures = Figures::default();
    for (line, contact) in PROBINGS {
        let expected = desk::probe(SETTINGS, &format!("{line}\n"), contact)?;
        for place in PLACES {
            let found = report(&bench, line, contact, place)?;
            ensure(found == [expected.as_str()], || {
                format!("{line}: contact at {place}/16 after step {contact}: {found:?}, the simulator says {expected}")
            })?;
        }
        figures.add(line, expected);
    }
    Ok(figures)
}

/// Homing in the positive directions, with 1 mm pulled off.
const HOMING: &str = "$0=5\n$22=1\n$24=60\n$25=1200\n$26=20\n$27=1\n$100=250\n$101=250\n$102=250\n$110=2000\n$111=2000\n$112=2000\n$120=500\n$121=500\n$122=500\n";
/// Steps from each switch at power-up, and steps of the pull-off.
const AWAY: [i64; 3] = [700, 1300, 411];
const PULL_OFF: i64 = 250;
/// Steps that a carriage may go on after its switch in the slow search: 250 steps/s, for the filter's 0.2 ms and a look.
const SLACK: i64 = 1;
/// Cycles between two looks of the carriages: 24 µs.
const LOOK: u64 = 4_000;

/// Carriages that close their limit switches.
struct Carriages {
    /// Steps from each switch; closed from 0 on.
    position: [i64; 3],
    /// Step events that are counted already.
    counted: usize,
}

impl Carriages {
    /// Follows the motors, and works the switches.
    fn follow(&mut self, bench: &mut Bench) {
        let moved = net(&bench.pins.steps[self.counted..]);
        self.counted = bench.pins.steps.len();
        for ((position, moved), pin) in self.position.iter_mut().zip(moved).zip(LIMIT) {
            let before = *position;
            *position += moved;
            if (before >= 0) != (*position >= 0) {
                bench.set(pin, *position < 0);
            }
        }
    }
}

fn home(build: &Build) -> Result<(Bench, Carriages), Failure> {
    let mut bench = Bench::boot(build)?;
    bench.commands(HOMING)?;
    bench.pins.clear();
    let mut carriages = Carriages {
        position: AWAY.map(|steps| -steps),
        counted: 0,
    };
    bench.send("$H\n");
    for _ in 0..2_000_000 {
        bench.run_to(bench.machine.cycle() + LOOK)?;
        carriages.follow(&mut bench);
        let heard = bench.heard();
        if heard.iter().any(|line| line == "ok") {
            return Ok((bench, carriages));
        }
        ensure(heard.is_empty(), || {
            format!("homing: {heard:?} at {:?}", carriages.position)
        })?;
    }
    fail("homing does not end")
}

pub(crate) fn homing(firmware: &Firmware) -> Result<Figures, Failure> {
    let (mut bench, carriages) = home(&firmware.usual)?;
    let status = bench.status()?;
    let right = carriages
        .position
        .iter()
        .all(|position| (-PULL_OFF..=SLACK - PULL_OFF).contains(position));
    let mut figures = Figures::default();
    figures.add(
        "steps from the switches, and what the machine says",
        format!("{:?} {status}", carriages.position),
    );
    ensure(
        right && status.starts_with("<Idle|MPos:-1.000,-1.000,-1.000|"),
        || figures.to_string(),
    )?;
    Ok(figures)
}
