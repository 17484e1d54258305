//! The limits on the step edges of an axis with a thousand steps/mm beside one with a few.
//!
//! The measure is that of `edges_tests`: second differences of the places at the step edges.

use crate::edges_tests::{second_differences, Steps};
use crate::reference::{to, Rig, RigQueue};
use crate::{Arc, Config, Coordinate, Move, StepsPerMm, NANOS_PER_MM};
use proptest::prelude::*;
use std::cell::Cell;
use std::println;
use std::vec::Vec;

/// A path, mm: from one point to the next.
#[derive(Clone, Copy, Debug)]
enum Path {
    /// A circle as the machine cuts it.
    Circle { radius: f64, from: f64, turn: f64 },
    /// A wave in pieces of one length: its direction, its length, and how far it sways.
    Wave {
        angle: f64,
        period: f64,
        sway: f64,
        piece: f64,
    },
}

#[derive(Clone, Copy, Debug)]
struct Job {
    path: Path,
    steps_per_mm: [i64; 2],
    acceleration: [f32; 2],
    feed: f32,
    deviation: f32,
    tolerance: f32,
}

/// The most of 20 000 curves: 1.047. Two axes with a thousand steps/mm each reach 1.048: the points
/// are rounded, and so is the curvature that follows from them. Directions from rounded steps reach
/// 5.
const MEASURE: f64 = 1.05;

/// The greatest distance of chords from their curves, mm.
const STRAYS: f64 = 0.0005;

/// The distance by which points are rounded, mm. Four times both is in a second difference without
/// acceleration: two axes with 1200 steps/mm each need as much.
const ROUNDED: f64 = 0.0005;

/// The least radius of a wave, mm.
fn radius(period: f64, sway: f64) -> f64 {
    let turn = core::f64::consts::TAU / period;
    1.0 / (sway * turn * turn)
}

fn point(x: f64, y: f64) -> [Coordinate; 2] {
    [x, y].map(|mm| Coordinate::from_nanos((mm * 1e6).round() as i64 * 1000))
}

impl Job {
    fn config(&self) -> Config<2> {
        Config {
            steps_per_mm: self
                .steps_per_mm
                .map(|steps| StepsPerMm::from_nanos(steps * NANOS_PER_MM)),
            max_rate: [300.0; 2],
            acceleration: self.acceleration,
            junction_deviation: self.deviation,
            arc_tolerance: self.tolerance,
            ..Config::default()
        }
    }

    fn moves(&self) -> Vec<Move<2>> {
        let line = to(0.0, 0.0, self.feed);
        match self.path {
            Path::Circle { radius, from, turn } => {
                let centre = [-radius * from.cos(), -radius * from.sin()];
                let end = from + turn;
                let end = point(
                    centre[0] + radius * end.cos(),
                    centre[1] + radius * end.sin(),
                );
                let offset = point(centre[0], centre[1]);
                let (start, clockwise) = ([Coordinate::ZERO; 2], turn < 0.0);
                let arc = Arc::new(start, end, offset, (0, 1), clockwise, self.tolerance);
                let arc = arc.expect("an arc");
                let curve = arc.curve(self.acceleration[0].min(self.acceleration[1]));
                let chord = |target| Move {
                    target,
                    curve,
                    ..line
                };
                arc.map(chord).collect()
            }
            Path::Wave {
                angle,
                period,
                sway,
                piece,
            } => {
                let count = (60.0 / piece).min(900.0) as u32;
                let at = |k: u32| {
                    let (x, turn) = (f64::from(k) * piece, core::f64::consts::TAU / period);
                    let y = sway * ((x * turn).cos() - 1.0);
                    let target = point(
                        x * angle.cos() - y * angle.sin(),
                        x * angle.sin() + y * angle.cos(),
                    );
                    Move { target, ..line }
                };
                (1..=count).map(at).collect()
            }
        }
    }

    /// The largest second difference as a share of what the acceleration allows.
    fn worst(&self) -> f64 {
        let config = self.config();
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(config, &mut queue);
        for next in self.moves() {
            rig.planner.push(&next).expect("room");
        }
        let steps = Steps::of(&mut rig);
        let mut worst = 0.0f64;
        for axis in 0..2 {
            let scale = self.steps_per_mm[axis] as f64;
            let acceleration = f64::from(self.acceleration[axis]);
            for (h, difference) in second_differences(&steps, axis) {
                let allowed = (acceleration * h * h + 4.0 * (STRAYS + ROUNDED)) * scale;
                worst = worst.max(difference / allowed);
            }
        }
        worst
    }
}

fn logarithmic(from: f64, to: f64) -> impl Strategy<Value = f64> {
    (from.ln()..to.ln()).prop_map(f64::exp)
}

fn circle() -> impl Strategy<Value = Path> {
    let turn = prop_oneof![1.0f64..6.2, -6.2f64..-1.0];
    (logarithmic(1.0, 30.0), 0.0f64..6.2, turn).prop_map(|(radius, from, turn)| Path::Circle {
        radius,
        from,
        turn,
    })
}

fn wave() -> impl Strategy<Value = Path> {
    let parts = (0.0f64..6.2, logarithmic(3.0, 40.0), logarithmic(0.05, 3.0));
    (parts, logarithmic(0.08, 2.0)).prop_map(|((angle, period, sway), piece)| Path::Wave {
        angle,
        period,
        sway: sway.min(0.1 * period),
        piece: piece.min((8.0 * STRAYS * radius(period, sway.min(0.1 * period))).sqrt()),
    })
}

fn acceleration() -> impl Strategy<Value = f32> {
    logarithmic(50.0, 2000.0).prop_map(|a| a as f32)
}

/// An axis of 5 to 10 steps/mm beside one of 800 to 1280.
fn coarse_axis() -> impl Strategy<Value = Job> {
    let scales = (5i64..=10, 800i64..=1280, any::<bool>());
    let path = prop_oneof![circle(), wave()];
    let accelerations = (acceleration(), acceleration());
    (path, scales, accelerations, 20.0f32..150.0).prop_map(
        |(path, (coarse, fine, swap), (one, other), feed)| Job {
            path,
            steps_per_mm: if swap { [fine, coarse] } else { [coarse, fine] },
            acceleration: [one, other],
            feed,
            deviation: 0.01,
            tolerance: STRAYS as f32,
        },
    )
}

#[test]
fn a_coarse_axis_keeps_the_limits_of_a_fine_one() {
    let config = ProptestConfig {
        failure_persistence: None,
        ..crate::reference::times(60)
    };
    let worst = Cell::new(0.0f64);
    proptest!(config, |(job in coarse_axis())| {
        let share = job.worst();
        worst.set(worst.get().max(share));
        prop_assert!(share <= MEASURE, "{}", share);
    });
    println!("a coarse axis: at most {} of the acceleration", worst.get());
}
