//! A change of speed whose acceleration changes no faster than a set jerk.
//!
//! ```text
//!  a      ______          ease:   the acceleration grows by `jerk` a second for `ease` seconds
//!        /      \         steady: it stays for `steady` seconds (none where the change is small)
//!       /        \        ease:   it falls to 0 again
//!      0          1  t
//! ```
//!
//! The speed is symmetrical about the middle of the ramp, so its mean is `(v0 + v1)/2` and
//!
//! ```text
//!   peak   = min(a, √(jerk·|v1 − v0|))      ease = peak/jerk      steady = |v1 − v0|/peak − ease
//!   length = (v0 + v1)/2 · (2·ease + steady)
//! ```
//!
//! (L. Biagiotti, C. Melchiorri, *Trajectory Planning for Automatic Machines and Robots*, 2008,
//! section 3.4: the double-S profile.) Places are reckoned from the nearer end, where speeds are
//! exact and nothing cancels.
//!
//! A ramp can also begin when its acceleration has grown already: [`Ramp::joined`].

use crate::real::{max, min, rough_cube_root, sqrt};

/// One ramp: steps, steps/s, seconds.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Ramp {
    /// Speeds at its ends, steps/s.
    v0: f32,
    v1: f32,
    /// Jerk in the first ease, signed, steps/s³.
    jerk: f32,
    /// Duration of each of the two eases, seconds.
    ease: f32,
    /// Time at the largest acceleration, seconds.
    steady: f32,
    /// Lengths of the first ease and of the last one, steps.
    first: f32,
    last: f32,
    /// Length of the whole ramp, steps.
    whole: f32,
    /// The part that was over when the ramp was joined: seconds, and steps.
    skipped: (f32, f32),
}

/// The limits of a ramp.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Limits {
    /// Largest acceleration, steps/s², above 0.
    pub(crate) acceleration: f32,
    /// Largest jerk, steps/s³, above 0.
    pub(crate) jerk: f32,
}

impl Limits {
    /// The shortest times in which the speed changes by `change` steps/s: the time of each ease,
    /// and the time of the steady part, seconds. Rounded up.
    #[inline(never)] // inlined, a record of four motors takes 192 bytes more
    fn times(self, change: f32) -> (f32, f32) {
        let (a, jerk) = (self.acceleration * SAFE, self.jerk * SAFE);
        let longest = a / jerk;
        if change > a * longest {
            (longest, change / a - longest)
        } else {
            (sqrt(change / jerk), 0.0)
        }
    }
}

/// Room for the rounding of a ramp's times (a few 2⁻²⁴), so that neither limit is exceeded.
const SAFE: f32 = 1.0 - 1.0 / (1 << 20) as f32;

impl Ramp {
    /// The shortest ramp from the speed `v0` to `v1`, steps/s.
    pub(crate) fn between(v0: f32, v1: f32, limits: Limits) -> Self {
        Self::new(v0, v1, v1 - v0, limits)
    }

    /// The shortest ramp from `v0` to `v1`. `change` is `v1 - v0`; the caller may know it more
    /// exactly than the difference of the two.
    fn new(v0: f32, v1: f32, change: f32, limits: Limits) -> Self {
        let (ease, steady) = limits.times(change.abs());
        // The jerk follows from the times, so that the ramp ends at `v1` exactly.
        let turn = ease * (ease + steady);
        let jerk = if turn > 0.0 { change / turn } else { 0.0 };
        let bend = jerk * ease * ease * ease / 6.0;
        Self {
            v0,
            v1,
            jerk,
            ease,
            steady,
            first: v0 * ease + bend,
            last: v1 * ease - bend,
            whole: 0.5 * (v0 + v1) * (2.0 * ease + steady),
            skipped: (0.0, 0.0),
        }
    }

    /// A ramp of no length at the speed `speed`.
    pub(crate) fn none(speed: f32) -> Self {
        Self {
            v0: speed,
            v1: speed,
            jerk: 0.0,
            ease: 0.0,
            steady: 0.0,
            first: 0.0,
            last: 0.0,
            whole: 0.0,
            skipped: (0.0, 0.0),
        }
    }

    /// The rest of a ramp to `v1` whose beginning is over: motion has `speed` and `acceleration`
    /// (signed, not 0, towards `v1`). `None` where `v1` is too near: the acceleration would have to
    /// fall at once.
    pub(crate) fn joined(speed: f32, acceleration: f32, v1: f32, limits: Limits) -> Option<Self> {
        let past = eased(acceleration, limits);
        let ramp = Self::new(max(speed - past, 0.0), v1, v1 - speed + past, limits);
        let grown = acceleration / ramp.jerk;
        (grown >= 0.0 && grown <= ramp.ease).then(|| ramp.skip(grown))
    }

