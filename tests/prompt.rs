//! The delay after which a feed hold or an override acts. The steps after the byte are compared
//! with the steps of the undisturbed run.
//!
//! Both runs make the same step events until the motion committed before the byte has ended. The
//! last equal event begins the first changed interval, in which the deceleration begins.

use leadscrew_planner::Cartesian;
use leadscrew_sim::{Cycle, Memory, StepEvent};
use leadscrew_tests::{setup, Session};
use std::fmt::Write;

type Desk<'a> = Session<'a, Cartesian, 3>;

const CYCLES_PER_US: u64 = 168;

/// The longest time from the byte to the start of the deceleration, µs. 1950 µs are committed
/// (docs/motion.md, section 6); the next step, at 50 kHz, may by chance be the same to the cycle.
const WITHIN: u64 = 1_970;

const SETTINGS: &str =
    "$0=3\n$32=1\n$110=15000\n$111=15000\n$112=15000\n$120=500\n$121=500\n$122=500\n";

struct Situation {
    name: &'static str,
    program: String,
    /// The instants at which the byte is tried, after the program was sent, µs: the first one, and
    /// the time from each to the next.
    begin: u64,
    every: u64,
}

/// The number of instants tried in each situation.
const TRIES: u64 = 20;

fn short_moves() -> String {
    let mut text = String::from("G91M4S500F1500\n");
    for k in 0..600 {
        let bend = 0.02 * (f64::from(k) * 0.7).sin();
        writeln!(text, "G1X0.2Y{bend:.3}").unwrap();
    }
    text
}

fn raster() -> String {
    let mut text = String::from("G91M4S500F3000\n");
    for k in 0..800 {
        writeln!(text, "G1X0.1S{}", k * 37 % 900).unwrap();
    }
    text
}

fn situations() -> Vec<Situation> {
    let new = |name, program: &str, begin, every| Situation {
        name,
        program: program.to_owned(),
        begin,
        every,
    };
    vec![
        new("cruise at 50 kHz", "M4S500\nG1X100F12000\n", 450_000, 1_370),
        new(
            "cruise at 3.3 kHz, two axes",
            "M4S500\nG1X9Y5F900\n",
            200_000,
            1_370,
        ),
        new("speeding up", "M4S500\nG1X100F12000\n", 20_000, 6_370),
        new("short moves", &short_moves(), 300_000, 7_370),
        new("a row of pixels", &raster(), 100_000, 3_370),
        new("1.2 ms a step", "M4S500\nG1X3F200\n", 100_000, 1_137),
        new("1.6 ms a step", "M4S500\nG1X3F150\n", 100_000, 1_137),
        new("1.97 ms a step", "M4S500\nG1X3F122\n", 100_000, 1_137),
        new("2.03 ms a step", "M4S500\nG1X3F118\n", 100_000, 1_137),
        new("4 ms a step", "M4S500\nG1X2F60\n", 100_000, 1_137),
        new("60 ms a step", "M4S500\nG1X0.2F4\n", 300_000, 7_137),
    ]
}

/// Runs a situation's program, with one setting more, and sends `byte` after the given time, µs.
/// Returns when the byte came, and all step events.
fn run(situation: &Situation, more: &str, byte: Option<(u64, u8)>) -> (Cycle, Vec<StepEvent>) {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session: Desk<'_> = Session::new(&mut memory, &setup, Cartesian);
    session.stream(SETTINGS);
    session.stream(&format!("{more}\n"));
    // Send as a sender does that keeps the planner full.
    let lines: Vec<&str> = situation.program.split_inclusive('\n').collect();
    for some in lines.chunks(40) {
        session.send(0, some.concat());
        session.wait_us(20_000);
    }
    let (after, byte) = byte.unzip();
    session.wait_us(after.unwrap_or(0));
    let at = session.sim.now();
    session.send(0, byte.as_slice());
    session.wait_us(3_000_000);
    (at, session.into_steps())
}

/// The interval of the step under way at `at`, cycles, of the motor that steps most (0).
fn interval(steps: &[StepEvent], at: Cycle) -> u64 {
    let mut edges = steps.iter().filter(|event| event.motors.contains(0));
    let next = edges.clone().position(|event| event.cycle > at).unwrap();
    let from = edges.nth(next - 1).unwrap().cycle;
    let until = edges.next().unwrap().cycle;
    until - from
}

/// Returns how long after `at` the two runs stay the same, cycles; `None` if they never differ.
fn same_for(undisturbed: &[StepEvent], steps: &[StepEvent], at: Cycle) -> Option<u64> {
    let pairs = undisturbed.iter().zip(steps);
    let same = pairs.take_while(|(a, b)| a.cycle == b.cycle && a.motors == b.motors);
    let last = same.map(|(event, _)| event.cycle).last()?;
    let all = undisturbed.len() == steps.len() && undisturbed.last()?.cycle == last;
    (!all).then(|| last.max(at) - at)
}

