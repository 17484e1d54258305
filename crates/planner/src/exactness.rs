//! The times of the edges of random moves, against the move's profile computed exactly.
//!
//! `CAMPAIGN=100000 cargo test --release -p leadscrew-planner exactness -- --nocapture` runs so
//! many moves instead of a few and prints the worst edges.

use crate::emit::fit::Carry;
use crate::emit::running::drive::{Aim, Goal};
use crate::emit::running::{Running, Timing};
use crate::moves::PlannedMove;
use crate::reference::{to, Exact, Player};
use crate::{Profile, Trapezoid};
use leadscrew_stepper::{Early, Interval, Segment};
use std::boxed::Box;
use std::vec::Vec;

const HZ: f64 = 84e6;
const TIMING: Timing = Timing {
    hz: 84e6,
    shortest_tick: 4e-6,
    longest_segment: 1e-3,
};

/// Moves that are checked if no campaign is asked for.
const FEW: u32 = 150;

/// Seconds that a move may take at its rate: slow steps are many segments.
const LONGEST: f32 = 30.0;

/// Bounds of the errors of edges, seconds: of the dominant motor's edges, and of the other motors'.
/// Another 10⁻⁷ of the time since the move began is allowed. The other motors are also allowed a
/// sixteenth of the dominant motor's interval, if that is more.
const DOMINANT: f64 = 1e-6;
const OTHERS: f64 = 5e-6;

/// The shortest tick with pulses of 10 µs on the F407, seconds.
const LONG_TICK: f32 = 11e-6;

/// The factor by which half a tick may be longer than the shortest tick. The speed grows by 1.08 in
/// the segment before (`fit::GROWTH`). In a segment it changes by 12 % from the first tick to the
/// last at most, so that the last tick is 1.06 shorter than the mean one and the first 1.06 longer.
const GROWTH: f64 = 1.08 * 1.06 * 1.06;

/// The error of the ticks themselves, seconds: the largest error of the dominant motor in
/// campaigns.
const OWN: f64 = 0.4e-6;

/// xorshift64 (G. Marsaglia, *Xorshift RNGs*, 2003).
struct Random(u64);

impl Random {
    fn new(seed: u32) -> Self {
        let mut random = Self(u64::from(seed) << 20 | 0x9_E377);
        for _ in 0..8 {
            random.next();
        }
        random
    }

    /// The next number, 0 to 1.
    fn next(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    /// A number between two powers of ten.
    fn ten_to(&mut self, from: f32, to: f32) -> f32 {
        10f32.powf(from + (to - from) * self.next())
    }

    /// A speed up to `rate`, or rest.
    fn speed(&mut self, rate: f32) -> f32 {
        rate * (2.0 * self.next() - 1.0).max(0.0)
    }
}

/// A move at one step a mm, so that mm are steps, and the events in between.
#[derive(Clone, Copy, Debug)]
struct Case {
    seed: u32,
    delta: [i32; 3],
    rate: f32,
    acceleration: f32,
    entry: f32,
    exit: f32,
    /// True if holds and overrides come between segments.
    interrupted: bool,
    /// The shortest tick, seconds.
    shortest_tick: f32,
}

impl Case {
    fn new(seed: u32) -> Self {
        let random = &mut Random::new(seed);
        let events = random.ten_to(0.0, 5.3);
        let rate = random.ten_to(1.0, 5.477);
        let shares = [random.next(), random.next()];
        let events = events.min(LONGEST * rate);
        Self {
            seed,
            delta: [1.0, shares[0], shares[1]].map(|share| (share * events) as i32),
            rate,
            acceleration: random.ten_to(1.0, 6.602),
            entry: random.speed(rate),
            exit: random.speed(rate),
            interrupted: random.next() < 0.3,
            shortest_tick: TIMING.shortest_tick,
        }
    }

    /// A random case with pulses of 10 µs, Grbl's default: ticks are 11 µs apart, and rates are
    /// capped there.
    fn with_long_pulses(seed: u32) -> Self {
        let case = Self::new(seed);
        let most = 1.0 / LONG_TICK;
        Self {
            rate: case.rate.min(most),
            entry: case.entry.min(most),
            exit: case.exit.min(most),
            shortest_tick: LONG_TICK,
            ..case
        }
    }

    fn timing(&self) -> Timing {
        Timing {
            shortest_tick: self.shortest_tick,
            ..TIMING
        }
    }

