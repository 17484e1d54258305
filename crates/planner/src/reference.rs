//! Slow and obvious models that the tests compare with, in `f64`.

use crate::{
    Cartesian, Config, Coordinate, Feed, Move, MoveKind, MovePower, Overrides, PixelQueue, Planner,
    Queue, Segmenter, Trapezoid, THREE_DECIMALS,
};
use leadscrew_stepper::{OutputChange, Progress, Segment, Stepper, Tick};
use proptest::prelude::ProptestConfig;
use proptest::test_runner::{TestRng, TestRunner};
use std::boxed::Box;
use std::vec::Vec;

/// A number of cases, and as many times more as `PROPTEST_CASES` is more than proptest's own 256.
pub(crate) fn times(cases: u32) -> ProptestConfig {
    let times = ProptestConfig::default().cases / 256;
    ProptestConfig::with_cases(cases * times.max(1))
}

/// Runs a property on a number of cases, the same ones each time. In a campaign, with
/// `PROPTEST_CASES`, on as many times more as [`times`] says, and on new ones.
pub(crate) fn runner(cases: u32) -> TestRunner {
    let scaled = times(cases);
    let config = ProptestConfig {
        failure_persistence: None,
        max_shrink_iters: 50,
        // How many do not suit the property grows with the cases.
        max_global_rejects: scaled.cases.max(1024),
        ..scaled
    };
    if config.cases > cases {
        return TestRunner::new(config);
    }
    let rng = TestRng::deterministic_rng(config.rng_algorithm);
    TestRunner::new_with_rng(config, rng)
}

/// The time of each position of a [`Trapezoid`], from its parameters, in `f64`.
pub(crate) struct Exact {
    length: f64,
    entry_v2: f64,
    exit_v2: f64,
    cruise: f64,
    slopes: [f64; 2],
    first: f64,
    last: f64,
}

impl Exact {
    pub(crate) fn new(of: &Trapezoid) -> Self {
        let start = of.start();
        let length = start.exact_before(of.end());
        let (entry_v2, exit_v2) = (f64::from(of.entry_v2()), f64::from(of.exit_v2()));
        let slopes = of.accelerations().map(|a| 2.0 * f64::from(a));
        let mut cruise = f64::from(of.cruise());
        let mut first = ((cruise * cruise - entry_v2) / slopes[0]).max(0.0);
        let mut last = ((cruise * cruise - exit_v2) / slopes[1]).max(0.0);
        if first + last > length && slopes[0] > 0.0 {
            // The ramps meet before the rounded peak.
            first = ((slopes[1] * length + exit_v2 - entry_v2) / (slopes[0] + slopes[1]))
                .clamp(0.0, length);
            last = length - first;
            cruise = (entry_v2 + slopes[0] * first)
                .max(exit_v2 + slopes[1] * last)
                .sqrt();
        }
        Self {
            length,
            entry_v2,
            exit_v2,
            cruise,
            slopes,
            first,
            last,
        }
    }

    /// Seconds from the start to position `s` (steps).
    pub(crate) fn time(&self, s: f64) -> f64 {
        if s <= 0.0 {
            return 0.0;
        }
        let over = |from_v2: f64, slope: f64, s: f64| {
            2.0 * s / (from_v2.sqrt() + (from_v2 + slope * s).max(0.0).sqrt())
        };
        let first = if self.first > 0.0 {
            over(self.entry_v2, self.slopes[0], s.min(self.first))
        } else {
            0.0
        };
        let braking = self.length - self.last;
        let middle = (s.min(braking) - self.first).max(0.0) / self.cruise;
        let y = self.length - s;
        let last = if s > braking {
            let whole = over(self.exit_v2, self.slopes[1], self.last);
            whole
                - if y > 0.0 {
                    over(self.exit_v2, self.slopes[1], y)
                } else {
                    0.0
                }
        } else {
            0.0
        };
        first + middle + last
    }
}

/// A tick and when it comes, in timer counts.
pub(crate) struct Timed {
    pub(crate) at: u64,
    pub(crate) tick: Tick,
}

/// Runs segments through the real stepper.
pub(crate) struct Player<const MOTORS: usize> {
    stepper: Stepper<MOTORS>,
    pub(crate) now: u64,
    pub(crate) position: [i32; MOTORS],
}

