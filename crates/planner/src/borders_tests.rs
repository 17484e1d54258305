//! If a line continues as a curve in short lines, no axis accelerates more than its setting. The
//! motors are checked: the second difference of the places at the step edges.
//!
//! An axis whose acceleration is `a` at most has `|x(t−h) − 2·x(t) + x(t+h)| ≤ a·h²`. The three
//! places are whole steps, so four steps more are allowed, and four times the rounding of the ends
//! of lines. A curve in lines turns in jumps, `n` of them within `h`. The jumps add the share
//! `1/4n²`: 2 % if there are four of them or more.

use crate::edges_tests::{Edges, WINDOWS};
use crate::limits_tests::Cut;
use crate::reference::{runner, to, Rig, RigQueue};
use crate::{Config, StepsPerMm, NANOS_PER_MM};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;
use std::cell::Cell;
use std::vec::Vec;
use std::{format, println};

/// Length of each of the two lines, mm.
const LINE: f64 = 6.0;

/// The allowed share of the acceleration: 2 % more for the jumps of the curve, 4 % more because the
/// planner takes some of it for rounding.
const MOST: f64 = 1.06;

/// The least number of lines of the curve within half a window.
const LINES: f64 = 4.0;

/// A line, a curve that it touches, and a line that touches the curve's end. Lengths in mm, angles
/// in radians, positive to the left.
#[derive(Clone, Copy, Debug)]
struct Lead {
    heading: f64,
    radius: f64,
    sweep: f64,
    piece: f64,
    steps_per_mm: i64,
    /// The acceleration of the axes, mm/s².
    acceleration: f32,
    deviation: f32,
}

/// Curves whose radius is many steps, at 800 steps/mm.
fn wide() -> impl Strategy<Value = Lead> {
    lead(0.8..8.0, std::vec![0.05, 0.1], 800)
}

/// Curves whose radius is a few steps, at 80 steps/mm: the planner joins their lines.
fn narrow() -> impl Strategy<Value = Lead> {
    lead(0.15..0.6, std::vec![0.02, 0.05], 80)
}

fn lead(
    radius: core::ops::Range<f64>,
    pieces: Vec<f64>,
    steps_per_mm: i64,
) -> impl Strategy<Value = Lead> {
    let angles = (0.0..core::f64::consts::TAU, 0.3f64..3.0, any::<bool>());
    let pieces = prop::sample::select(pieces);
    let acceleration = prop::sample::select(std::vec![50.0, 200.0, 500.0, 1500.0]);
    let deviation = prop::sample::select(std::vec![0.002, 0.01, 0.05]);
    (angles, radius, pieces, acceleration, deviation).prop_map(
        move |((heading, sweep, left), radius, piece, acceleration, deviation)| Lead {
            heading,
            radius,
            sweep: if left { sweep } else { -sweep },
            piece,
            steps_per_mm,
            acceleration,
            deviation,
        },
    )
}

impl Lead {
    /// The ends of the lines, rounded to three decimals.
    fn moves(&self) -> Vec<Cut> {
        let along = |angle: f64| [angle.cos(), angle.sin()];
        let add = |at: [f64; 2], way: [f64; 2], by: f64| [at[0] + way[0] * by, at[1] + way[1] * by];
        let first = add([0.0; 2], along(self.heading), LINE);
        let side = core::f64::consts::FRAC_PI_2.copysign(self.sweep);
        let centre = add(first, along(self.heading + side), self.radius);
        let count = (self.sweep.abs() * self.radius / self.piece).ceil() as u32;
        let mut ends = Vec::from([first]);
        ends.extend((1..=count).map(|k| {
            let heading = self.heading + self.sweep * f64::from(k) / f64::from(count);
            add(centre, along(heading - side), self.radius)
        }));
        let last = add(ends[ends.len() - 1], along(self.heading + self.sweep), LINE);
        ends.push(last);
        let rounded = ends
            .into_iter()
            .map(|end| end.map(|x| (x * 1e3).round() / 1e3));
        rounded.map(|[x, y]| Cut::line(to(x, y, 200.0))).collect()
    }

    fn config(&self) -> Config<2> {
        Config {
            max_rate: [200.0; 2],
            acceleration: [self.acceleration; 2],
            steps_per_mm: [StepsPerMm::from_nanos(self.steps_per_mm * NANOS_PER_MM); 2],
            junction_deviation: self.deviation,
            ..Config::default()
        }
    }

