//! Outlines of pixels and bitmap traces: paths of pieces about as short as `$11`, with a corner at
//! each.
//!
//! The promise to whoever sets `$120` and `$11`: between corners no axis accelerates by more than
//! `$12x`, and at a corner its speed jumps by no more than junction deviation allows. The tests
//! check both with the step edges alone: the second difference of an axis's place over the time `h`
//! to both sides is at most
//!
//! ```text
//! a·h² + Σ jump·(h − |t − t_corner|) + 4 steps
//! ```

use leadscrew_sim::StepEvent;
use leadscrew_tests::{run_program, Run};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use std::f64::consts::TAU;
use std::fmt::Write;

/// CPU cycles in a second.
const HZ: f64 = 168e6;

/// Steps/mm: so many that whole steps hide little.
const SCALE: f64 = 800.0;

type Point = [f64; 2];

/// A path, and the machine's settings for it.
#[derive(Clone, Debug)]
struct Outline {
    points: Vec<Point>,
    /// The acceleration of the axes, mm/s².
    acceleration: f64,
    /// The junction deviation `$11`, mm.
    deviation: f64,
    /// The feed, mm/min.
    feed: f64,
    /// Decimals of the program's numbers.
    decimals: usize,
}

impl Outline {
    fn run(&self, deviation: f64) -> Run<3> {
        let mut settings = String::from("$0=3\n$707=0\n");
        writeln!(settings, "$11={deviation}").unwrap();
        for axis in 0..2 {
            writeln!(settings, "$10{axis}={SCALE}\n$11{axis}=6000").unwrap();
            writeln!(settings, "$12{axis}={}", self.acceleration).unwrap();
        }
        let mut program = format!("G90G1F{}\n", self.feed);
        for [x, y] in &self.points {
            writeln!(program, "X{x:.*}Y{y:.*}", self.decimals, self.decimals).unwrap();
        }
        run_program(&settings, &program)
    }

    /// The places in whole steps, beginning with the origin.
    fn places(&self) -> Vec<[i64; 2]> {
        let steps = |at: &f64| {
            let written: f64 = format!("{at:.*}", self.decimals).parse().unwrap();
            (written * SCALE).round() as i64
        };
        let places = self
            .points
            .iter()
            .map(|point| [0, 1].map(|axis| steps(&point[axis])));
        std::iter::once([0, 0]).chain(places).collect()
    }

    /// The most speed at a corner, mm/s, by the formula of S. K. Jeon's article on junction
    /// deviation; each axis bounds the acceleration across the corner.
    fn corner_speed(&self, from: Point, to: Point) -> f64 {
        let cos = -(from[0] * to[0] + from[1] * to[1]);
        let turn = [to[0] - from[0], to[1] - from[1]];
        let length = turn[0].hypot(turn[1]);
        if length < 1e-3 {
            return f64::INFINITY;
        }
        let across = turn
            .iter()
            .fold(0.0f64, |most, x| most.max(x.abs() / length));
        let sine = ((1.0 - cos) / 2.0).max(0.0).sqrt();
        (self.acceleration / across * self.deviation * sine / (1.0 - sine).max(1e-12)).sqrt()
    }

    /// The largest second difference of an axis's place, as a share of the allowed one.
    fn bend(&self, steps: &[StepEvent], axis: usize) -> f64 {
        let edges = Edges::new(steps, axis);
        let corners = self.corners(steps, axis);
        let (begin, end) = (seconds(&steps[0]), seconds(&steps[steps.len() - 1]));
        let mut most = 0.0f64;
        for h in [0.005, 0.01, 0.02, 0.05] {
            let mut t = begin - h;
            while t < end + h {
                let bend = edges.before(t - h) - 2 * edges.before(t) + edges.before(t + h);
                let near = |at: f64| corners.partition_point(|(time, _)| *time < at);
                let jumps = &corners[near(t - h)..near(t + h)];
                let jump: f64 = jumps
                    .iter()
                    .map(|(time, jump)| jump * (h - (t - time).abs()))
                    .sum();
                let allowed = self.acceleration * SCALE * h * h + jump + 4.0;
                most = most.max(bend.abs() as f64 / allowed);
                t += h / 8.0;
            }
        }
        most
    }