    /// The shortest ramp over which the acceleration falls to 0, from `speed` and `acceleration`
    /// (signed), which may be above the limit.
    pub(crate) fn easing(speed: f32, acceleration: f32, limits: Limits) -> Self {
        let change = eased(acceleration, limits);
        let limits = Limits {
            acceleration: max(limits.acceleration, acceleration.abs()),
            ..limits
        };
        let (before, after) = (max(speed - change, 0.0), max(speed + change, 0.0));
        let ramp = Self::new(before, after, 2.0 * change, limits);
        ramp.skip(ramp.ease)
    }

    /// The rest of the ramp after `time` seconds.
    fn skip(self, time: f32) -> Self {
        Self {
            skipped: (time, self.place(time)),
            ..self
        }
    }

    /// The whole ramp, seen from the end and backwards in time.
    pub(crate) fn backwards(self) -> Self {
        Self {
            v0: self.v1,
            v1: self.v0,
            jerk: -self.jerk,
            first: self.last,
            last: self.first,
            skipped: (0.0, 0.0),
            ..self
        }
    }

    /// Speed at the start, steps/s (of the whole ramp, where it was joined).
    pub(crate) const fn start_speed(&self) -> f32 {
        self.v0
    }

    /// Speed at the end, steps/s.
    pub(crate) const fn end_speed(&self) -> f32 {
        self.v1
    }

    /// Length in steps; in general not a whole number.
    pub(crate) fn length(&self) -> f32 {
        max(self.whole - self.skipped.1, 0.0)
    }

    /// The time of the `steps` after the place `x`, seconds. `x` is counted in steps from the
    /// start.
    ///
    /// The times of the parts are added up; within a part, the time follows from the speeds at its
    /// ends. The caller may know `steps` more exactly than the difference of two places.
    pub(crate) fn time(&self, x: f32, steps: f32) -> f32 {
        let x = x + self.skipped.1;
        let (first, last) = (self.first, max(self.whole - self.last, self.first));
        let eased = max(min(first - x, steps), 0.0);
        let steady = max(min(last - x, steps), eased);
        self.part(x, eased, self.jerk)
            + self.part(x + eased, steady - eased, 0.0)
            + self.part(x + steady, steps - steady, -self.jerk)
    }

    /// The time of the `steps` after the place `x0` within one part that has the jerk `jerk`,
    /// seconds. Newton's method solves `steps = (v0 + v1)/2·t − jerk·t³/12` for the time `t`.
    fn part(&self, x0: f32, steps: f32, jerk: f32) -> f32 {
        const ROUNDS: u32 = 3;
        if steps <= 0.0 {
            return 0.0;
        }
        let x1 = x0 + steps;
        let (v0, v1) = (self.speed_at(x0), self.speed_at(x1));
        if jerk != 0.0 && min(v0, v1) < 0.5 * max(v0, v1) {
            // Near rest Newton's method would not settle. The difference of two times is exact
            // enough there.
            return self.whole_time(x1) - self.whole_time(x0);
        }
        let mean = 0.5 * (v0 + v1);
        if mean <= 0.0 {
            return 0.0;
        }
        // Beyond the ramp's end by rounding, the speed does not change.
        let most = (v1 - v0).abs();
        let mut time = steps / mean;
        for _ in 0..ROUNDS {
            let bend = max(min(0.25 * jerk * time * time, most), -most);
            time -= (time * (mean - bend / 3.0) - steps) / (mean - bend);
        }
        time
    }

    /// Speed (steps/s) and acceleration (steps/s², signed) at the place `x` steps after the start.
    pub(crate) fn motion(&self, x: f32) -> (f32, f32) {
        self.motion_at(x + self.skipped.1)
    }

    /// As [`Ramp::motion_at`], the speed alone.
    fn speed_at(&self, x: f32) -> f32 {
        self.motion_at(x).0
    }

    /// As [`Ramp::motion`], at the place `x` of the whole ramp.
    fn motion_at(&self, x: f32) -> (f32, f32) {
        let time = self.whole_time(x);
        let left = self.duration() - time;
        if time <= self.ease {
            (self.v0 + 0.5 * self.jerk * time * time, self.jerk * time)
        } else if left <= self.ease {
            (self.v1 - 0.5 * self.jerk * left * left, self.jerk * left)
        } else {
            let peak = self.jerk * self.ease;
            (self.v0 + peak * (time - 0.5 * self.ease), peak)
        }
    }

    /// The largest acceleration, steps/s², without sign.
    pub(crate) fn peak(&self) -> f32 {
        (self.jerk * self.ease).abs()
    }

    /// Time of the whole ramp, seconds.
    fn duration(&self) -> f32 {
        2.0 * self.ease + self.steady
    }

