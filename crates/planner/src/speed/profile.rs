//! Speed and time along one move: ramps of constant acceleration, or their mean.
//!
//! Under constant acceleration the speed is a trapezoid:
//!
//! ```text
//!  v²      ___________
//!         /           \        first ramp: v² = entry² + 2·a·x,  x steps from the start
//!        /             \       cruise:     v  = cruise
//!       /               \      last ramp:  v² = exit²  + 2·a·y,  y steps from the end
//!      |                 |
//!      start ...... s .... end     (steps of the dominant motor)
//! ```
//!
//! A place is whole steps and a part of the next one, so it is exact; only speeds and lengths of
//! phases are `f32`. Speeds on a ramp are computed from its outer end, at which they are smallest
//! and `v² = 2·a·s` loses nothing. Times come from `t = 2·Δs/(v0 + v1)`, which is exact under
//! constant acceleration and free of cancellation. Together the relative error of a time is a few
//! 2⁻²⁴.
//!
//! A first ramp goes down if the move begins faster than its cruise speed (an override was
//! lowered).

use super::plan::{Place, Plan, Stretch};
use crate::real::{max, min, sqrt};
use crate::Mean;

/// Speed and time along one move.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Profile {
    /// Ramps of constant acceleration.
    Trapezoid(Trapezoid),
    /// The mean of such ramps over a time: what the tool does under a jerk limit.
    Mean(Mean),
}

impl Profile {
    /// The step at which the profile ends, or up to which it is known.
    pub(crate) fn end(&self) -> u32 {
        match self {
            Self::Trapezoid(of) => of.end(),
            Self::Mean(of) => of.end(),
        }
    }

    /// Speed between the ramps (the peak if there is no cruise), steps/s.
    pub(crate) fn cruise(&self) -> f32 {
        match self {
            Self::Trapezoid(of) => of.cruise(),
            Self::Mean(of) => of.last_speed(),
        }
    }

    /// Squared speed at the end, steps²/s².
    pub(crate) fn exit_v2(&self) -> f32 {
        match self {
            Self::Trapezoid(of) => of.exit_v2(),
            Self::Mean(of) if of.rests_at(of.end()) => 0.0,
            Self::Mean(of) => max(of.last_speed() * of.last_speed(), f32::MIN_POSITIVE),
        }
    }

    /// Time that the `steps` after `from` take (seconds), and the speed at their end (steps/s).
    ///
    /// `v0` is the speed at `from`.
    pub(crate) fn time_over(&self, from: Place, v0: f32, steps: f32) -> (f32, f32) {
        match self {
            Self::Trapezoid(of) => of.time_over(from, v0, steps),
            Self::Mean(of) => of.time_over(from, steps),
        }
    }

    /// The stretch that step `from` lies in.
    pub(crate) fn stretch(&self, from: u32) -> Stretch {
        match self {
            Self::Trapezoid(of) => of.stretch(from),
            Self::Mean(of) => of.stretch(from),
        }
    }

    /// Returns true if the plan does not reach the end of the step at `here` yet.
    pub(crate) fn is_open(&self, here: Place) -> bool {
        matches!(self, Self::Mean(of) if of.end() <= here.step())
    }
}

/// Constant acceleration, constant speed, constant deceleration.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Trapezoid {
    start: Place,
    end: u32,
    entry_v2: f32,
    cruise: f32,
    exit_v2: f32,
    /// Change of v² a step on the first ramp: `±2·a`.
    first_slope: f32,
    /// Loss of v² a step on the last ramp.
    last_slope: f32,
    /// Length of the first ramp, steps.
    first: f32,
    /// Length of the last ramp, steps.
    last: f32,
}

/// Two squared speeds count as equal if they differ by no more than this share of the squared speed
/// at the profile's start: the difference is rounding.
pub(crate) const ROUNDING: f32 = 2e-6;

