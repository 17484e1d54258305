//! Speed and time along one move, by one of two laws: constant acceleration, or limited jerk.
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
//! phases are `f32`. Speeds on a ramp are computed from its outer end, where they are smallest and
//! `v² = 2·a·s` loses nothing. Times come from `t = 2·Δs/(v0 + v1)`, which is exact under constant
//! acceleration and free of cancellation. Together the relative error of a time is a few 2⁻²⁴.
//!
//! A first ramp goes down where the move begins faster than its cruise speed (an override was
//! lowered).
//!
//! Another profile takes the trapezoid's place by answering the same questions:
//! [`Trapezoid::speed`], [`Trapezoid::time`], [`Trapezoid::stretch`], [`Trapezoid::exit_v2`].

use super::plan::{Place, Plan, Stretch};
use crate::real::{max, min, sqrt};
use crate::SCurve;

/// Speed and time along one move, by either law: the law says how speed changes along the move.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Profile {
    /// Ramps of constant acceleration.
    Trapezoid(Trapezoid),
    /// Ramps of limited jerk.
    SCurve(SCurve),
}

impl Profile {
    /// The place at which the profile begins.
    pub const fn start(&self) -> Place {
        match self {
            Self::Trapezoid(of) => of.start(),
            Self::SCurve(of) => of.start(),
        }
    }

    /// The step at which the profile ends.
    pub const fn end(&self) -> u32 {
        match self {
            Self::Trapezoid(of) => of.end(),
            Self::SCurve(of) => of.end(),
        }
    }

    /// Speed between the ramps (the peak where there is no cruise), steps/s.
    pub const fn cruise(&self) -> f32 {
        match self {
            Self::Trapezoid(of) => of.cruise(),
            Self::SCurve(of) => of.cruise(),
        }
    }

    /// Squared speed at the end, steps²/s².
    pub fn exit_v2(&self) -> f32 {
        match self {
            Self::Trapezoid(of) => of.exit_v2(),
            Self::SCurve(of) => of.exit_v2(),
        }
    }

    /// Whether a profile of limited jerk slows down at `place` and ends at rest.
    pub(crate) fn brakes_to_rest(&self, place: Place) -> bool {
        match self {
            Self::Trapezoid(_) => false,
            Self::SCurve(of) => of.last_speed() <= 0.0 && of.motion(place).1 < 0.0,
        }
    }

    /// The rest of a profile that goes on in the next move: see [`SCurve::go_on`].
    pub(crate) fn go_on(&self, events: u32, ratio: f32) -> Option<Self> {
        match self {
            Self::Trapezoid(_) => None,
            Self::SCurve(of) => of.go_on(events, ratio).map(Self::SCurve),
        }
    }

    /// Squared speed at a place, steps²/s².
    pub(crate) fn speed_v2(&self, place: Place) -> f32 {
        match self {
            Self::Trapezoid(of) if place == of.start() => of.entry_v2(),
            Self::Trapezoid(of) => of.speed_v2(place),
            Self::SCurve(of) => {
                let (speed, _) = of.motion(place);
                speed * speed
            }
        }
    }

    /// Speed (steps/s) and acceleration (steps/s², signed) at a place. The acceleration is the part
    /// that has to fall to 0 gradually: 0 without a jerk limit.
    pub(crate) fn motion(&self, place: Place) -> (f32, f32) {
        match self {
            Self::Trapezoid(_) => (sqrt(self.speed_v2(place)), 0.0),
            Self::SCurve(of) => of.motion(place),
        }
    }

    /// Time that the `steps` after `from` take (seconds), and the speed at their end (steps/s).
    ///
    /// `v0` is the speed at `from`.
    pub(crate) fn time_over(&self, from: Place, v0: f32, steps: f32) -> (f32, f32) {
        match self {
            Self::Trapezoid(of) => of.time_over(from, v0, steps),
            Self::SCurve(of) => of.time_over(from, steps),
        }
    }

    /// The stretch that step `from` lies in.
    pub(crate) fn stretch(&self, from: u32) -> Stretch {
        match self {
            Self::Trapezoid(of) => of.stretch(from),
            Self::SCurve(of) => of.stretch(from),
        }
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
    /// Where the distance does not suffice to brake to the exit speed, the end is as slow as it can
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

    /// The place at which the profile begins.
    pub const fn start(&self) -> Place {
        self.start
    }

    /// The step at which the profile ends.
    pub const fn end(&self) -> u32 {
        self.end
    }

    /// Squared speed at the start, steps²/s².
    pub const fn entry_v2(&self) -> f32 {
        self.entry_v2
    }

    /// Speed between the ramps (the peak where there is no cruise), steps/s.
    pub const fn cruise(&self) -> f32 {
        self.cruise
    }

    /// Squared speed at the end, steps²/s².
    pub const fn exit_v2(&self) -> f32 {
        self.exit_v2
    }

    /// Acceleration of the first and deceleration of the last ramp, steps/s²; the first is negative
    /// where that ramp goes down.
    pub const fn accelerations(&self) -> [f32; 2] {
        [0.5 * self.first_slope, 0.5 * self.last_slope]
    }

    /// Squared speed at a place, steps²/s².
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

    /// Speed at a step, steps/s: *v(s)*.
    pub fn speed(&self, step: u32) -> f32 {
        sqrt(self.speed_v2(Place::at(step)))
    }

    /// Time from the start to a step, seconds: *t(s)*.
    pub fn time(&self, step: u32) -> f32 {
        let steps = Place::at(step).after(self.start);
        self.time_over(self.start, sqrt(self.entry_v2), steps).0
    }

    /// Time that the `steps` after `from` take (seconds), and the speed at their end (steps/s).
    ///
    /// `v0` is the speed at `from`.
    fn time_over(&self, from: Place, v0: f32, steps: f32) -> (f32, f32) {
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
