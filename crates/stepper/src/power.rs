//! Laser or spindle power as the step interrupt sees it: a share of full power.

use fixed::types::{I1F31, U1F31};

/// Output power as a share of full power, 0 to 1 in steps of 2⁻³¹.
///
/// What *full* means (`$30`, the PWM timer's period) is decided outside this crate.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Hash)]
pub struct Power(U1F31);

/// How much [`Power`] changes from one tick to the next.
pub type PowerChange = I1F31;

impl Power {
    /// Output off.
    pub const OFF: Self = Self(U1F31::ZERO);
    /// Full power.
    pub const FULL: Self = Self(U1F31::ONE);

    /// Makes a power from a share of full power; more than full is full.
    pub fn from_share(share: U1F31) -> Self {
        Self(share.min(U1F31::ONE))
    }

    /// The share of full power, 0 to 1.
    pub const fn share(self) -> U1F31 {
        self.0
    }

    /// The compare value for a PWM timer of `period` counts, rounded down: 0 is off, `period` is full.
    ///
    /// Called from the step interrupt: one widening multiplication.
    pub const fn level(self, period: u16) -> u16 {
        ((self.0.to_bits() as u64 * period as u64) >> 31) as u16
    }

    /// This power after one more tick. Stays within 0 to 1.
    #[must_use]
    pub(crate) fn changed_by(self, change: PowerChange) -> Self {
        Self::from_share(self.0.saturating_add_signed(change))
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for Power {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "{=u32}/2^31", self.0.to_bits());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn full_power_is_the_whole_period_and_off_is_nothing() {
        assert_eq!(Power::FULL.level(8400), 8400);
        assert_eq!(Power::FULL.level(u16::MAX), u16::MAX);
        assert_eq!(Power::OFF.level(8400), 0);
    }

    #[test]
    fn a_change_never_leaves_the_range() {
        let step = PowerChange::from_num(0.75);
        assert_eq!(Power::OFF.changed_by(-step), Power::OFF);
        assert_eq!(Power::FULL.changed_by(step), Power::FULL);
        assert_eq!(Power::OFF.changed_by(step).level(100), 75);
    }
}
