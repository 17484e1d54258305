//! Checks a running move against the settings in exact arithmetic.

use super::program::{Circle, Cut};
use crate::speed::plan::Place;
use crate::{Config, CornerRule, Curve, Trapezoid};
use num_rational::BigRational;
use num_traits::ToPrimitive;
use std::{format, string::String};

/// The largest used share of each limit.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Worst {
    pub(super) rate: f64,
    pub(super) acceleration: f64,
    pub(super) arc: f64,
    pub(super) corner: f64,
    pub(super) curve: f64,
    pub(super) jump: f64,
}

impl Worst {
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            rate: self.rate.max(other.rate),
            acceleration: self.acceleration.max(other.acceleration),
            arc: self.arc.max(other.arc),
            corner: self.corner.max(other.corner),
            curve: self.curve.max(other.curve),
            jump: self.jump.max(other.jump),
        }
    }
}

fn exact(x: f32) -> BigRational {
    BigRational::from_float(x).expect("a number")
}

fn whole(x: i64) -> BigRational {
    BigRational::from_integer(x.into())
}

fn float(x: &BigRational) -> f64 {
    x.to_f64().expect("a number")
}

/// Returns by how much a profile changes the squared speed from its start to its end beyond its
/// accelerations, as a share of the greater of the two squared speeds: the effect of rounding.
fn joint(profile: &Trapezoid) -> f64 {
    let (entry, exit) = (exact(profile.entry_v2()), exact(profile.exit_v2()));
    let [up, down] = profile.accelerations().map(|a| exact(a.abs()));
    let start = profile.start();
    let length = whole((Place::at(profile.end()).units() - start.units()) as i64) / whole(1 << 32);
    let change = if entry > exit {
        &entry - &exit
    } else {
        &exit - &entry
    };
    let more = change - whole(2) * up.max(down) * length;
    let most = exact(profile.entry_v2().max(profile.exit_v2()).max(1.0));
    float(&(more / most)).max(0.0)
}

/// A move that runs, with its geometry.
pub(crate) struct Leg {
    delta: [i32; 2],
    /// mm of each axis in a step of the dominant motor.
    share: [BigRational; 2],
    /// The length, mm.
    length: f64,
    pub(crate) u: [f64; 2],
    curve: Option<Curve>,
    circle: Option<Circle>,
}

impl Leg {
    pub(crate) fn new(cut: &Cut, delta: [i32; 2], scale: [i64; 2]) -> Self {
        let events = i64::from(delta[0].abs().max(delta[1].abs()));
        let mm = [0, 1].map(|i| f64::from(delta[i]) / scale[i] as f64);
        let length = mm[0].hypot(mm[1]);
        Self {
            delta,
            share: [0, 1].map(|i| whole(delta[i].abs().into()) / whole(scale[i]) / whole(events)),
            length,
            u: mm.map(|mm| mm / length),
            curve: cut.of.curve,
            circle: cut.circle,
        }
    }

    /// Joins this leg with the short leg after it, as the planner does.
    pub(crate) fn joined(&mut self, cut: &Cut, delta: [i32; 2], scale: [i64; 2]) {
        let delta = [0, 1].map(|i| delta[i] + self.delta[i]);
        let circle = self.circle.zip(cut.circle);
        let circle = circle.and_then(|(first, last)| first.joined(last));
        *self = Self {
            circle,
            ..Self::new(cut, delta, scale)
        };
    }

    /// The square of the path in a step, mm².
    fn step2(&self) -> BigRational {
        self.share.iter().map(|share| share * share).sum()
    }

    /// Returns true if a profile leads to its end.
    pub(super) fn ends_with(&self, profile: &Trapezoid) -> bool {
        let steps = self.delta.iter().map(|steps| steps.unsigned_abs());
        steps.max() == Some(profile.end())
    }

    /// The squared speeds of a profile at the ends of the move, steps²/s², or 0 at an end that it
    /// does not reach. The path turns at its ends: between them, the first chord of an arc may be
    /// faster, and an override may begin a profile there.
    fn speeds_at_ends(&self, profile: &Trapezoid) -> [f32; 2] {
        let at_start = profile.start() == Place::at(0);
        let entry_v2 = if at_start { profile.entry_v2() } else { 0.0 };
        let ends = self.ends_with(profile);
        let exit_v2 = if ends { profile.exit_v2() } else { 0.0 };
        [entry_v2, exit_v2]
    }

