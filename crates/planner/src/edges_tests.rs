//! No limit is broken on the motors. Checked by the second difference, over 5 to 50 ms, of the
//! places at the step edges.
//!
//! An axis whose acceleration is `a` at most has `|x(t−h) − 2·x(t) + x(t+h)| ≤ a·h²`. The three
//! places are whole steps, each off the line by half a step at most, so four steps more are
//! allowed. Between two parts of a program there is a corner, at which the speed jumps: windows
//! with a corner in them are left out (`corners_tests` checks corners).

use crate::limits_tests::{program, Cut, Program};
use crate::reference::{runner, Rig, RigQueue};
use crate::{Config, CornerRule};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;
use std::vec::Vec;
use std::{format, println, string::String};

/// Half lengths of windows, ms.
pub(crate) const WINDOWS: [f64; 5] = [5.0, 10.0, 20.0, 35.0, 50.0];

/// Time from one check to the next, ms.
const EVERY: f64 = 3.0;

/// A program that takes longer than this, s, is not checked.
const LONGEST: f64 = 10.0;

/// The time of each step of each axis (s), the place after it, and the time at which each part of
/// the program began.
#[derive(Default)]
pub(crate) struct Edges {
    steps: [Vec<(f64, i32)>; 2],
    pub(crate) corners: Vec<f64>,
    end: f64,
}

impl Edges {
    pub(crate) fn of(moves: &[Cut], settings: Config<2>) -> Self {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(settings, &mut queue);
        let mut firsts = Vec::new();
        for cut in moves {
            let before = rig.planner.len();
            rig.planner.push(&cut.of).expect("room");
            if rig.planner.len() > before {
                firsts.push(cut.is_first);
            }
        }
        let mut edges = Self::default();
        let mut firsts = firsts.into_iter();
        while let Some(segment) = rig.segmenter.next(&mut rig.planner) {
            let seconds = |counts: u64| counts as f64 / f64::from(settings.timer_hz);
            if segment.line.is_some() && firsts.next() == Some(true) {
                edges.corners.push(seconds(rig.player.now));
            }
            let mut position = rig.player.position;
            for timed in rig.player.play(&segment) {
                for (motor, steps) in edges.steps.iter_mut().enumerate() {
                    if timed.tick.step.contains(motor) {
                        position[motor] += if timed.tick.direction.contains(motor) {
                            -1
                        } else {
                            1
                        };
                        steps.push((seconds(timed.at), position[motor]));
                    }
                }
            }
            edges.end = seconds(rig.player.now);
            if edges.end > LONGEST {
                break;
            }
        }
        edges.corners.push(edges.end);
        edges
    }

    /// Returns the place of an axis.
    pub(crate) fn at(&self, axis: usize, time: f64) -> f64 {
        let steps = &self.steps[axis];
        let after = steps.partition_point(|(at, _)| *at <= time);
        after
            .checked_sub(1)
            .map_or(0.0, |last| f64::from(steps[last].1))
    }

    /// The largest second difference less four steps, as a share of `a·h²`.
    fn worst(&self, program: &Program) -> f64 {
        let limits = program.config();
        let mut worst = 0.0f64;
        for window in WINDOWS {
            let h = window / 1000.0;
            let count = ((self.end - 2.0 * h) * 1000.0 / EVERY).max(0.0) as usize;
            for t in (0..count).map(|k| h + k as f64 * EVERY / 1000.0) {
                let corner = self.corners.partition_point(|corner| *corner < t - h);
                if self
                    .corners
                    .get(corner)
                    .is_some_and(|corner| *corner <= t + h)
                {
                    continue;
                }
                for axis in 0..2 {
                    let x = |time| self.at(axis, time);
                    let difference = (x(t - h) - 2.0 * x(t) + x(t + h)).abs() - 4.0;
                    let steps_per_mm = limits.steps_per_mm[axis].nanos() as f64 / 1e9;
                    let allowed = f64::from(limits.acceleration[axis]) * h * h * steps_per_mm;
                    worst = worst.max(difference / allowed);
                }
            }
        }
        worst
    }
}

/// The time of each step of each axis (s), and the place after it.
pub(crate) struct Steps<const MOTORS: usize> {
    steps: [Vec<(f64, i32)>; MOTORS],
    end: f64,
}

impl Steps<2> {
    /// Plays all that is queued.
    pub(crate) fn of(rig: &mut Rig<'_>) -> Self {
        let hz = f64::from(rig.planner.config().timer_hz);
        let mut steps = [Vec::new(), Vec::new()];
        while let Some(segment) = rig.segmenter.next(&mut rig.planner) {
            let mut position = rig.player.position;
            for timed in rig.player.play(&segment) {
                for (motor, steps) in steps.iter_mut().enumerate() {
                    if timed.tick.step.contains(motor) {
                        let back = timed.tick.direction.contains(motor);
                        position[motor] += if back { -1 } else { 1 };
                        steps.push((timed.at as f64 / hz, position[motor]));
                    }
                }
            }
        }
        let end = rig.player.now as f64 / hz;
        Self { steps, end }
    }
}

impl<const MOTORS: usize> Steps<MOTORS> {
    fn at(&self, axis: usize, time: f64) -> f64 {
        let steps = &self.steps[axis];
        let after = steps.partition_point(|(at, _)| *at <= time);
        let last = after.checked_sub(1);
        last.map_or(0.0, |last| f64::from(steps[last].1))
    }
}

/// Windows of an axis: half their length, s, and the second difference less four steps. The program
/// has no corner.
pub(crate) fn second_differences<const MOTORS: usize>(
    steps: &Steps<MOTORS>,
    axis: usize,
) -> impl Iterator<Item = (f64, f64)> + '_ {
    WINDOWS.into_iter().flat_map(move |window| {
        let h = window / 1000.0;
        let count = ((steps.end - 2.0 * h) * 1000.0 / EVERY).max(0.0) as usize;
        (0..count).map(move |k| {
            let t = h + k as f64 * EVERY / 1000.0;
            let x = |time| steps.at(axis, time);
            (h, (x(t - h) - 2.0 * x(t) + x(t + h)).abs() - 4.0)
        })
    })
}

fn campaign(cases: u32, plant: impl Fn(&mut Config<2>)) -> Result<f64, String> {
    let worst = core::cell::Cell::new(0.0f64);
    let result = runner(cases).run(&program(), |program| {
        // With steps finer than 0.0025 mm, four of them are less than a chord strays from its arc.
        prop_assume!(program.steps_per_mm.iter().all(|steps| *steps <= 400));
        let mut settings = Config {
            corner_rule: CornerRule::Limits,
            ..program.config()
        };
        plant(&mut settings);
        let share = Edges::of(&program.moves(), settings).worst(&program);
        worst.set(worst.get().max(share));
        if share > 1.0 {
            return Err(TestCaseError::fail(format!("{share} of the acceleration")));
        }
        Ok(())
    });
    result
        .map(|()| worst.get())
        .map_err(|error| format!("{error}"))
}

#[test]
fn no_axis_accelerates_more_than_its_setting_says() {
    let worst = campaign(150, |_| ()).unwrap_or_else(|error| panic!("{error}"));
    println!("second differences: at most {worst} of the acceleration");
}

#[test]
fn two_per_cent_more_acceleration_is_seen_on_the_step_edges() {
    for axis in 0..2 {
        let plant = |config: &mut Config<2>| config.acceleration[axis] *= 1.02;
        assert!(campaign(300, plant).is_err(), "axis {axis}");
    }
}