impl Trapezoid {
    /// Makes the fastest profile for `plan`.
    ///
    /// If the distance does not suffice to brake to the exit speed, the end is as slow as it can
    /// be. Speeds that differ by no more than rounding errors are taken as equal.
    pub fn new(plan: &Plan) -> Self {
        let cruise_v2 = plan.cruise * plan.cruise;
        let [rise, fall] = [plan.up, plan.down].map(|a| 2.0 * a * length(plan));
        let exit_v2 = min(plan.exit_v2, min(cruise_v2, plan.entry_v2 + rise));
        if plan.entry_v2 - fall > exit_v2 - ROUNDING * plan.entry_v2 {
            Self::braking(plan, exit_v2)
        } else {
            Self::ramps(plan, cruise_v2, exit_v2)
        }
    }

    /// A profile that brakes all the way, because the distance only just suffices to brake to
    /// `exit_v2`, or does not suffice.
    fn braking(plan: &Plan, exit_v2: f32) -> Self {
        let length = length(plan);
        let slowest = plan.entry_v2 - 2.0 * plan.down * length;
        let missed = slowest - exit_v2 > ROUNDING * plan.entry_v2;
        let exit_v2 = if missed { slowest } else { exit_v2 };
        // The slope is never steeper than planned. An excess by rounding goes to the speed at the
        // ramp's start instead.
        let slope = max((plan.entry_v2 - exit_v2) / length, 0.0);
        let slope = min(slope, 2.0 * plan.down);
        Self {
            exit_v2,
            cruise: sqrt(plan.entry_v2),
            first: 0.0,
            last: length,
            last_slope: slope,
            ..Self::level(plan)
        }
    }

    /// A profile with two ramps, and a cruise between them if the way is long enough for it.
    fn ramps(plan: &Plan, cruise_v2: f32, exit_v2: f32) -> Self {
        let (length, up, down) = (length(plan), 2.0 * plan.up, 2.0 * plan.down);
        let slower = plan.entry_v2 > cruise_v2;
        let climb = cruise_v2 - plan.entry_v2;
        let first_slope = if slower { -down } else { up };
        let (first, last) = (climb / first_slope, (cruise_v2 - exit_v2) / down);
        let level = Self::level(plan);
        if first + last <= length || slower {
            let last = min(last, length - first);
            return Self {
                exit_v2,
                first,
                last,
                first_slope,
                ..level
            };
        }
        let first = (down * length + exit_v2 - plan.entry_v2) / (up + down);
        let first = max(min(first, length), 0.0);
        Self {
            cruise: sqrt(plan.entry_v2 + up * first),
            exit_v2,
            first,
            last: length - first,
            ..level
        }
    }

    /// Entry, cruise speed and slopes of `plan`; no ramps yet.
    fn level(plan: &Plan) -> Self {
        Self {
            start: plan.start,
            end: plan.end,
            entry_v2: plan.entry_v2,
            cruise: plan.cruise,
            exit_v2: plan.exit_v2,
            first_slope: 2.0 * plan.up,
            last_slope: 2.0 * plan.down,
            first: 0.0,
            last: 0.0,
        }
    }

    /// Returns the place at which the profile begins.
    pub const fn start(&self) -> Place {
        self.start
    }

    /// Returns the step at which the profile ends.
    pub const fn end(&self) -> u32 {
        self.end
    }

    /// Returns the squared speed at the start, steps²/s².
    pub const fn entry_v2(&self) -> f32 {
        self.entry_v2
    }

    /// Returns the speed between the ramps (the peak if there is no cruise), steps/s.
    pub const fn cruise(&self) -> f32 {
        self.cruise
    }

    /// Returns the squared speed at the end, steps²/s².
    pub const fn exit_v2(&self) -> f32 {
        self.exit_v2
    }

    /// Returns the acceleration of the first and the deceleration of the last ramp, steps/s²; the
    /// first is negative if that ramp goes down.
    pub const fn accelerations(&self) -> [f32; 2] {
        [0.5 * self.first_slope, 0.5 * self.last_slope]
    }

    /// Returns the squared speed at a place, steps²/s².
    pub fn speed_v2(&self, place: Place) -> f32 {
        let (x, y) = self.ends(place);
        if y < self.last {
            self.exit_v2 + self.last_slope * max(y, 0.0)
        } else if x < self.first {
            self.entry_v2 + self.first_slope * x
        } else {
            self.cruise * self.cruise
        }
    }