    /// The error that motors other than the dominant one may have at a step that takes `interval`,
    /// seconds.
    fn others(&self, interval: f64) -> f64 {
        // A step of less than two ticks has no tick within it: the motor is off by half the step.
        // In a longer step it is off by half a tick, and a tick is less than two of the shortest
        // ticks.
        let tick = f64::from(self.shortest_tick);
        let half = f64::min(0.5 * interval, GROWTH * tick);
        OTHERS.max(interval / 16.0).max(half)
    }

    fn running(&self) -> Running<3> {
        let planned = PlannedMove {
            length: self.delta[0] as f32,
            acceleration: self.acceleration,
            rate: self.rate,
            feed: self.rate,
            ..PlannedMove::new(&to(0.0, 0.0, self.rate), self.delta)
        };
        Running::new(&planned, self.entry * self.entry).unwrap()
    }

    fn aim(&self, goal: Goal, share: f32) -> Aim {
        Aim {
            steps_after: 0,
            goal,
            exit_v2: self.exit * self.exit,
            corner_v2: f32::INFINITY,
            nominal: self.rate * share,
            up: self.acceleration,
            down: self.acceleration,
            stop: self.acceleration,
            stop_after: 0,
        }
    }
}

/// Seconds from the start of a profile to a place in it.
type Times = Box<dyn Fn(f64) -> f64>;

fn times(profile: &Trapezoid) -> Times {
    let exact = Exact::new(profile);
    Box::new(move |s| exact.time(s))
}

/// The profiles that a move ran on, one after the other.
#[derive(Default)]
struct Schedule {
    /// For each profile: the place at which it begins, steps; the time there, s; the profile's
    /// times.
    profiles: Vec<(f64, f64, Times)>,
}

impl Schedule {
    fn add(&mut self, running: &Running<3>) {
        let Profile::Trapezoid(profile) = running.profile() else {
            panic!("no mean without a jerk limit")
        };
        if profile.start() != running.here() {
            return; // the one in force is kept
        }
        let place = running.here();
        let start = place.units() as f64 / 4_294_967_296.0;
        let at = self.time(start);
        self.profiles.retain(|(from, ..)| *from < start);
        self.profiles.push((start, at, times(profile)));
    }

