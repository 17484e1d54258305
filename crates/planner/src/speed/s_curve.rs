//! Speed and time along one move under a jerk limit.
//!
//! ```text
//!  v          ________
//!           /          \      easing: an acceleration under way (a plan that changes) falls to 0
//!          |            |     up:     to the cruise, or down to it
//!         /              \    cruise: level
//!     __--                --__   down: to the speed at the end
//!   start ...... s ...... end    (steps of the dominant motor)
//! ```
//!
//! The acceleration is 0 where a move ends: a ramp never goes on in the next move. That is safe
//! whatever comes next, and slow where moves are short. Collinear moves are better given as one.

use crate::real::{max, min, rough_cube_root, sqrt};
use crate::speed::plan::{Place, Plan, Stretch};
use crate::speed::ramp::{self, Limits, Ramp};

/// Ramps with limited jerk and a cruise between them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SCurve {
    start: Place,
    end: u32,
    easing: Ramp,
    up: Ramp,
    cruise: f32,
    /// Speed between the ramps where rounding leaves a little of the way: no lower than the speed
    /// half a step out of rest.
    level: f32,
    /// The last ramp, seen from the end and backwards in time: places near rest are then small
    /// numbers, and exact.
    down: Ramp,
    limits: Limits,
}

/// The rough cube root is too small by less than this factor.
const ROOT_MARGIN: f32 = 1.1;

/// Halvings of a range of speeds: one less than the bits of an `f32`'s significand.
const HALVINGS: u32 = 23;

impl SCurve {
    /// Makes the fastest profile that keeps `plan`, begun with `acceleration` (steps/s², signed)
    /// and with `jerk` (steps/s³, above 0) as its limit.
    ///
    /// Where the distance does not suffice to brake to the exit speed, the end is as slow as it can
    /// be. `None` where the acceleration under way cannot fall to 0 before the end: the profile in
    /// force must then be kept.
    pub(crate) fn new(plan: &Plan, acceleration: f32, jerk: f32) -> Option<Self> {
        let limits = Limits {
            acceleration: min(plan.up, plan.down),
            jerk,
        };
        let entry = Entry {
            speed: sqrt(plan.entry_v2),
            acceleration,
            limits,
        };
        let length = plan.start.before(plan.end);
        let exit = entry.exit(min(sqrt(plan.exit_v2), plan.cruise), length)?;
        let cruise = entry.cruise(plan.cruise, exit, length);
        let (easing, up) = entry.ramps(cruise);
        Some(Self {
            start: plan.start,
            end: plan.end,
            easing,
            up,
            cruise,
            level: if cruise < plan.cruise {
                max(cruise, ramp::half_a_step(limits))
            } else {
                cruise
            },
            down: Ramp::between(exit, cruise, limits),
            limits,
        })
    }

    /// Length in steps, a fraction in general, of the shortest stop from `speed` (steps/s) with
    /// `acceleration` (steps/s², signed) under way. The limits are `largest` (steps/s²) and `jerk`
    /// (steps/s³).
    pub(crate) fn stop(speed: f32, acceleration: f32, largest: f32, jerk: f32) -> f32 {
        let limits = Limits {
            acceleration: largest,
            jerk,
        };
        let entry = Entry {
            speed,
            acceleration,
            limits,
        };
        entry.distance(0.0)
    }

    /// The place at which the profile begins.
    pub const fn start(&self) -> Place {
        self.start
    }

    /// The step at which the profile ends.
    pub const fn end(&self) -> u32 {
        self.end
    }

    /// Speed between the ramps (the peak where there is no cruise), steps/s.
    pub const fn cruise(&self) -> f32 {
        self.cruise
    }

    /// Squared speed at the end, steps²/s².
    pub const fn exit_v2(&self) -> f32 {
        self.down.start_speed() * self.down.start_speed()
    }

    /// Speed (steps/s) and acceleration (steps/s², signed) at a place.
    pub fn motion(&self, place: Place) -> (f32, f32) {
        let (x, y) = self.ends(place);
        if y < self.down.length() {
            let (speed, acceleration) = self.down.motion(y);
            (speed, -acceleration)
        } else if x < self.easing.length() {
            self.easing.motion(x)
        } else if x < self.head() {
            self.up.motion(x - self.easing.length())
        } else {
            (self.cruise, 0.0)
        }
    }

    /// Time that the `steps` after `from` take (seconds), and the speed at their end (steps/s).
    pub(crate) fn time_over(&self, from: Place, steps: f32) -> (f32, f32) {
        let (x, y) = self.ends(from);
        let (head, tail) = (self.head(), self.down.length());
        let first = max(min(head - x, steps), 0.0);
        let last = max(min(tail - (y - steps), steps - first), 0.0);
        let middle = steps - first - last;
        let (mut time, mut speed) = (0.0, self.cruise);
        if first > 0.0 {
            time = self.head_time(x, first);
            speed = self.head_speed(x + first);
        }
        if middle > 0.0 {
            time += middle / self.level;
            speed = self.cruise;
        }
        if last > 0.0 {
            let end = max(y - steps, 0.0);
            time += self.down.time(end, last);
            speed = self.down.motion(end).0;
        }
        if y <= steps {
            speed = self.down.start_speed();
        }
        (time, speed)
    }