/// Tries `byte` at many instants of the situations that `is_meant` selects, and prints the longest
/// time until it acts, µs.
fn acts_in_time(byte: u8, more: &str, is_meant: impl Fn(&Situation) -> bool) {
    for situation in situations().iter().filter(|of| is_meant(of)) {
        let (_, undisturbed) = run(situation, more, None);
        let (mut worst, mut slowest) = (0, 0);
        for k in 0..TRIES {
            let after = situation.begin + k * situation.every;
            let (at, steps) = run(situation, more, Some((after, byte)));
            let step = interval(&undisturbed, at) / CYCLES_PER_US;
            let same = same_for(&undisturbed, &steps, at)
                .unwrap_or_else(|| panic!("{}: {byte:#x} does nothing", situation.name));
            let same = same / CYCLES_PER_US;
            let name = situation.name;
            assert!(
                same <= WITHIN,
                "{name}, {byte:#x} after {after} us: {same} us"
            );
            (worst, slowest) = (worst.max(same), slowest.max(step));
        }
        println!(
            "{byte:#x}, {more}, {}: acts within {worst} us (a step takes {slowest} us)",
            situation.name
        );
    }
}

#[test]
fn a_feed_hold_begins_within_two_milliseconds() {
    acts_in_time(b'!', "", |_| true);
}

#[test]
fn with_the_longest_lead_a_feed_hold_begins_as_soon() {
    acts_in_time(b'!', "$703=1000", |_| true);
    acts_in_time(b'!', "$703=300", |_| true);
}

/// How long after `at` a deceleration begins that grows evenly, µs. A step that comes a time `t`
/// after the begin is late by a delay that grows with `t³`, so two steps tell the begin:
///
/// ```text
///     begin = first - (second - first) / ((second's delay / first's delay)^(1/3) - 1)
/// ```
fn begins_after(undisturbed: &[StepEvent], steps: &[StepEvent], at: Cycle) -> f64 {
    let of = |steps: &[StepEvent]| -> Vec<Cycle> {
        let edges = steps.iter().filter(|event| event.motors.contains(0));
        edges.map(|event| event.cycle).collect()
    };
    let (planned, made) = (of(undisturbed), of(steps));
    // In cycles: more than what the ticks of a segment are rounded by.
    let [first, second] = [200, 3000].map(|seen| {
        let mut late = planned.iter().copied().zip(made.iter().copied());
        let step = late.find(|(planned, made)| *planned + seen < *made);
        let (planned, made) = step.expect("a late step");
        ((made - at) as f64, (made - planned) as f64)
    });
    let ratio = (second.1 / first.1).cbrt();
    (first.0 - (second.0 - first.0) / (ratio - 1.0)) / CYCLES_PER_US as f64
}

#[test]
fn under_a_jerk_limit_and_beside_a_resonance_a_feed_hold_begins_as_soon() {
    let fast = |of: &Situation| !of.name.contains("ms a step") && of.name != "speeding up";
    for setting in ["$705=5000", "$705=50000", "$708=40"] {
        for situation in situations().iter().filter(|of| fast(of)) {
            let (_, undisturbed) = run(situation, setting, None);
            let mut worst = 0.0f64;
            for k in 0..TRIES {
                let after = situation.begin + k * situation.every;
                let (at, steps) = run(situation, setting, Some((after, b'!')));
                let begins = begins_after(&undisturbed, &steps, at);
                assert!(begins <= WITHIN as f64, "{}: {begins} us", situation.name);
                worst = worst.max(begins);
            }
            println!(
                "0x21, {setting}, {}: acts within {worst:.0} us",
                situation.name
            );
        }
    }
}

#[test]
fn an_override_acts_within_two_milliseconds() {
    let steady = |situation: &Situation| situation.name != "speeding up";
    for byte in [0x91, 0x92, 0x94] {
        acts_in_time(byte, "", steady);
    }
    acts_in_time(0x92, "$703=1000", steady);
}

/// From the start of the deceleration a hold takes the shortest way: `v²/2a`, rounded up to a whole
/// step.
#[test]
fn a_feed_hold_stops_in_the_shortest_way() {
    for (situation, speed) in situations()
        .iter()
        .zip([200.0, 15.0 / (9f64.hypot(5.0) / 9.0)])
    {
        let (_, undisturbed) = run(situation, "", None);
        for k in 0..TRIES {
            let after = situation.begin + k * situation.every;
            let (at, steps) = run(situation, "", Some((after, b'!')));
            let same = same_for(&undisturbed, &steps, at).unwrap();
            let from = at + same;
            let stopping = steps
                .iter()
                .filter(|event| event.cycle > from && event.motors.contains(0));
            // Nothing resumes the motion. The first steps may come less than a cycle later.
            let made = stopping.count() as f64;
            let shortest = 250.0 * speed * speed / 1000.0;
            assert!(
                made <= shortest + 2.0 && made >= shortest - 6.0,
                "{}: {made} steps, {shortest} would do",
                situation.name
            );
        }
    }
}