    pub(super) fn v2(&self, steps_v2: f32) -> f64 {
        f64::from(steps_v2) * float(&self.step2())
    }

    /// Checks one profile against the settings.
    pub(super) fn check(&self, profile: &Trapezoid, limits: &Config<2>) -> Result<Worst, String> {
        let mut worst = Worst {
            jump: joint(profile),
            ..Worst::default()
        };
        let [up, down] = profile.accelerations().map(|a| exact(a.abs()));
        let a = up.max(down);
        for (axis, share) in self.share.iter().enumerate() {
            let rate = exact(profile.cruise()) * share / exact(limits.max_rate[axis]);
            let acceleration = &a * share / exact(limits.acceleration[axis]);
            if rate > whole(1) || acceleration > whole(1) {
                return Err(format!(
                    "axis {axis}: rate {} acceleration {}",
                    float(&rate),
                    float(&acceleration)
                ));
            }
            worst.rate = worst.rate.max(float(&rate));
            worst.acceleration = worst.acceleration.max(float(&acceleration));
        }
        if limits.corner_rule == CornerRule::Limits {
            let [entry_v2, exit_v2] = self.speeds_at_ends(profile);
            worst.arc = self.curve.map_or(0.0, |curve| {
                let v2 = entry_v2.max(exit_v2);
                self.on_circle(v2, 1.0 / f64::from(curve.radius), limits)
            });
            worst.curve = self.circle.map_or(0.0, |circle| {
                let [start, end] = circle.ends(self.length);
                let start = self.on_circle(entry_v2, start, limits);
                start.max(self.on_circle(exit_v2, end, limits))
            });
            if worst.arc > 1.0 || worst.curve > 1.1 {
                return Err(format!("arc: {} curve: {}", worst.arc, worst.curve));
            }
        }
        Ok(worst)
    }

    /// The largest share of an axis's acceleration that a curvature (1/mm) takes at a squared
    /// speed. The direction is as uncertain as a chord and rounding make it. (The step edges show
    /// the part that is left to ramps: `edges_tests`.)
    fn on_circle(&self, steps_v2: f32, curvature: f64, limits: &Config<2>) -> f64 {
        let rounding = limits.steps_per_mm.map(|steps| 1e9 / steps.nanos() as f64);
        let unsure =
            self.length * curvature + 2.0 * (rounding[0] + rounding[1] + 0.002) / self.length;
        let pull = self.v2(steps_v2) * curvature;
        let share = |axis: usize| {
            let normal = (self.u[1 - axis].abs() - unsure).max(0.0);
            normal * pull / f64::from(limits.acceleration[axis])
        };
        share(0).max(share(1))
    }

    /// Returns true if the leg is so long that rounding hides no corner at its ends: longer than 40
    /// of the coarsest steps, and than half a millimetre.
    pub(crate) fn stands_alone(&self, limits: &Config<2>) -> bool {
        let steps = limits
            .steps_per_mm
            .iter()
            .map(|steps| 40e9 / steps.nanos() as f64);
        limits.corner_rule == CornerRule::Grbl
            || self.curve.is_none()
                && self.circle.is_none()
                && self.length > steps.fold(0.5, f64::max)
    }
}

/// Junction deviation between two legs, by the book.
pub(crate) fn corner_v2(before: &Leg, after: &Leg, limits: &Config<2>) -> f64 {
    let [x0, y0] = before.u;
    let [x1, y1] = after.u;
    let (dot, cross) = (x0 * x1 + y0 * y1, x0 * y1 - y0 * x1);
    if dot > 0.999_999 {
        return f64::INFINITY;
    }
    // 1 + dot, and 1 − dot, each without cancellation
    let (plus, minus) = if dot < 0.0 {
        (cross * cross / (1.0 - dot), 1.0 - dot)
    } else {
        (1.0 + dot, cross * cross / (1.0 + dot))
    };
    if plus < 1e-6 {
        return 0.0;
    }
    let (s, change) = ((plus / 2.0).sqrt(), (2.0 * minus).sqrt());
    let a = (0..2)
        .map(|i| f64::from(limits.acceleration[i]) * change / (after.u[i] - before.u[i]).abs())
        .fold(f64::INFINITY, f64::min);
    a * f64::from(limits.junction_deviation) * s * (1.0 + s) / (minus / 2.0)
}
