//! A step event in parts: each motor steps when it is due.
//!
//! At low speeds one step takes much longer or shorter than the next, out of rest its first quarter takes half of its time,
//! and a hold or an override may change what comes next. Ticks whose interval changes linearly cannot follow that, and a
//! motor that is half a tick early may be so by much of a step's time. But in one step event each motor steps at most once,
//! so there the profile itself is asked when, and the step event is cut there into parts of one tick each:
//!
//! ```text
//!                      Y       Z              X, the dominant motor
//!   |------------------|-------|--------------|
//!     part of Y alone   of Z    of all others      each motor comes on by the whole step event at once
//! ```
//!
//! Ticks cannot be any closer than [`Timing::shortest_tick`]: what is due so soon after a tick comes a little late, or with
//! the next one.

use super::{Running, Timing, LONGEST_WAIT};
use crate::fit::{bits, Carry};
use crate::real::{least, most};
use core::num::NonZeroU16;
use leadscrew_stepper::{MotorMask, Segment, Smoothing};

/// A step event is made in parts where its squared speed is less than so many times the acceleration: the next step may take
/// 0.9 of its time, half a sixteenth early is no more than an eighteenth then.
const SUDDEN: f32 = 4.0;

/// Ticks that there must be room for in a step event that is made in parts: a motor that comes with the next tick is off by a
/// sixteenth of the step at most.
const ROOM: f32 = 16.0;

/// A step event that is being handed out in parts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parts<const MOTORS: usize> {
    /// When each motor is due, seconds from its start; `seconds` or more where that is not before its end.
    due: [f32; MOTORS],
    /// The motors that have come on by it.
    made: MotorMask,
    /// Speeds at its start and end, steps/s.
    pub(super) entry: f32,
    exit: f32,
    /// Time that all of it takes, and that of the parts handed out, seconds.
    seconds: f32,
    pub(super) elapsed: f32,
    /// What motors are to be early for at its end, as [`Running::early`].
    early: Option<Smoothing>,
}

impl<const MOTORS: usize> Running<MOTORS> {
    /// Whether a part comes next, or a step event that is to be made in parts.
    ///
    /// Behind such step events one more is in parts, at the end of which motors are as early as the ticks that follow need them.
    pub(super) fn is_for_parts(&self) -> bool {
        let behind = self.early.is_none() && !self.announce;
        self.parts.is_some() || self.smooth && (self.is_sudden() || behind)
    }

    fn is_sudden(&self) -> bool {
        self.speed * self.speed < SUDDEN * self.acceleration
    }

    /// Begins to hand out the next step event in parts; `None` where it is too short, or too long to be one wait.
    #[inline(never)]
    pub(super) fn first_part(&self, timing: Timing) -> Option<Parts<MOTORS>> {
        let (seconds, exit) = self.profile.time_over(self.done, self.speed, 1.0);
        if seconds < ROOM * timing.shortest_tick || seconds > LONGEST_WAIT {
            return None;
        }
        Some(Parts {
            due: self.due(seconds),
            made: MotorMask::NONE,
            entry: self.speed,
            exit,
            seconds,
            elapsed: 0.0,
            early: if self.is_sudden() {
                None
            } else {
                Some(self.wanted(seconds, timing, 0.0))
            },
        })
    }

    /// Hands out the next part.
    #[inline(never)]
    pub(super) fn part(
        &mut self,
        parts: Parts<MOTORS>,
        timing: Timing,
        carry: &mut Carry,
    ) -> Segment<MOTORS> {
        let next = parts.next(timing.shortest_tick);
        let (motors, end) = next.unwrap_or((MotorMask::ALL.without(parts.made), parts.seconds));
        // Their sum is the step's time exactly.
        let counts = bits(end * timing.hz).saturating_sub(bits(parts.elapsed * timing.hz));
        let interval = carry.settle(counts, 0, NonZeroU16::MIN, counts).0;
        let mean = 1.0 / parts.seconds;
        let (power, power_change) = self.power_at(mean, mean, NonZeroU16::MIN);
        if next.is_some() {
            self.speed = mean;
            self.early = None;
            self.parts = Some(Parts {
                made: parts.made.with(motors),
                elapsed: end,
                ..parts
            });
        } else {
            self.speed = parts.exit;
            self.early = parts.early;
            self.parts = None;
            self.done += 1;
        }
        Segment {
            motors,
            ends_event: next.is_none(),
            early: self.early().of_a_part(),
            interval,
            power,
            power_change,
            ..Self::BLANK
        }
    }

    /// When each motor is due in the next step event, which takes `whole` seconds: seconds from its start.
    fn due(&self, whole: f32) -> [f32; MOTORS] {
        let (events, done) = (self.line.step_events().get(), self.done - self.line_start);
        self.line.steps().map(|steps| {
            let share = due(steps, events, done);
            if share < 1.0 {
                self.profile.time_over(self.done, self.speed, share).0
            } else {
                whole
            }
        })
    }
}

impl<const MOTORS: usize> Parts<MOTORS> {
    /// The motors that are due next, and when, seconds from the start; `None` where that is the end.
    fn next(&self, shortest: f32) -> Option<(MotorMask, f32)> {
        let left = || {
            let motors = self.due.iter().enumerate();
            motors.filter(|(motor, _)| !self.made.contains(*motor))
        };
        let first = left().fold(self.seconds, |first, (_, due)| least(first, *due));
        let at = most(first, self.elapsed + shortest);
        let soon = left().filter(|(_, due)| **due < at + shortest);
        let motors = soon.fold(MotorMask::NONE, |motors, (motor, _)| {
            motors.with(MotorMask::only(motor))
        });
        (at + shortest <= self.seconds).then_some((motors, at))
    }
}

/// Where in the step event after `done` of a line of `events` a motor that takes `steps` in it is due, 1 where that is its end or
/// later: the tracer counts half a step event ahead.
#[inline(never)]
fn due(steps: u32, events: u32, done: u32) -> f32 {
    let (each, full) = (2 * u64::from(steps), 2 * u64::from(events));
    let left = full - (each * u64::from(done) + full / 2) % full;
    if steps < events && left < each {
        left as f32 / each as f32
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_motor_with_three_steps_in_ten_is_due_at_a_sixth_a_half_and_five_sixths_of_the_line() {
        let shares = [0, 1, 2, 4, 5, 8, 9].map(|done| due(3, 10, done));
        let [begin, first, none, end, behind, last, over] = shares;
        assert_eq!([begin, none, end, behind, over], [1.0; 5]);
        assert!((first - 2.0 / 3.0).abs() < 1e-6 && (last - 1.0 / 3.0).abs() < 1e-6);
    }

    proptest! {
        /// Against the places themselves: the step `j` of `steps` is due after `(j + 1/2)·events/steps` step events.
        #[test]
        fn a_motor_is_due_half_way_to_its_next_step(events in 1u32..400, share in 0.0f64..1.0) {
            let steps = (share * f64::from(events)) as u32;
            let each = f64::from(events) / f64::from(steps);
            for done in 0..events {
                let begin = f64::from(done);
                let place = (0..events).map(|j| (f64::from(j) + 0.5) * each).find(|at| *at > begin + 1e-9);
                let share = place.map_or(1.0, |at| (at - begin).min(1.0));
                prop_assert!((f64::from(due(steps, events, done)) - share).abs() < 1e-6);
            }
        }
    }
}
