//! No corner is passed faster than junction deviation allows. The motors are checked: the second
//! difference of the places around the corner.
//!
//! At a corner from the direction `u0` to `u1`, passed at the speed `v`, an axis's speed jumps by
//! `v·|u1 − u0|`. Before the corner the axis brakes by at most `a0·|u0|`, after it the axis speeds
//! up by at most `a1·|u1|`; `a0` and `a1` are the accelerations that the axes allow along each
//! line. So over `h` to both sides
//!
//! ```text
//!   |x(t−h) − 2·x(t) + x(t+h)| ≤ v·|u1 − u0|·h + (a0·|u0| + a1·|u1|)·h²/2 + 4 steps
//! ```
//!
//! for the largest `v` that `$11` allows.

use crate::edges_tests::{Edges, WINDOWS};
use crate::limits_tests::{corner_v2, Cut, Leg};
use crate::reference::{runner, to};
use crate::{Config, CornerRule, StepsPerMm, NANOS_PER_MM};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;
use std::vec::Vec;
use std::{format, println, string::String, vec};

#[derive(Clone, Debug)]
struct Program {
    /// Angle (radians) and length (mm) of each line.
    lines: Vec<(f64, f64)>,
    feed: f32,
    config: Config<2>,
}

fn program() -> impl Strategy<Value = Program> {
    let lines = prop::collection::vec((0.0f64..core::f64::consts::TAU, 5.0f64..40.0), 2..6);
    let limits = (
        prop::array::uniform2(50.0f32..300.0),
        prop::array::uniform2(100.0f32..5000.0),
    );
    let scale = prop::array::uniform2(400i64..4000);
    let rule = prop::sample::select(vec![CornerRule::Limits, CornerRule::Grbl]);
    (lines, 20.0f32..300.0, limits, scale, 0.01f32..1.0, rule).prop_map(
        |(lines, feed, (max_rate, acceleration), scale, junction_deviation, corner_rule)| Program {
            lines,
            feed,
            config: Config {
                max_rate,
                acceleration,
                steps_per_mm: scale.map(|steps| StepsPerMm::from_nanos(steps * NANOS_PER_MM)),
                junction_deviation,
                corner_rule,
                ..Config::default()
            },
        },
    )
}

impl Program {
    fn moves(&self) -> Vec<Cut> {
        let mut at = [0.0, 0.0];
        let moves = self.lines.iter().map(|(angle, length)| {
            at = [at[0] + length * angle.cos(), at[1] + length * angle.sin()];
            Cut::line(to(at[0], at[1], self.feed))
        });
        moves.collect()
    }

    fn scale(&self) -> [i64; 2] {
        self.config
            .steps_per_mm
            .map(|scale| scale.nanos() as i64 / NANOS_PER_MM)
    }

    fn legs(&self, moves: &[Cut]) -> Vec<Leg> {
        let scale = self.scale();
        let steps = |cut: &Cut| {
            [0, 1].map(|axis| {
                self.config.steps_per_mm[axis]
                    .steps(cut.of.target[axis])
                    .unwrap()
            })
        };
        let mut at = [0; 2];
        let legs = moves.iter().map(|cut| {
            let before = core::mem::replace(&mut at, steps(cut));
            Leg::new(cut, [0, 1].map(|axis| at[axis] - before[axis]), scale)
        });
        legs.collect()
    }

    /// The acceleration that the axes allow along `u`, mm/s².
    fn acceleration(&self, u: [f64; 2]) -> f64 {
        let along = |axis: usize| f64::from(self.config.acceleration[axis]) / u[axis].abs();
        along(0).min(along(1))
    }

    /// The largest second difference about a corner, less four steps, as a share of the allowed
    /// one.
    fn worst(&self, settings: Config<2>) -> f64 {
        let moves = self.moves();
        let legs = self.legs(&moves);
        let edges = Edges::of(&moves, settings);
        let mut worst = 0.0f64;
        for (pair, times) in legs.windows(2).zip(edges.corners.windows(3)) {
            let ([before, after], [from, t, until]) = (pair, times) else {
                unreachable!("windows of two and of three");
            };
            let corner = corner_v2(before, after, &self.config);
            if corner == f64::INFINITY
                || !(before.stands_alone(&self.config) && after.stands_alone(&self.config))
            {
                continue;
            }
            let [a0, a1] = [before, after].map(|leg| self.acceleration(leg.u));
            for h in WINDOWS
                .map(|ms| ms / 1000.0)
                .into_iter()
                .filter(|h| t - h >= *from && t + h <= *until)
            {
                for axis in 0..2 {
                    let x = |time| edges.at(axis, time);
                    let difference = (x(t - h) - 2.0 * x(*t) + x(t + h)).abs() - 4.0;
                    let jump = corner.sqrt() * (after.u[axis] - before.u[axis]).abs();
                    let ramps = a0 * before.u[axis].abs() + a1 * after.u[axis].abs();
                    let allowed = jump * h + ramps * h * h / 2.0;
                    worst = worst.max(difference / (allowed * self.scale()[axis] as f64));
                }
            }
        }
        worst
    }
}

fn campaign(cases: u32, plant: impl Fn(&mut Config<2>)) -> Result<f64, String> {
    let worst = core::cell::Cell::new(0.0f64);
    let result = runner(cases).run(&program(), |program| {
        let mut settings = program.config;
        plant(&mut settings);
        let share = program.worst(settings);
        worst.set(worst.get().max(share));
        if share > 1.0 {
            return Err(TestCaseError::fail(format!("{share} of what $11 allows")));
        }
        Ok(())
    });
    result
        .map(|()| worst.get())
        .map_err(|error| format!("{error}"))
}

#[test]
fn no_corner_is_passed_faster_than_junction_deviation_allows() {
    let worst = campaign(150, |_| ()).unwrap_or_else(|error| panic!("{error}"));
    println!("second differences about corners: at most {worst} of what $11 allows");
    assert!(worst > 0.95, "corners are made use of: {worst}");
}

#[test]
fn two_per_cent_more_junction_deviation_is_seen_on_the_step_edges() {
    let plant = |config: &mut Config<2>| config.junction_deviation *= 1.02;
    assert!(campaign(150, plant).is_err());
}

/// A curve through the corners of a polygon is `l·θ/8` from the middle of its sides. If that is
/// more than `$11`, the polygon has corners; if it is a tenth of that, it is a curve.
#[test]
fn a_polygon_has_corners_where_a_curve_would_leave_its_sides() {
    for (length, deviation, has_corners) in
        [(5.0, 0.01, true), (10.0, 0.05, true), (5.0, 1.0, false)]
    {
        let program = Program {
            lines: (0..8).map(|k| (0.15 * f64::from(k), length)).collect(),
            feed: 300.0,
            config: Config {
                max_rate: [300.0; 2],
                acceleration: [500.0; 2],
                steps_per_mm: [StepsPerMm::from_nanos(800 * NANOS_PER_MM); 2],
                junction_deviation: deviation,
                ..Config::default()
            },
        };
        let share = program.worst(program.config);
        assert!(share <= 1.0, "{length} mm, {deviation}: {share}");
        assert_eq!(
            share > 0.95,
            has_corners,
            "{length} mm, {deviation}: {share}"
        );
    }
}
