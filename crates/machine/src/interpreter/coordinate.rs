//! Positions, exactly: stands in for the planner's type of the same name.

use core::ops::{Add, Sub};

/// A position along an axis, in 10⁻⁹ mm (or degrees on a rotary axis).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Coordinate(i64);

impl Coordinate {
    /// The origin.
    pub const ZERO: Self = Self(0);

    /// Makes a coordinate of a count of 10⁻⁹ mm or degrees.
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// Answers the count of 10⁻⁹ mm or degrees.
    pub const fn nanos(self) -> i64 {
        self.0
    }
}

impl Add for Coordinate {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for Coordinate {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}