    /// Returns when each corner was passed, and by how much the axis's speed may jump there,
    /// steps/s.
    fn corners(&self, steps: &[StepEvent], axis: usize) -> Vec<(f64, f64)> {
        let places = self.places();
        let moves: Vec<Point> = places
            .windows(2)
            .map(|ends| [0, 1].map(|axis| (ends[1][axis] - ends[0][axis]) as f64))
            .filter(|way| *way != [0.0; 2])
            .collect();
        let both = [Edges::new(steps, 0), Edges::new(steps, 1)];
        let mut made = [0usize; 2];
        let mut corners = Vec::new();
        for pair in moves.windows(2) {
            let unit = |way: Point| way.map(|x| x / way[0].hypot(way[1]));
            let (from, to) = (unit(pair[0]), unit(pair[1]));
            let mut time = 0.0f64;
            for other in 0..2 {
                made[other] += pair[0][other].abs() as usize;
                if made[other] > 0 {
                    time = time.max(both[other].0[made[other] - 1].0);
                }
            }
            let speed = self.corner_speed(from, to).min(self.feed / 60.0);
            corners.push((time, speed * (to[axis] - from[axis]).abs() * SCALE));
        }
        corners
    }
}

fn seconds(event: &StepEvent) -> f64 {
    event.cycle.0 as f64 / HZ
}

/// Each step of an axis: its time, s, and the axis's place after it, steps.
struct Edges(Vec<(f64, i64)>);

impl Edges {
    fn new(steps: &[StepEvent], axis: usize) -> Self {
        let mut place = 0;
        let own = steps.iter().filter(|event| event.motors.contains(axis));
        Self(
            own.map(|event| {
                place += if event.negative.contains(axis) { -1 } else { 1 };
                (seconds(event), place)
            })
            .collect(),
        )
    }

    /// The axis's place at a time, steps.
    fn before(&self, time: f64) -> i64 {
        let count = self.0.partition_point(|(at, _)| *at <= time);
        count.checked_sub(1).map_or(0, |last| self.0[last].1)
    }
}

/// Staircases, walks to the eight neighbours of a pixel, and pieces in any forward direction.
fn outline() -> impl Strategy<Value = Outline> {
    let turns = prop::collection::vec(any::<u8>(), 100..160);
    let machine = (
        prop::sample::select(&[0.01, 0.02, 0.05, 0.1, 0.2][..]),
        prop::sample::select(&[50.0, 200.0, 500.0, 1500.0][..]),
        prop::sample::select(&[600.0, 1500.0, 3000.0, 6000.0][..]),
    );
    let piece = prop::sample::select(&[0.5, 1.0, 1.5, 2.0, 3.0][..]);
    (turns, machine, piece, 0u8..4).prop_map(
        |(turns, (deviation, acceleration, feed), share, kind)| {
            let piece = share * deviation;
            let (mut at, mut heading) = ([0.0, 0.0], 0i32);
            let points = turns.into_iter().enumerate().map(|(number, turn)| {
                let angle = match kind {
                    0 => f64::from(number as u32 % 2) * 90.0,
                    1 => f64::from(turn % 2) * 90.0,
                    2 => {
                        heading = (heading + i32::from(turn % 3) - 1).clamp(-1, 2);
                        f64::from(heading) * 45.0
                    }
                    _ => f64::from(turn) / 255.0 * 100.0 - 50.0,
                };
                let diagonal = if kind == 2 && heading % 2 != 0 {
                    2f64.sqrt()
                } else {
                    1.0
                };
                at[0] += piece * diagonal * angle.to_radians().cos();
                at[1] += piece * diagonal * angle.to_radians().sin();
                at
            });
            Outline {
                points: points.collect(),
                acceleration,
                deviation,
                feed,
                decimals: 4,
            }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases / 4))]

    #[test]
    fn corners_of_short_pieces_keep_the_acceleration_and_the_jumps_that_deviation_allows(
        of in outline(), decimals in 2usize..5,
    ) {
        let of = Outline { decimals, ..of };
        let run = of.run(of.deviation);
        for axis in 0..2 {
            let bend = of.bend(&run.steps, axis);
            prop_assert!(bend <= 1.0, "axis {}: {} times what is allowed", axis, bend);
        }
    }
}