    /// Seconds from the move's start to position `s`.
    fn time(&self, s: f64) -> f64 {
        let begun = self.profiles.partition_point(|(from, ..)| *from <= s);
        let under_way = begun
            .checked_sub(1)
            .and_then(|last| self.profiles.get(last));
        under_way.map_or(0.0, |(from, at, exact)| at + exact(s - from))
    }
}

/// The edges of a move's motors, seconds.
type Edges = [Vec<f64>; 3];

/// Makes the profile of a move anew.
fn plan(running: &mut Running<3>, aim: Aim, timing: Timing) {
    if let Profile::Trapezoid(profile) = running.profile {
        running.follow(running.drive.planned(&profile, aim), timing);
    }
}

/// Plays a move; `meddle` may spoil each of its segments.
fn play(case: &Case, mut meddle: impl FnMut(&mut Segment<3>)) -> (Schedule, Edges) {
    let random = &mut Random::new(!case.seed);
    let (mut running, mut player, mut carry) = (case.running(), Player::new(), Carry::default());
    let (mut schedule, mut edges) = (Schedule::default(), Edges::default());
    let going = |share| case.aim(Goal::End, share);
    let timing = case.timing();
    plan(&mut running, going(1.0), timing);
    schedule.add(&running);
    while !running.at_end() {
        let mut segment = running.segment::<false>(timing, &mut carry, Goal::End);
        meddle(&mut segment);
        for timed in player.play(&segment) {
            for (motor, edges) in edges.iter_mut().enumerate() {
                if timed.tick.step.contains(motor) {
                    edges.push(timed.at as f64 / HZ);
                }
            }
        }
        let aim = if running.at_profile_end() {
            going(1.0)
        } else if !case.interrupted || random.next() > 0.1 {
            continue;
        } else if random.next() < 0.5 {
            case.aim(Goal::Stop, 1.0)
        } else {
            going(0.2 + random.next())
        };
        if !running.at_end() {
            plan(&mut running, aim, timing);
            schedule.add(&running);
        }
    }
    (schedule, edges)
}

/// The errors of edges, as a share of the allowed ones.
#[derive(Clone, Copy, Default, Debug)]
struct Worst {
    /// The worst error of the dominant motor. 10⁻⁷ of the time since the start does not count.
    dominant: f64,
    /// The worst error of the other motors.
    others: f64,
    /// The place of that error (steps of the dominant motor), the interval of the dominant motor
    /// there, and how late the edge is (seconds).
    place: [f64; 3],
}

fn worst(case: &Case, meddle: impl FnMut(&mut Segment<3>)) -> Worst {
    let (schedule, edges) = play(case, meddle);
    for (edges, steps) in edges.iter().zip(case.delta) {
        assert_eq!(edges.len(), steps as usize, "{case:?}");
    }
    let mut worst = Worst::default();
    // The due times of the dominant motor's steps.
    let dues: Vec<f64> = (0..=edges_of(case))
        .map(|k| schedule.time(k as f64))
        .collect();
    for (at, due) in edges[0].iter().zip(&dues[1..]) {
        let off = (at - due).abs() - 1e-7 * due;
        worst.dominant = worst.dominant.max(off / DOMINANT);
    }
    let events = f64::from(case.delta[0]);
    let others = edges.iter().filter(|edges| edges.len() < edges_of(case));
    for motor in others {
        // A motor is due half-way to its next step.
        let per_step = events / motor.len() as f64;
        for (k, at) in motor.iter().enumerate() {
            let s = (k as f64 + 0.5) * per_step;
            let due = schedule.time(s);
            let step = s as usize;
            let interval = dues[step + 1] - dues[step];
            let bound = case.others(interval) + 1e-7 * due + OWN;
            let late = at - due;
            let share = late.abs() / bound;
            if share > worst.others {
                (worst.others, worst.place) = (share, [s, interval, late]);
            }
        }
    }
    worst
}

fn edges_of(case: &Case) -> usize {
    case.delta[0] as usize
}

#[test]
fn every_edge_of_random_moves_lies_on_the_profile() {
    check(FEW, Case::new);
}

#[test]
fn with_pulses_of_ten_microseconds_every_edge_lies_within_half_a_step_or_a_tick() {
    check(FEW, Case::with_long_pulses);
}

/// Checks `few` moves, or as many as a campaign asks for.
fn check(few: u32, case: impl Fn(u32) -> Case) {
    let campaign = std::env::var("CAMPAIGN").ok();
    let moves = campaign.map_or(few, |moves| moves.parse().unwrap());
    let (mut all, mut steps, mut names) = (Worst::default(), 0u64, [0, 0]);
    for seed in 0..moves {
        let case = case(seed);
        let worst = worst(&case, |_| ());
        if worst.dominant > all.dominant {
            (all.dominant, names[0]) = (worst.dominant, seed);
        }
        if worst.others > all.others {
            (all.others, all.place, names[1]) = (worst.others, worst.place, seed);
        }
        steps += case
            .delta
            .iter()
            .map(|steps| u64::from(steps.unsigned_abs()))
            .sum::<u64>();
    }
    std::println!(
        "{moves} moves, {steps} steps: dominant {:.3} of 1 us (case {}), others {:.3} of max(5 us, 1/16 interval) (case {}: at step {:.1}, which takes {:.2e} s, {:.2e} s late)",
        all.dominant, names[0], all.others, names[1], all.place[0], all.place[1], all.place[2],
    );
    assert!(all.dominant < 1.0, "{:?}", case(names[0]));
    assert!(all.others < 1.0, "{all:?} {:?}", case(names[1]));
}

#[test]
fn intervals_a_count_too_long_and_motors_that_are_never_early_are_found() {
    let (mut dominant, mut others) = (0.0, 0.0);
    for seed in 0..100 {
        let case = Case::new(seed);
        let longer = worst(&case, |segment| {
            segment.interval = segment.interval.saturating_add(Interval::ONE);
        });
        dominant = f64::max(dominant, longer.dominant);
        let late = worst(&case, |segment| {
            if !segment.early.is_of_a_part() {
                segment.early = Early::NOT;
            }
        });
        others = f64::max(others, late.others);
    }
    assert!(dominant > 1.0 && others > 1.0, "{dominant} {others}");
}

#[test]
fn the_cases_of_the_segment_study_hold() {
    for (acceleration, rate, steps) in [
        (40e3, 4e3, 4000),
        (240e3, 16e3, 16_000),
        (1e6, 1e5, 30_000),
        (2e6, 250e3, 60_000),
        (80e3, 250e3, 900_000),
        (4e6, 3e5, 60_000),
        (2e3, 2e3, 3000),
    ] {
        let case = Case {
            seed: 0,
            delta: [steps, steps / 3, 0],
            rate,
            acceleration,
            entry: 0.0,
            exit: 0.0,
            interrupted: false,
            shortest_tick: TIMING.shortest_tick,
        };
        let worst = worst(&case, |_| ());
        std::println!("a {acceleration:e} v {rate:e} n {steps}: {worst:?}");
        assert!(worst.dominant < 1.0 && worst.others < 1.0);
    }
}