    /// The stretch that step `from` lies in. Its `acceleration` is constant: the one whose third
    /// derivative of time by place, `3a²/v⁵`, is the largest that the ramp with its jerk can have:
    ///
    /// ```text
    ///   t‴ = (3a² − v·jerk)/v⁵
    /// ```
    pub(crate) fn stretch(&self, from: u32) -> Stretch {
        let from = Place::at(from);
        let (x, y) = self.ends(from);
        let (left, peak) = if x < self.head() {
            let peak = max(self.easing.peak(), self.up.peak());
            let down = self.up.end_speed() < self.motion(from).0;
            (self.head() - x, if down { -peak } else { peak })
        } else if y > self.down.length() {
            (y - self.down.length(), 0.0)
        } else {
            (y, -self.down.peak())
        };
        Stretch {
            steps: left as u32,
            acceleration: self.bent(peak, from),
        }
    }

    /// The acceleration of [`SCurve::stretch`], steps/s². `peak` is the largest one of the ramp
    /// that `from` lies on, signed; 0 in the cruise.
    fn bent(&self, peak: f32, from: Place) -> f32 {
        let speed = self.motion(from).0;
        let bent = sqrt(peak * peak + speed * self.limits.jerk / 3.0);
        if peak > 0.0 {
            bent
        } else if peak < 0.0 {
            -bent
        } else {
            0.0
        }
    }

    /// Length of the easing and the ramp to the cruise, steps.
    fn head(&self) -> f32 {
        self.easing.length() + self.up.length()
    }

    /// The time of the `steps` after the place `x`, all of them before the cruise, seconds.
    fn head_time(&self, x: f32, steps: f32) -> f32 {
        let length = self.easing.length();
        let eased = max(min(length - x, steps), 0.0);
        let mut time = 0.0;
        if eased > 0.0 {
            // Near rest a place in a long easing is not known well enough to tell its time. The
            // jerk alone takes no longer.
            let most_time = ROOT_MARGIN * rough_cube_root(6.0 * eased / self.limits.jerk);
            time = min(self.easing.time(x, eased), most_time);
        }
        if steps > eased {
            time += self.up.time(max(x - length, 0.0), steps - eased);
        }
        time
    }

    /// Speed at the place `x` before the cruise, steps/s.
    fn head_speed(&self, x: f32) -> f32 {
        let eased = self.easing.length();
        if x < eased {
            self.easing.motion(x).0
        } else {
            self.up.motion(x - eased).0
        }
    }

    /// Steps from the start to `place` and from there to the end.
    fn ends(&self, place: Place) -> (f32, f32) {
        (place.after(self.start), place.before(self.end))
    }
}

#[cfg(test)]
impl SCurve {
    /// Seconds from the start to the place `s` steps after it, in `f64`: the reference of the
    /// tests.
    pub(crate) fn exact_time(&self, s: f64) -> f64 {
        let length = f64::from(self.end - self.start.step) - f64::from(self.start.part);
        let [easing, up, down] = [&self.easing, &self.up, &self.down].map(Ramp::exact_length);
        let head = easing + up;
        let mut time = self.easing.exact_time(s.min(easing));
        if s > easing {
            time += self.up.exact_time(s.min(head) - easing);
        }
        time += (s.min(length - down) - head).max(0.0) / f64::from(self.level);
        let left = length - s;
        if left < down {
            time += self.down.exact_time(down) - self.down.exact_time(left);
        }
        time
    }
}

/// How a profile begins.
#[derive(Clone, Copy)]
struct Entry {
    /// Steps/s.
    speed: f32,
    /// Acceleration under way, steps/s², signed.
    acceleration: f32,
    limits: Limits,
}

impl Entry {
    /// The speed once the acceleration under way has fallen to 0.
    fn level(&self) -> f32 {
        Ramp::easing(self.speed, self.acceleration, self.limits).end_speed()
    }

    /// The quickest way to `speed`: a ramp that goes on with the acceleration under way, or a ramp
    /// that begins once this acceleration has fallen to 0.
    fn ramps(&self, speed: f32) -> (Ramp, Ramp) {
        if self.acceleration == 0.0 {
            let up = Ramp::between(self.speed, speed, self.limits);
            return (Ramp::none(self.speed), up);
        }
        match Ramp::joined(self.speed, self.acceleration, speed, self.limits) {
            Some(up) => (Ramp::none(self.speed), up),
            None => {
                let easing = Ramp::easing(self.speed, self.acceleration, self.limits);
                let up = Ramp::between(easing.end_speed(), speed, self.limits);
                (easing, up)
            }
        }
    }

    /// Steps on the quickest way to `speed`.
    fn distance(&self, speed: f32) -> f32 {
        let (easing, up) = self.ramps(speed);
        easing.length() + up.length()
    }

    /// The speed nearest to `wanted` that is reached within `length` steps; `None` where the
    /// acceleration under way cannot fall to 0 within them.
    fn exit(&self, wanted: f32, length: f32) -> Option<f32> {
        if self.distance(wanted) <= length {
            return Some(wanted);
        }
        let level = self.level();
        (self.distance(level) <= length)
            .then(|| furthest(level, wanted, |speed| self.distance(speed) <= length))
    }

    /// The highest speed up to `wanted` from which `exit` can still be reached, `length` steps
    /// after the start.
    fn cruise(&self, wanted: f32, exit: f32, length: f32) -> f32 {
        let fits = |speed| self.distance(speed) + ramp::length(speed, exit, self.limits) <= length;
        if fits(wanted) {
            return wanted;
        }
        let slow = max(self.level(), exit);
        if slow <= wanted && fits(slow) {
            furthest(slow, wanted, fits)
        } else {
            furthest(exit, min(slow, wanted), fits)
        }
    }
}

/// Finds by halving the speed nearest to `bad` that `fits`. `good` must fit, and `bad` must not.
fn furthest(mut good: f32, mut bad: f32, fits: impl Fn(f32) -> bool) -> f32 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (good + bad);
        if fits(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    good
}

#[cfg(test)]
mod tests;