/// Returns how much longer an outline takes with some `$11` than with a lower one, at most: 1 if it
/// never takes longer.
fn growth(of: &Outline) -> f64 {
    let (mut fastest, mut growth) = (f64::INFINITY, 1f64);
    for deviation in [0.001, 0.005, 0.02, 0.1, 0.5] {
        let time = of.run(deviation).outcome.motion_seconds;
        growth = growth.max(time / fastest);
        fastest = fastest.min(time);
    }
    growth
}

/// No outline may take 0.5 % longer with a greater `$11`. The outlines are the same in each run;
/// `CAMPAIGN=10000` tries 10 000 outlines. Two of them take longer (docs/benchmarks.md, section
/// "Motion", tells the cause).
#[test]
fn a_greater_deviation_makes_no_outline_slower() {
    let cases = std::env::var("CAMPAIGN").map_or(60, |cases| cases.parse().unwrap());
    let mut runner = TestRunner::deterministic();
    for number in 0..cases {
        let of = outline().new_tree(&mut runner).unwrap().current();
        let growth = growth(&of);
        assert!(growth <= 1.005, "outline {number}: {growth} times as long");
    }
}

/// The checks must find a machine whose `$11` is four times the promised one.
#[test]
fn corners_that_are_taken_twice_as_fast_are_seen_on_the_step_edges() {
    let points = (0..200).map(|k| [f64::from((k + 2) / 2) * 0.05, f64::from((k + 1) / 2) * 0.05]);
    let stairs = Outline {
        points: points.collect(),
        acceleration: 200.0,
        deviation: 0.02,
        feed: 6000.0,
        decimals: 4,
    };
    let bend = |deviation| {
        let run = stairs.run(deviation);
        (0..2).fold(0.0f64, |most, axis| most.max(stairs.bend(&run.steps, axis)))
    };
    assert!(bend(0.02) <= 1.0);
    assert!(bend(0.08) > 1.2, "{}", bend(0.08));
}

/// A circle in lines of 0.1 mm, whose acceleration bounds the speed.
fn circle(radius: f64, decimals: usize) -> Outline {
    let lines = (TAU * radius / 0.1).round();
    let angles = (0..=2 * lines as i32).map(|line| f64::from(line) / lines * TAU);
    Outline {
        points: angles
            .map(|angle| [radius * angle.cos(), radius * angle.sin()])
            .collect(),
        acceleration: 500.0,
        deviation: 0.01,
        feed: 6000.0,
        decimals,
    }
}

/// Two decimals move a point by up to 0.005 mm. The small turns that this makes are no corners: the
/// circle takes no longer than with four decimals. It keeps the acceleration, apart from these moves
/// of points.
#[test]
fn a_circle_with_two_decimals_is_as_fast_as_one_with_four() {
    for radius in [2.0, 5.0, 20.0] {
        let (rough, fine) = (circle(radius, 2), circle(radius, 4));
        let [slow, fast] = [&rough, &fine].map(|of| of.run(0.01).outcome.motion_seconds);
        assert!(slow <= 1.03 * fast, "R {radius}: {slow} s, {fast} s");
        let steps = rough.run(0.01).steps;
        for axis in 0..2 {
            let edges = Edges::new(&steps, axis);
            for h in [0.02, 0.05] {
                let rounded = 4.0 + 4.0 * 0.005 * SCALE;
                let allowed = rough.acceleration * SCALE * h * h + rounded;
                let mut t = seconds(&steps[0]);
                while t < seconds(&steps[steps.len() - 1]) {
                    let bend = edges.before(t - h) - 2 * edges.before(t) + edges.before(t + h);
                    assert!(bend.abs() as f64 <= allowed, "R {radius}: {bend} at {t} s");
                    t += h / 8.0;
                }
            }
        }
    }
}
