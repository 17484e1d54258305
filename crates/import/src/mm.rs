//! Lengths without rounding.

use leadscrew_gcode::Number;
use std::fmt;
use std::ops::{Add, AddAssign, Neg, Sub};

/// A length or coordinate in mm, exact to 1e-9 mm.
///
/// Readers accept lengths up to [`Mm::LIMIT`], so that sums of a few lengths never overflow.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Debug)]
pub struct Mm(i64);

impl Mm {
    /// The length 0.
    pub const ZERO: Self = Self(0);
    /// The longest length that is read, 100 m.
    pub const LIMIT: Self = Self::from_nanos(100_000 * 1_000_000_000);
    /// The reciprocal of a computed coordinate's resolution: 0.0001 mm.
    const COMPUTED: f64 = 1e4;

    /// Makes a length of `nanos` 1e-9 mm.
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// Returns the length in 1e-9 mm.
    pub const fn nanos(self) -> i64 {
        self.0
    }

    /// Returns the multiple of 0.0001 mm nearest to a computed length; `None` beyond [`Mm::LIMIT`].
    pub fn computed(mm: f64) -> Option<Self> {
        let is_near = mm.abs() <= Self::LIMIT.to_f64();
        is_near.then(|| Self((mm * Self::COMPUTED).round() as i64 * 100_000))
    }

    /// Returns the length as a float, for computing times and angles.
    pub fn to_f64(self) -> f64 {
        self.0 as f64 / 1e9
    }

    /// Returns the length without its sign.
    pub const fn abs(self) -> Self {
        Self(self.0.abs())
    }
}

impl Add for Mm {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl AddAssign for Mm {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Mm {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl Neg for Mm {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl From<Number> for Mm {
    fn from(number: Number) -> Self {
        Self(number.nanos())
    }
}

impl fmt::Display for Mm {
    /// Writes the shortest decimal that is exactly this length: `7.62`, `-0.5`, `40`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&Number::from_nanos(self.0), f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_written_as_a_person_would() {
        for (nanos, text) in [
            (7_620_000_000, "7.62"),
            (-500_000_000, "-0.5"),
            (40_000_000_000, "40"),
            (0, "0"),
        ] {
            assert_eq!(Mm::from_nanos(nanos).to_string(), text);
        }
    }

    #[test]
    fn computed_lengths_have_four_decimals_and_a_limit() {
        assert_eq!(Mm::computed(1.0 / 3.0).unwrap().to_string(), "0.3333");
        assert_eq!(Mm::computed(-0.00001).unwrap().to_string(), "0");
        assert_eq!(Mm::computed(1e9), None);
        assert_eq!(Mm::computed(f64::NAN), None);
    }
}
