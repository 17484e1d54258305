//! Places in the plane.

use crate::Mm;
use std::ops::{Add, Neg, Sub};

/// A place in X and Y, or the way from one to another.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default, Debug)]
pub struct Point {
    /// The coordinate that grows to the right.
    pub x: Mm,
    /// The coordinate that grows away from the operator.
    pub y: Mm,
}

impl Point {
    /// The point X0 Y0.
    pub const ORIGIN: Self = Self {
        x: Mm::ZERO,
        y: Mm::ZERO,
    };
}

impl Add for Point {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            x: self.x + other.x,
            y: self.y + other.y,
        }
    }
}

impl Sub for Point {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Neg for Point {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            x: -self.x,
            y: -self.y,
        }
    }
}