impl<const MOTORS: usize> Player<MOTORS> {
    pub(crate) fn new() -> Self {
        Self {
            stepper: Stepper::new(),
            now: 0,
            position: [0; MOTORS],
        }
    }

    pub(crate) fn play(&mut self, segment: &Segment<MOTORS>) -> Vec<Timed> {
        let mut next = Some(*segment);
        let mut ticks = Vec::new();
        for _ in 0..segment.ticks.get() {
            let Progress::Tick(tick) = self.stepper.tick(|| next.take()) else {
                panic!("a segment ended early")
            };
            self.now += u64::from(tick.wait.0);
            for (motor, position) in self.position.iter_mut().enumerate() {
                let sign = if tick.direction.contains(motor) {
                    -1
                } else {
                    1
                };
                *position += sign * i32::from(tick.step.contains(motor));
            }
            ticks.push(Timed { at: self.now, tick });
        }
        ticks
    }
}

/// A queue that lives as long as the tests.
pub(crate) fn queue<const AXES: usize, const MOTORS: usize, const MOVES: usize>(
) -> &'static mut Queue<AXES, MOTORS, MOVES> {
    Box::leak(Box::new(Queue::new()))
}

/// A queue of pixels that lives as long as the tests.
pub(crate) fn pixels<const PIXELS: usize>() -> &'static mut PixelQueue<PIXELS> {
    Box::leak(Box::new(PixelQueue::new()))
}

/// Queues for the moves of a [`Rig`] and their pixels.
pub(crate) struct RigQueue(Queue<2, 2, 1024>, PixelQueue<4608>);

impl RigQueue {
    pub(crate) fn new() -> Self {
        Self(Queue::new(), PixelQueue::new())
    }
}

/// An interruption of motion: the number of segments before it, and a feed override (per cent); a
/// hold if that is `None`.
pub(crate) type Interruption = (usize, Option<u8>);

/// A machine of two axes, whose queue is kept as full as possible.
pub(crate) struct Rig<'q> {
    pub(crate) planner: Planner<'q, Cartesian, 2, 2>,
    pub(crate) segmenter: Segmenter<2, 2>,
    pub(crate) player: Player<2>,
}

impl<'q> Rig<'q> {
    pub(crate) fn new(config: Config<2>, queue: &'q mut RigQueue) -> Self {
        Self {
            planner: Planner::new(config, Cartesian, &mut queue.0, &mut queue.1).unwrap(),
            segmenter: Segmenter::new(),
            player: Player::new(),
        }
    }

    /// Plays one segment and returns it; `None` if there is none.
    pub(crate) fn step(&mut self) -> Option<Segment<2>> {
        let segment = self.segmenter.next(&mut self.planner)?;
        self.player.play(&segment);
        Some(segment)
    }

    /// Carries out the interruptions that come after `segments` segments.
    pub(crate) fn interrupt(&mut self, interruptions: &[Interruption], segments: usize) {
        for (_, feed) in interruptions.iter().filter(|(after, _)| *after == segments) {
            match feed {
                None => self.segmenter.hold(),
                Some(feed) => self
                    .planner
                    .set_overrides(Overrides {
                        feed: *feed,
                        rapid: 100,
                    })
                    .unwrap(),
            }
        }
    }

    /// Runs all of `moves` and returns the seconds that took.
    pub(crate) fn run(&mut self, moves: &[Move<2>]) -> f64 {
        let mut moves = moves.iter();
        let mut waiting = moves.next();
        loop {
            while let Some(next) = waiting.filter(|_| self.planner.has_room()) {
                self.planner.push(next).unwrap();
                waiting = moves.next();
            }
            if self.step().is_none() {
                break;
            }
        }
        self.player.now as f64 / f64::from(self.planner.config().timer_hz)
    }
}

/// A feed move to (x, y) mm at `feed` mm/s.
pub(crate) fn to(x: f64, y: f64, feed: f32) -> Move<2> {
    Move {
        target: [x, y].map(|mm| Coordinate::from_nanos((mm * 1e9).round() as i64)),
        feed: Feed::PerMinute(feed),
        power: MovePower::Off,
        curve: None,
        rounding: THREE_DECIMALS,
        outputs: OutputChange::NONE,
        line_number: None,
        kind: MoveKind::Feed,
    }
}

