//! The arc that a move is a chord of.

use crate::real::sqrt;

/// An arc's curvature, and the bound of the acceleration on it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Curve {
    /// Radius, mm, above 0.
    pub radius: f32,
    /// The acceleration in every direction of its plane, mm/s²: the smaller acceleration of the
    /// plane's two axes, above 0.
    pub acceleration: f32,
}

impl Curve {
    /// Returns the highest speed at which the arc can be passed in every direction, mm/s:
    /// `v² = a·R`.
    pub fn top_speed(self) -> f32 {
        sqrt(self.acceleration * self.radius)
    }

    /// Returns how far the ends of chords may be from the circle on each axis, mm: two units of
    /// length of the `window`, and the rounding of `f32` (see `arc`).
    pub(crate) fn rounding(self) -> f32 {
        2e-6 + 4e-7 * self.radius
    }
}
