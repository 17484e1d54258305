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
//! The end may lie in a later move: a ramp goes on across the borders of moves (see `waypoints`).

use crate::real::{max, min, rough_cube_root, sqrt};
use crate::speed::plan::{Place, Plan, Stretch};
use crate::speed::ramp::{self, Limits, Ramp};

/// Ramps with limited jerk and a cruise between them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SCurve {
    start: Place,
    end: u32,
    /// Steps of the move that runs in a step of the move in which the profile was made. All that
    /// follows is in steps of the latter.
    scale: f32,
    /// Steps from the start of the profile, in an earlier move, to `start`.
    before: f32,
    /// Steps from `end` to the end of the profile, in later moves; below 0 where the profile ends
    /// before `end`.
    beyond: f32,
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

/// How much of a length may be missing by rounding, steps. The speeds at the ends of a short ramp
/// are nearly equal, so their difference is known less exactly.
fn rounding(length: f32) -> f32 {
    1e-5 * length + min(1e-3 * length, 0.02)
}

/// Halvings of a range of speeds: to a 65 000th.
const HALVINGS: u32 = 16;

impl SCurve {
    /// Makes the fastest profile that keeps `plan`, begun with `acceleration` (steps/s², signed)
    /// and with `jerk` (steps/s³, above 0) as its limit.
    ///
    /// Where the distance does not suffice to speed up to the exit speed, the end is as fast as it
    /// can be. `None` where it does not suffice to brake to the exit speed.
    pub(crate) fn new(plan: &Plan, acceleration: f32, jerk: f32) -> Option<Self> {
        let (entry, length) = (Entry::new(plan, acceleration, jerk), length(plan));
        let limits = entry.limits;
        let (exit, missing) = entry.exit(exit(plan), length)?;
        let mut cruise = entry.cruise(plan.cruise, exit, length);
        let (mut easing, mut up) = entry.ramps(cruise);
        let (mut down, mut beyond) = (Ramp::between(exit, cruise, limits), plan.beyond);
        if cruise <= 0.0 {
            // A ramp leads to rest. Seen from there its last places are exact.
            beyond -= max(length - easing.length() - up.length(), 0.0);
            cruise = easing.end_speed();
            let last = if up.length() > 0.0 {
                &mut up
            } else {
                &mut easing
            };
            down = last.backwards();
            *last = Ramp::none(cruise);
        }
        Some(Self {
            start: plan.start,
            end: plan.end,
            scale: 1.0,
            before: missing, // at the start it is noticed least
            beyond,
            easing,
            up,
            cruise,
            level: if cruise < plan.cruise {
                max(cruise, ramp::half_a_step(jerk))
            } else {
                cruise
            },
            down,
            limits,
        })
    }

    /// Whether a profile as of [`SCurve::new`] reaches its exit speed.
    pub(crate) fn reaches(plan: &Plan, acceleration: f32, jerk: f32) -> bool {
        let length = length(plan);
        let missing = Entry::new(plan, acceleration, jerk).distance(exit(plan)) - length;
        missing <= rounding(length)
    }

