//! How fast a curve may be taken, and what that leaves for speeding up and slowing down on it.
//!
//! ```text
//!          a_t            On a circle of radius R the speed v takes the acceleration a_n = v²/R towards the centre. What is
//!    ----+-----> u        left for the ramps lies along the path: a_n² + a_t² ≤ a².
//!        |                A move's ramps have one acceleration, so a_t is what the fastest speed of the move leaves. That
//!        v a_n            speed is bounded at a_n = 0.8·a, where a_t = 0.6·a is left.
//! ```
//!
//! Why 0.8: the whole acceleration for a_n leaves none for ramps, so that a curve could never be left for a stop.
//! From rest to rest round a full circle takes `(2π/√n + √n/√(1−n²))·√(R/a)` with the share `n`; that is 8.52 at
//! 0.8, its minimum, 8.80 at 0.9, 8.68 at 0.7 (7.33 if `a_t` could follow the speed all the way). Half a circle
//! takes 5.00 at 0.8, 4.93 at its minimum, 0.7.

use crate::config::MARGIN;
use crate::real::{least, sqrt};

/// An arc's curvature, and what bounds the acceleration on it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Curve {
    /// Radius, mm, above 0.
    pub radius: f32,
    /// What every direction in its plane allows, mm/s²: the smaller acceleration of the plane's two axes.
    pub acceleration: f32,
}

/// Share of the acceleration that the curvature may take at most.
const NORMAL_SHARE: f32 = 0.8;

/// What a curve leaves to the moves on it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Bend {
    /// Highest speed, mm/s.
    pub(crate) rate: f32,
    /// Highest acceleration along the path, mm/s².
    pub(crate) ramps: f32,
}

impl Curve {
    /// The highest speed, mm/s.
    pub fn top_speed(self) -> f32 {
        sqrt(self.top_v2())
    }

    /// What it leaves to a move whose squared speed is `top_v2` (mm²/s²) at most.
    pub(crate) fn bend(self, top_v2: f32) -> Bend {
        let v2 = self.top_v2();
        Bend {
            rate: sqrt(v2),
            ramps: self.left_for_ramps(least(v2, top_v2)),
        }
    }

    /// The highest squared speed, mm²/s².
    pub(crate) fn top_v2(self) -> f32 {
        NORMAL_SHARE * self.pull()
    }

    /// The acceleration along the path, mm/s², that is left where the squared speed is `v2` (mm²/s²) at most.
    pub(crate) fn left_for_ramps(self, v2: f32) -> f32 {
        let share = least(self.share(v2), NORMAL_SHARE);
        self.acceleration * MARGIN * sqrt(1.0 - share * share)
    }

    /// The share of the acceleration that the curvature takes at the squared speed `v2`, mm²/s².
    pub(crate) fn share(self, v2: f32) -> f32 {
        v2 / self.pull()
    }

    /// The squared speed at which the curvature would take the whole acceleration, mm²/s².
    fn pull(self) -> f32 {
        self.acceleration * MARGIN * self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_curve_and_the_ramps_share_the_acceleration(radius in 0.01f32..1000.0, acceleration in 1.0f32..10_000.0, share in 0.0f32..1.0) {
            let curve = Curve { radius, acceleration };
            let v2 = curve.top_v2() * share;
            let [v2, radius, a, ramp] = [v2, radius, acceleration, curve.left_for_ramps(v2)].map(f64::from);
            let total = (v2 / radius).hypot(ramp) / a;
            prop_assert!(total <= 1.0 && total > 0.99999, "{}", total);
        }
    }
}