/// A polyline in steps of 0.004 mm as moves at `feed` mm/s.
pub(crate) fn polyline(points: &[[i32; 2]], feed: f32) -> Vec<Move<2>> {
    let mm = |steps| f64::from(steps) * 0.004;
    points
        .iter()
        .map(|[x, y]| to(mm(*x), mm(*y), feed))
        .collect()
}

/// A leg of a polyline: length (mm), acceleration (mm/s²), speed (mm/s), and the squared speed at
/// its start that the corner and both speeds allow.
struct Leg {
    length: f64,
    a: f64,
    v: f64,
    u: [f64; 2],
    entry: f64,
}

/// The largest value along the direction `u` if each axis has its limit.
fn limit(limits: [f32; 2], u: [f64; 2]) -> f64 {
    (0..2)
        .map(|i| f64::from(limits[i]) / u[i].abs())
        .fold(f64::INFINITY, f64::min)
}

/// Junction deviation as the paper writes it.
fn corner_v2(config: &Config<2>, u0: [f64; 2], u1: [f64; 2]) -> f64 {
    let cos = -(u0[0] * u1[0] + u0[1] * u1[1]);
    if cos > 0.999999 {
        return 0.0;
    }
    if cos < -0.999999 {
        return f64::INFINITY;
    }
    let s = (0.5 * (1.0 - cos)).sqrt();
    let n = [u1[0] - u0[0], u1[1] - u0[1]];
    let m = n[0].hypot(n[1]);
    limit(config.acceleration, n.map(|n| n / m)) * f64::from(config.junction_deviation) * s
        / (1.0 - s)
}

/// The legs between `points` (steps) at `feed` mm/s; those without a step are left out.
fn legs(config: &Config<2>, points: &[[i32; 2]], feed: f64) -> Vec<Leg> {
    let scale = config.steps_per_mm.map(|s| s.nanos() as f64 / 1e9);
    let mut legs: Vec<Leg> = Vec::new();
    for pair in points.windows(2) {
        let d = [0, 1].map(|i| f64::from(pair[1][i] - pair[0][i]) / scale[i]);
        let length = d[0].hypot(d[1]);
        if length == 0.0 {
            continue;
        }
        let u = d.map(|d| d / length);
        let v = feed.min(limit(config.max_rate, u));
        let entry = legs.last().map_or(0.0, |last| {
            corner_v2(config, last.u, u).min(v * v).min(last.v * last.v)
        });
        legs.push(Leg {
            length,
            a: limit(config.acceleration, u),
            v,
            u,
            entry,
        });
    }
    legs
}

/// The squared speed, mm²/s², at which each leg between `points` may begin at the fastest.
pub(crate) fn corners(config: &Config<2>, points: &[[i32; 2]]) -> Vec<f64> {
    legs(config, points, f64::INFINITY)
        .iter()
        .map(|leg| leg.entry)
        .collect()
}

/// The shortest time (s) for a polyline in steps from rest to rest with infinite look-ahead,
/// computed directly in `f64`.
pub(crate) fn job_time(config: &Config<2>, points: &[[i32; 2]], feed: f64) -> f64 {
    let mut legs = legs(config, points, feed);
    let mut exit = 0.0;
    for leg in legs.iter_mut().rev() {
        leg.entry = leg.entry.min(exit + 2.0 * leg.a * leg.length);
        exit = leg.entry;
    }
    let (mut e0, mut time) = (0.0f64, 0.0);
    for i in 0..legs.len() {
        let leg = &legs[i];
        let e1 = legs
            .get(i + 1)
            .map_or(0.0, |next| next.entry)
            .min(e0 + 2.0 * leg.a * leg.length);
        let peak2 = (0.5 * (2.0 * leg.a * leg.length + e0 + e1)).min(leg.v * leg.v);
        let peak = peak2.sqrt();
        let cruise = leg.length - (2.0 * peak2 - e0 - e1) / (2.0 * leg.a);
        time += (2.0 * peak - e0.sqrt() - e1.sqrt()) / leg.a + cruise.max(0.0) / peak;
        e0 = e1;
    }
    time
}
