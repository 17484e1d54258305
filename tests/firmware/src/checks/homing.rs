//! Homing: carriages that work limit switches.
use super::Figures;
use crate::{
    bench::{ensure, fail, Bench, Failure},
    firmware::{Build, Firmware},
    steps::Counter,
};
use std::array::from_fn;

/// Homing in the positive directions, with a pull-off of 1 mm.
const SETTINGS: &str = "$0=5\n$22=1\n$24=60\n$25=1200\n$26=20\n$27=1\n$100=250\n$101=250\n$102=250\n$110=2000\n$111=2000\n$112=2000\n$120=500\n$121=500\n$122=500\n";
/// Zero at the place that an owner wants: the switches of X and Z are at -3 and 12, X goes 2 mm off
/// its one.
const OWN: &str = "$719=5\n$740=-3\n$742=12\n$750=2\n$760=600\n$770=30\n";
/// Steps of the pull-offs then, and the report.
const OWN_PULL_OFFS: [i64; 3] = [500, 250, 250];
const OWN_PLACE: &str = "<Idle|MPos:-5.000,-1.000,11.000|";
/// Steps from each switch at power-up, and steps of the pull-off.
const AWAY: [i64; 3] = [700, 1300, 411];
const PULL_OFF: i64 = 250;
/// The most steps that a carriage may go beyond its switch in the slow search: at 250 steps/s it
/// goes on for the filter's 0.2 ms and until the next look.
const SLACK: i64 = 1;
/// Cycles between two looks of the carriages: 24 µs.
const LOOK: u64 = 4_000;

/// The way in which the motors move the carriages.
#[derive(Clone, Copy)]
pub(super) enum Belts {
    /// Each motor moves its own carriage.
    Straight,
    /// The first two motors move X and Y together: half their sum, and half their difference.
    Crossed,
}

impl Belts {
    /// Returns how far the carriages have moved for these steps of the motors, whole steps.
    fn carry<const MOTORS: usize>(self, motors: [i64; MOTORS]) -> [i64; MOTORS] {
        let mut carriages = motors;
        if let (Belts::Crossed, [x, y, ..], [a, b, ..]) =
            (self, carriages.as_mut_slice(), motors.as_slice())
        {
            (*x, *y) = ((a + b).div_euclid(2), (a - b).div_euclid(2));
        }
        carriages
    }
}

/// Carriages that close their limit switches.
struct Carriages<const MOTORS: usize> {
    belts: Belts,
    /// Their places at power-up and now, in steps from each switch; a switch is
    /// closed from 0 on.
    begin: [i64; MOTORS],
    position: [i64; MOTORS],
    motors: Counter<MOTORS>,
}

impl<const MOTORS: usize> Carriages<MOTORS> {
    /// Follows the motors, and works the switches.
    fn follow(&mut self, bench: &mut Bench) {
        let carried = self.belts.carry(self.motors.follow(&bench.pins.steps));
        let now: [i64; MOTORS] = from_fn(|motor| self.begin[motor] + carried[motor]);
        let limits = bench.wiring.limits;
        for ((position, now), limit) in self.position.iter_mut().zip(now).zip(limits) {
            let before = std::mem::replace(position, now);
            if let (Some(switch), true) = (limit, (before >= 0) != (*position >= 0)) {
                bench.set(switch.pin, (*position >= 0) == switch.closed);
            }
        }
    }
}

/// Homes carriages that are `away` steps from their switches, with `more` settings. Returns where
/// they are then, in steps beyond the switches.
fn home<const MOTORS: usize>(
    build: &Build,
    belts: Belts,
    away: [i64; MOTORS],
    more: &str,
) -> Result<(Bench, [i64; MOTORS]), Failure> {
    let mut bench = Bench::boot(build)?;
    bench.commands(SETTINGS)?;
    bench.commands(more)?;
    bench.pins.clear();
    let mut carriages = Carriages {
        belts,
        begin: away.map(|steps| -steps),
        position: away.map(|steps| -steps),
        motors: Counter::ZERO,
    };
    bench.send("$H\n");
    for _ in 0..2_000_000 {
        bench.run_to(bench.machine.cycle() + LOOK)?;
        carriages.follow(&mut bench);
        let heard = bench.heard();
        if heard.iter().any(|line| line == "ok") {
            return Ok((bench, carriages.position));
        }
        ensure(heard.is_empty(), || {
            format!("homing: {heard:?} at {:?}", carriages.position)
        })?;
    }
    fail("homing does not end")
}

/// Homes, and checks each carriage's place: against its switch if it has one, otherwise against its
/// place before. Returns the sentence for the report.
pub(super) fn ensure_homes<const MOTORS: usize>(
    build: &Build,
    belts: Belts,
    away: [i64; MOTORS],
    says: &str,
) -> Result<String, Failure> {
    let (mut bench, position) = home(build, belts, away, "")?;
    let status = bench.status()?;
    let words = format!("{position:?} steps from the switches, {status}");
    let right = |((position, away), limit): ((&i64, i64), &Option<_>)| match limit {
        Some(_) => (-PULL_OFF..=SLACK - PULL_OFF).contains(position),
        None => *position == -away,
    };
    let mut all = position.iter().zip(away).zip(build.wiring.limits);
    ensure(all.all(right) && status.starts_with(says), || words.clone())?;
    Ok(words)
}

/// Homes with a zero, pull-offs and rates by axis.
fn own_zero(build: &Build) -> Result<String, Failure> {
    let (mut bench, position) = home(build, Belts::Straight, AWAY, OWN)?;
    let status = bench.status()?;
    let words = format!("{position:?} steps from the switches, {status}");
    let mut all = position.iter().zip(OWN_PULL_OFFS);
    let right = all.all(|(position, off)| (-off..=SLACK - off).contains(position));
    ensure(right && status.starts_with(OWN_PLACE), || words.clone())?;
    Ok(words)
}

pub(crate) fn homing(firmware: &Firmware) -> Result<Figures, Failure> {
    let words = ensure_homes(
        firmware.build("usual")?,
        Belts::Straight,
        AWAY,
        "<Idle|MPos:-1.000,-1.000,-1.000|",
    )?;
    let mut figures = Figures::default();
    figures.add("three axes", words);
    figures.add("zero of the owner's", own_zero(firmware.build("usual")?)?);
    Ok(figures)
}
