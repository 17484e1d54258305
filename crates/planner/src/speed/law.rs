//! The law by which speed changes along a move: constant acceleration, or limited jerk.

use crate::real::sqrt;
use crate::speed::profile::{Place, Plan, Stretch};
use crate::{SCurve, Trapezoid};

/// Speed and time along one move, by either law.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Profile {
    /// Ramps of constant acceleration.
    Trapezoid(Trapezoid),
    /// Ramps of limited jerk.
    SCurve(SCurve),
}

impl Profile {
    /// Becomes the fastest profile for `plan`, from its start on. `jerk` (steps/s³) is kept if it
    /// is above 0. The profile stays as it is where the acceleration under way cannot fall to 0
    /// before the end.
    pub(crate) fn change(&mut self, plan: &Plan, jerk: f32) {
        if jerk <= 0.0 {
            *self = Self::Trapezoid(Trapezoid::new(plan));
            return;
        }
        let (_, acceleration) = self.motion(plan.start);
        if let Some(curve) = SCurve::new(plan, acceleration, jerk) {
            *self = Self::SCurve(curve);
        }
    }

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
    pub const fn exit_v2(&self) -> f32 {
        match self {
            Self::Trapezoid(of) => of.exit_v2(),
            Self::SCurve(of) => of.exit_v2(),
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
