//! The next piece of the running move: as many steps as a segment may have.

use super::{Running, Timing};
use crate::emit::fit::{steps, Carry, Linear};
use crate::real::{max, min};
use crate::speed::profile::Place;
use core::num::NonZeroU16;
use leadscrew_stepper::{Early, Interval, IntervalChange, MotorMask, Smoothing};

/// The most step events of a segment: with sixteenfold smoothing their ticks fit 16 bits. (A
/// millisecond at 300 kHz has 300 step events.)
const MOST_EVENTS: u32 = 4000;

/// After a step that takes `T` an override may make the next step shorter by `a·T³`. A motor that
/// is early by a sixteenth of the first step may then be too early by a sixteenth of that
/// difference: at most this time, seconds. Otherwise the ticks of a cruise are as fine as on a
/// ramp.
const SURPRISE: f32 = 0.2e-6;

/// The evenness to use for a cruise whose ticks have to be as fine as on a ramp: anything below 1.
const NEARLY_EVEN: f32 = 0.99;

/// The ticks of a segment, which are whole steps or a part of one, and the speeds that its power
/// follows from. A whole `Segment` is long, and each copy of one takes 200 cycles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) ticks: NonZeroU16,
    pub(super) smoothing: Smoothing,
    pub(super) motors: MotorMask,
    pub(super) ends_event: bool,
    pub(super) early: Early,
    pub(super) interval: Interval,
    pub(super) interval_change: IntervalChange,
    /// Speeds in its first and in its last tick, steps/s.
    pub(super) speeds: [f32; 2],
}

/// Steps on a ramp, halved.
struct Ramp {
    /// The steps of the first half; half a step of a single one.
    half: f32,
    /// Time of the first half, and of all, seconds.
    first: f32,
    seconds: f32,
    /// Speed at the end, steps/s.
    exit: f32,
}

impl<const MOTORS: usize> Running<MOTORS> {
    /// The next piece: a part of a step event, or as many whole step events as a segment may have.
    pub(super) fn piece(&mut self, timing: Timing, carry: &mut Carry) -> Piece {
        if self.is_for_parts(timing) {
            if let Some(parts) = self.progress.parts.or_else(|| self.first_part(timing)) {
                return self.part(parts, timing, carry);
            }
        }
        let done = self.progress.done;
        let stretch = self.profile.stretch(done);
        let events = steps(self.speed, stretch.acceleration, timing.longest_segment)
            .min(stretch.steps)
            .min(self.along.to_next_pixel(done))
            .clamp(1, MOST_EVENTS);
        if stretch.acceleration == 0.0 && stretch.steps > 0 {
            self.cruise_piece(events, timing, carry)
        } else {
            self.ramp_piece(events, timing, carry)
        }
    }

    /// The next `events` steps at constant speed. Their intervals are even, and known to more than
    /// 24 bits so that no drift adds up.
    fn cruise_piece(&mut self, events: u32, timing: Timing, carry: &mut Carry) -> Piece {
        let seconds = 1.0 / self.speed;
        self.progress.done += events;
        let steady = self.acceleration * seconds * seconds * seconds < 16.0 * SURPRISE;
        let evenness = if steady { 1.0 } else { NEARLY_EVEN };
        let smoothing = self.tracer.smoothing(seconds, timing, evenness);
        let ticks = ticks(events, smoothing);
        let (interval, interval_change) =
            carry.round_cruise(self.cruise_interval, smoothing.level(), ticks);
        Piece {
            ticks,
            smoothing,
            motors: MotorMask::ALL,
            ends_event: true,
            early: self.tracer.early(),
            interval,
            interval_change,
            speeds: [self.speed; 2],
        }
    }

    /// The next `events` steps on a ramp, or over the end of one.
    fn ramp_piece(&mut self, events: u32, timing: Timing, carry: &mut Carry) -> Piece {
        let all = events as f32;
        let ramp = self.ramp(events);
        let evenness = min(self.speed, ramp.exit) * ramp.seconds / all;
        self.speed = ramp.exit;
        self.progress.done += events;
        let smoothing = self.tracer.smoothing(ramp.seconds / all, timing, evenness);
        let ticks = ticks(events, smoothing);
        let count = f32::from(ticks.get());
        let duration = ramp.seconds * timing.hz;
        let linear = if ticks.get() > 1 {
            let middle = ramp.half * count / all;
            Linear::through(ramp.first * timing.hz, middle, duration, count)
        } else {
            Linear::even(duration, count)
        };
        let (interval, interval_change) = carry.round(linear, ticks, duration);
        let speeds = if events > 1 {
            let per_tick = all / count * timing.hz;
            [per_tick / linear.first, per_tick / linear.last(count)]
        } else {
            [1.0 / ramp.seconds; 2]
        };
        Piece {
            ticks,
            smoothing,
            motors: MotorMask::ALL,
            ends_event: true,
            early: self.tracer.early(),
            interval,
            interval_change,
            speeds,
        }
    }

    /// The next `events` steps of the profile.
    fn ramp(&self, events: u32) -> Ramp {
        let (done, all) = (self.progress.done, events as f32);
        let half = if events > 1 { (events / 2) as f32 } else { 0.5 };
        let over = |from, speed, steps| self.profile.time_over(Place::at(from), speed, steps);
        let (first, middle_speed) = over(done, self.speed, half);
        if events > 1 {
            let (second, exit) = over(done + events / 2, middle_speed, all - half);
            Ramp {
                half,
                first,
                seconds: first + second,
                exit,
            }
        } else {
            let (seconds, exit) = over(done, self.speed, all);
            Ramp {
                half,
                first: within_a_step(first, seconds),
                seconds,
                exit,
            }
        }
    }
}

/// The time of the first half of a step, limited so that a linear interval can follow it. The whole
/// step takes `seconds`. Under constant acceleration out of rest the first half takes √½ of them.
/// Under a jerk limit it takes more, and the last interval of the step would be negative.
fn within_a_step(half: f32, seconds: f32) -> f32 {
    const MOST: f32 = 0.7075;
    min(max(half, (1.0 - MOST) * seconds), MOST * seconds)
}

/// The ticks of so many step events.
fn ticks(events: u32, smoothing: Smoothing) -> NonZeroU16 {
    NonZeroU16::new((events << smoothing.level()) as u16).unwrap_or(NonZeroU16::MIN)
}