    /// The rest of the profile, from the end of a move on, in the next one. That move has `events`
    /// steps, and `ratio` of them are as long as a step before. The profile of a stop may end
    /// within a step of it: speed and acceleration stay as they are. `None` if the profile has
    /// ended.
    pub(crate) fn go_on(&self, events: u32, ratio: f32) -> Option<Self> {
        /// The end of a move is known to much less than this, steps.
        const SAME: f32 = 0.01;
        let (before, left) = self.ends(Place::at(self.end));
        let scale = self.scale * ratio;
        let end = events.min((left * scale + 1.0 - SAME) as u32).max(1);
        let beyond = left * scale - end as f32;
        (left > 0.0).then(|| Self {
            start: Place::at(0),
            end,
            scale,
            before,
            beyond: if beyond.abs() > SAME {
                beyond / scale
            } else {
                0.0
            },
            ..*self
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
        self.cruise * self.scale
    }

    /// The speed at the end of the profile, steps/s.
    pub(crate) fn last_speed(&self) -> f32 {
        self.down.start_speed()
    }

    /// The highest speed, steps/s.
    pub(crate) fn fastest(&self) -> f32 {
        max(self.cruise, self.easing.end_speed())
    }

    /// Squared speed at the end of the move or, where the profile ends within it, there; steps²/s².
    pub fn exit_v2(&self) -> f32 {
        let (speed, _) = self.motion(Place::at(self.end));
        speed * speed
    }

    /// Speed (steps/s) and acceleration (steps/s², signed) at a place.
    pub fn motion(&self, place: Place) -> (f32, f32) {
        let (x, y) = self.ends(place);
        let (speed, acceleration) = if y <= self.down.length() {
            let (speed, acceleration) = self.down.motion(y);
            (speed, -acceleration)
        } else if x < self.easing.length() {
            self.easing.motion(x)
        } else if x < self.head() {
            self.up.motion(x - self.easing.length())
        } else {
            (self.cruise, 0.0)
        };
        (speed * self.scale, acceleration * self.scale)
    }

    /// Time that the `steps` after `from` take (seconds), and the speed at their end (steps/s).
    #[inline(never)] // inlined, a trapezoid saves its registers as well; not measured by itself
    pub(crate) fn time_over(&self, from: Place, steps: f32) -> (f32, f32) {
        // As in `ends`, so that the end is met exactly.
        let ((x, y), steps) = (self.ends(from), steps * (1.0 / self.scale));
        let (head, tail) = (self.head(), self.down.length());
        let end = max(y - steps, 0.0);
        // Steps after the profile's end. Motion goes on as fast as half a step before rest.
        let after = max(steps - max(y, 0.0), 0.0);
        let first = max(min(head - x, steps - after), 0.0);
        let last = max(min(tail - end, steps - after - first), 0.0);
        let middle = steps - after - first - last;
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
            time += self.down.time(end, last);
            speed = self.down.motion(end).0;
        }
        if y <= steps {
            speed = self.down.start_speed();
            time += after / max(speed, ramp::half_a_step(self.limits.jerk));
        }
        (time, speed * self.scale)
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
        let speed = self.motion(from).0 / self.scale;
        let (left, peak) = if x < self.head() {
            let peak = max(self.easing.peak(), self.up.peak());
            let down = self.up.end_speed() < speed;
            (self.head() - x, if down { -peak } else { peak })
        } else if y > self.down.length() {
            (y - self.down.length(), 0.0)
        } else {
            (y, -self.down.peak())
        };
        let bent = sqrt(peak * peak + speed * self.limits.jerk / 3.0);
        let acceleration = if peak == 0.0 {
            0.0
        } else {
            bent.copysign(peak)
        };
        Stretch {
            steps: min(left * self.scale, from.before(self.end)) as u32,
            acceleration: acceleration * self.scale,
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
        let per_scale = 1.0 / self.scale;
        let left = place.before(self.end) * per_scale + self.beyond;
        (self.before + place.after(self.start) * per_scale, left)
    }
}

#[cfg(test)]
impl SCurve {
    /// Seconds from the start to the place `s` steps after it, in `f64`: the reference of the
    /// tests.
    pub(crate) fn exact_time(&self, s: f64) -> f64 {
        let length = self.start.exact_before(self.end) + f64::from(self.beyond);
        let [easing, up, down] = [&self.easing, &self.up, &self.down].map(Ramp::exact_length);
        let head = easing + up;
        let down = down.min(length - head); // a ramp under way at the start
        let mut time = self.easing.exact_time(s.min(easing));
        if s > easing {
            time += self.up.exact_time(s.min(head) - easing);
        }
        time += (s.min(length - down) - head).max(0.0) / f64::from(self.level);
        let left = length - s;
        if left < down {
            time += self.down.exact_time(down) - self.down.exact_time(left.max(0.0));
        }
        let after = max(self.last_speed(), ramp::half_a_step(self.limits.jerk));
        time + (-left).max(0.0) / f64::from(after)
    }
}

/// Steps from the start of a plan to its end.
fn length(plan: &Plan) -> f32 {
    plan.start.before(plan.end) + plan.beyond
}

/// The speed at the end of a plan, steps/s.
fn exit(plan: &Plan) -> f32 {
    min(sqrt(plan.exit_v2), plan.cruise)
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
    fn new(plan: &Plan, acceleration: f32, jerk: f32) -> Self {
        Self {
            speed: sqrt(plan.entry_v2),
            acceleration,
            limits: Limits {
                acceleration: min(plan.up, plan.down),
                jerk,
            },
        }
    }

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
    #[inline(never)] // inlined, a record of four motors takes 484 bytes more
    fn distance(&self, speed: f32) -> f32 {
        let (easing, up) = self.ramps(speed);
        easing.length() + up.length()
    }

    /// The speed nearest to `wanted` with which the profile may end after `length` steps, and the
    /// steps that are missing by rounding. `None` where braking takes longer.
    fn exit(&self, wanted: f32, length: f32) -> Option<(f32, f32)> {
        let missing = self.distance(wanted) - length;
        if missing <= 0.0 {
            return Some((wanted, 0.0));
        }
        let level = self.level();
        if wanted < level {
            return (missing <= rounding(length)).then_some((wanted, missing));
        }
        let fits = |speed| self.distance(speed) <= length;
        fits(level).then(|| (furthest(level, wanted, &fits), 0.0))
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
            furthest(slow, wanted, &fits)
        } else {
            furthest(exit, min(slow, wanted), &fits)
        }
    }
}

/// Finds by halving the speed nearest to `bad` that `fits`. `good` must fit, and `bad` must not.
pub(crate) fn furthest(mut good: f32, mut bad: f32, fits: &dyn Fn(f32) -> bool) -> f32 {
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
