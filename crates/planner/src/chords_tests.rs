//! The limits on the step edges of arcs whose chords are coarser than `$11`.
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
        }
    }

    /// The largest second difference as a share of what acceleration and `jump` (mm/s) allow.
    fn worst(&self, jump: f64) -> f64 {
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
                let allowed = (acceleration * h * h + jump * h) * scale;
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

fn acceleration() -> impl Strategy<Value = f32> {
    logarithmic(50.0, 2000.0).prop_map(|a| a as f32)
}

/// Chords with a sagitta of `$12` above `$11`.
fn coarse_chords() -> impl Strategy<Value = Job> {
    let deviation = logarithmic(0.0005, 0.01);
    let tolerance = logarithmic(1.0, 50.0);
    (
        circle(),
        acceleration(),
        deviation,
        tolerance,
        20.0f32..200.0,
    )
        .prop_map(|(path, acceleration, deviation, ratio, feed)| Job {
            path,
            steps_per_mm: [1000; 2],
            acceleration: [acceleration; 2],
            feed,
            deviation: deviation as f32,
            tolerance: (deviation * ratio).min(0.1) as f32,
        })
}

/// The jump of the speed that `$11` allows at a corner, and a tenth for its measure, mm/s.
fn jump(job: &Job) -> f64 {
    let acceleration = f64::from(job.acceleration[0]);
    1.1 * (8.0 * acceleration * f64::from(job.deviation)).sqrt()
}

#[test]
fn the_corners_of_chords_keep_the_smaller_of_both_deviations() {
    let reported = Job {
        path: Path::Circle {
            radius: 4.5,
            from: 0.0,
            turn: 6.0,
        },
        steps_per_mm: [1000; 2],
        acceleration: [500.0; 2],
        feed: 100.0,
        deviation: 0.001,
        tolerance: 0.05,
    };
    let share = reported.worst(jump(&reported));
    assert!(share <= 1.0, "{share}");
    let config = ProptestConfig {
        failure_persistence: None,
        ..crate::reference::times(60)
    };
    let worst = Cell::new(0.0f64);
    proptest!(config, |(job in coarse_chords())| {
        let share = job.worst(jump(&job));
        worst.set(worst.get().max(share));
        prop_assert!(share <= 1.0, "{}", share);
    });
    println!("chords: at most {} of what is allowed", worst.get());
}