    /// As [`Trapezoid::speed_v2`]; at the start exactly the squared speed that was asked for.
    pub(crate) fn speed_v2_at(&self, place: Place) -> f32 {
        match place == self.start {
            true => self.entry_v2,
            false => self.speed_v2(place),
        }
    }

    /// Returns the speed at a step, steps/s: *v(s)*.
    pub fn speed(&self, step: u32) -> f32 {
        sqrt(self.speed_v2(Place::at(step)))
    }

    /// Returns the time from the start to a step, seconds: *t(s)*.
    pub fn time(&self, step: u32) -> f32 {
        let steps = Place::at(step).after(self.start);
        self.time_over(self.start, sqrt(self.entry_v2), steps).0
    }

    /// Time that the `steps` after `from` take (seconds), and the speed at their end (steps/s).
    ///
    /// `v0` is the speed at `from`.
    pub(crate) fn time_over(&self, from: Place, v0: f32, steps: f32) -> (f32, f32) {
        let (x, y) = self.ends(from);
        let first = max(min(self.first - x, steps), 0.0);
        let last = max(min(self.last - (y - steps), steps - first), 0.0);
        let middle = steps - first - last;
        let (mut time, mut speed) = (0.0, v0);
        if first > 0.0 {
            let through = middle > 0.0 || last > 0.0;
            let v2 = self.entry_v2 + self.first_slope * (x + steps);
            speed = if through { self.cruise } else { sqrt(v2) };
            time = 2.0 * first / (v0 + speed);
        }
        if middle > 0.0 {
            speed = self.cruise;
            time += middle / speed;
        }
        if last > 0.0 {
            let end = sqrt(self.exit_v2 + self.last_slope * max(y - steps, 0.0));
            time += 2.0 * last / (speed + end);
            speed = end;
        }
        (time, speed)
    }

    /// The place that motion reaches in the time `seconds` after `from`, at most the end; and the
    /// time that is left there, seconds.
    pub(crate) fn advance(&self, from: Place, seconds: f32) -> (Place, f32) {
        let (x, y) = self.ends(from);
        let mut v = sqrt(self.speed_v2_at(from));
        let (mut left, mut way) = (seconds, 0.0);
        let first = max(min(self.first - x, y), 0.0);
        if first > 0.0 {
            let time = 2.0 * first / (v + self.cruise);
            if left < time {
                let gone = v * left + 0.25 * self.first_slope * left * left;
                return (from.moved(max(min(gone, first), 0.0)), 0.0);
            }
            (left, way, v) = (left - time, first, self.cruise);
        }
        let middle = max(y - way - self.last, 0.0);
        if middle > 0.0 {
            let time = middle / v;
            if left < time {
                return (from.moved(way + v * left), 0.0);
            }
            (left, way) = (left - time, way + middle);
        }
        let rest = max(y - way, 0.0);
        if rest > 0.0 {
            let time = 2.0 * rest / (v + sqrt(self.exit_v2));
            if left < time {
                let gone = v * left - 0.25 * self.last_slope * left * left;
                return (from.moved(way + max(min(gone, rest), 0.0)), 0.0);
            }
            left -= time;
        }
        (Place::at(self.end), left)
    }

    /// The stretch that step `from` lies in.
    fn stretch(&self, from: u32) -> Stretch {
        let (x, y) = self.ends(Place::at(from));
        let [up, down] = self.accelerations();
        let (left, acceleration) = if x < self.first {
            (self.first - x, up)
        } else if y > self.last {
            (y - self.last, 0.0)
        } else {
            (y, -down)
        };
        Stretch {
            steps: left as u32,
            acceleration,
        }
    }

    /// Steps from the start of the profile to `place`, and from `place` to its end.
    fn ends(&self, place: Place) -> (f32, f32) {
        (place.after(self.start), place.before(self.end))
    }
}

/// Steps from the start of a plan to its end.
fn length(plan: &Plan) -> f32 {
    plan.start.before(plan.end)
}