    /// The place in the whole ramp after `time` seconds, steps. Not for the last ease.
    fn place(&self, time: f32) -> f32 {
        let late = max(time - self.ease, 0.0);
        let early = min(time, self.ease);
        let peak = self.jerk * self.ease;
        let speed = self.v0 + 0.5 * peak * self.ease;
        self.v0 * early
            + self.jerk * early * early * early / 6.0
            + late * (speed + 0.5 * peak * late)
    }

    /// Time from the start of the whole ramp to the place `x`, seconds.
    fn whole_time(&self, x: f32) -> f32 {
        let left = self.whole - x;
        if x <= self.first {
            solve(self.v0, self.jerk, x)
        } else if left <= self.last {
            self.duration() - solve(self.v1, -self.jerk, left)
        } else {
            let peak = self.jerk * self.ease;
            let speed = self.v0 + 0.5 * peak * self.ease;
            let past = x - self.first;
            let time = 2.0 * past / (speed + sqrt(speed * speed + 2.0 * peak * past));
            self.ease + min(time, self.steady)
        }
    }
}

/// How much the speed changes until `acceleration` (signed) has fallen to 0, steps/s.
fn eased(acceleration: f32, limits: Limits) -> f32 {
    0.5 * acceleration * acceleration.abs() / (limits.jerk * SAFE)
}

/// Steps of the shortest ramp between two speeds, steps/s.
pub(crate) fn length(v0: f32, v1: f32, limits: Limits) -> f32 {
    let (ease, steady) = limits.times((v1 - v0).abs());
    0.5 * (v0 + v1) * (2.0 * ease + steady)
}

/// Seconds of the shortest ramp between two speeds.
pub(crate) fn duration(v0: f32, v1: f32, limits: Limits) -> f32 {
    let (ease, steady) = limits.times((v1 - v0).abs());
    2.0 * ease + steady
}

/// Roughly the speed half a step after a start from rest, steps/s: a ramp from rest to `v` has the
/// length `v^(3/2)/√jerk`.
pub(crate) fn half_a_step(jerk: f32) -> f32 {
    rough_cube_root(0.25 * jerk)
}

/// The first time at which `v·t + jerk·t³/6` is `x`, with `v` at least 0.
///
/// Newton's method begins on the side from which it converges without overshooting. Where both
/// terms have the same sign, each alone takes longer than the two together. Where the speed falls,
/// the time at the steady speed `v` is too short.
fn solve(v: f32, jerk: f32, x: f32) -> f32 {
    const ROUNDS: u32 = 5;
    if x <= 0.0 {
        return 0.0;
    }
    let alone = if jerk > 0.0 {
        ROOT_MARGIN * rough_cube_root(6.0 * x / jerk)
    } else {
        f32::INFINITY
    };
    let mut time = min(x / v, alone);
    for _ in 0..ROUNDS {
        let bend = jerk * time * time;
        let slope = v + 0.5 * bend;
        if slope > 0.0 {
            time -= (time * (v + bend / 6.0) - x) / slope;
        }
    }
    time
}

/// A factor that corrects the rough cube root, which is at least 0.93 of the true one.
const ROOT_MARGIN: f32 = 1.0 / 0.93;

/// The reference of the tests, in `f64`.
#[cfg(test)]
impl Ramp {
    /// Place and speed after `t` seconds, by integrating the three parts one after the other. Of a
    /// joined ramp `t` counts from the start of the whole ramp.
    fn exact(&self, t: f64) -> (f64, f64) {
        let (ease, steady) = (f64::from(self.ease), f64::from(self.steady));
        let (mut x, mut v, mut a, mut left) = (0.0, f64::from(self.v0), 0.0, t);
        let jerk = f64::from(self.jerk);
        for (duration, jerk) in [(ease, jerk), (steady, 0.0), (ease, -jerk)] {
            let t = duration.min(left);
            x += v * t + a * t * t / 2.0 + jerk * t * t * t / 6.0;
            v += a * t + jerk * t * t / 2.0;
            a += jerk * t;
            left -= t;
        }
        (x, v)
    }

    fn exact_duration(&self) -> f64 {
        2.0 * f64::from(self.ease) + f64::from(self.steady)
    }

    /// Its length from where it was joined, steps.
    pub(crate) fn exact_length(&self) -> f64 {
        self.exact(self.exact_duration()).0 - self.exact(self.skipped.0.into()).0
    }

    /// Seconds to the place `x` steps after where it was joined, by halving.
    pub(crate) fn exact_time(&self, x: f64) -> f64 {
        let joined = f64::from(self.skipped.0);
        let place = x + self.exact(joined).0;
        let (mut early, mut late) = (joined, self.exact_duration());
        for _ in 0..100 {
            let middle = 0.5 * (early + late);
            if middle == early || middle == late {
                break; // no number lies between them
            }
            if self.exact(middle).0 < place {
                early = middle;
            } else {
                late = middle;
            }
        }
        late - joined
    }
}

#[cfg(test)]
mod tests;