    /// The largest second difference less the rounding, as a share of `a·h²`.
    fn worst(&self) -> f64 {
        let edges = Edges::of(&self.moves(), self.config());
        let scale = self.steps_per_mm as f64;
        let rounded = 4.0 + 4.0 * 0.0005 * scale;
        let acceleration = f64::from(self.acceleration);
        let speed = (acceleration * self.radius).sqrt();
        let mut worst = 0.0f64;
        for h in WINDOWS.map(|ms| ms / 1000.0) {
            let allowed = acceleration * h * h * scale;
            if h * speed < LINES * self.piece || allowed < 40.0 {
                continue;
            }
            let end = edges.corners[edges.corners.len() - 1];
            let count = ((end - 2.0 * h) * 1000.0).max(0.0) as usize;
            for t in (0..count).map(|ms| h + ms as f64 / 1000.0) {
                for axis in 0..2 {
                    let x = |time| edges.at(axis, time);
                    let difference = (x(t - h) - 2.0 * x(t) + x(t + h)).abs() - rounded;
                    worst = worst.max(difference / allowed);
                }
            }
        }
        worst
    }
}

fn campaign(leads: impl Strategy<Value = Lead>) {
    let worst = Cell::new(0.0f64);
    let result = runner(100).run(&leads, |lead| {
        let share = lead.worst();
        worst.set(worst.get().max(share));
        if share > MOST {
            return Err(TestCaseError::fail(format!("{share} of the acceleration")));
        }
        Ok(())
    });
    println!(
        "where lines become curves: at most {} of the acceleration",
        worst.get()
    );
    result.unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn a_line_that_becomes_a_curve_keeps_the_acceleration() {
    campaign(wide());
}

#[test]
fn a_curve_of_a_few_steps_keeps_the_acceleration() {
    campaign(narrow());
}

/// A line, half a circle and a line, against a time that nothing can be shorter than: both lines
/// with all of the acceleration along them, and the half circle at the highest speed that its axes
/// allow anywhere.
#[test]
fn lines_beside_a_curve_take_no_longer_than_lines() {
    for heading in [0.3, 0.6, core::f64::consts::FRAC_PI_4, 1.2] {
        let lead = Lead {
            heading,
            radius: 1.0,
            sweep: core::f64::consts::PI,
            piece: 0.1,
            steps_per_mm: 250,
            acceleration: 500.0,
            deviation: 0.01,
        };
        let a = f64::from(lead.acceleration);
        let along = a / heading.cos().max(heading.sin());
        let fastest = (a * lead.radius * core::f64::consts::SQRT_2).sqrt();
        let peak = (along * LINE + 0.5 * fastest * fastest).sqrt();
        let line = (2.0 * peak - fastest) / along;
        let shortest = 2.0 * line + core::f64::consts::PI * lead.radius / fastest;
        let moves: Vec<_> = lead.moves().into_iter().map(|cut| cut.of).collect();
        let seconds = Rig::new(lead.config(), &mut RigQueue::new()).run(&moves);
        assert!(
            seconds < 1.08 * shortest,
            "at {heading}: {seconds} s, {shortest} s"
        );
    }
}

/// A curve of a few steps' radius between two lines. With the greater `$11` an end of one of its
/// moves leaves no acceleration to brake with, so the move has to end a little slower. An earlier
/// planner braked this move to a twentieth of the speed.
#[test]
fn a_greater_deviation_makes_a_narrow_curve_no_slower() {
    const ENDS: [[f64; 2]; 9] = [
        [-6.413, 5.314],
        [-6.443, 5.354],
        [-6.453, 5.403],
        [-6.441, 5.452],
        [-6.408, 5.49],
        [-6.362, 5.51],
        [-6.312, 5.507],
        [-6.268, 5.483],
        [-1.619, 1.369],
    ];
    let moves = ENDS.map(|[x, y]| to(x, y, 133.0));
    let [small, great] = [0.02, 0.05].map(|junction_deviation| {
        let config = Config {
            max_rate: [2000.0 / 60.0; 2],
            acceleration: [200.0; 2],
            steps_per_mm: [StepsPerMm::from_nanos(40 * NANOS_PER_MM); 2],
            junction_deviation,
            ..Config::default()
        };
        Rig::new(config, &mut RigQueue::new()).run(&moves)
    });
    assert!(great <= 1.005 * small, "{great} s, {small} s");
}
