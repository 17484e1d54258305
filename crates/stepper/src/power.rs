//! Laser or spindle power as the step interrupt sees it: a share of full power.

use fixed::types::{I1F31, U1F31};

/// Output power as a share of full power, 0 to 1 in steps of 2⁻³¹.
///
/// *Full* is defined outside this crate, by `$30` and the PWM timer's period.
///
/// Stored as power minus full power, -2³¹ to 0. The processor's saturating addition stops at the
/// lower end; a positive sum shows that the upper end was passed.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub struct Power {
    missing: i32,
}

/// How much [`Power`] changes from one tick to the next.
pub type PowerChange = I1F31;

/// Turns a [`Power`] into the compare value of a PWM timer.
///
/// It is twice the timer's period. A share has 31 bits after the point, so the upper 32 bits of the
/// product of both are the compare value: nothing has to be shifted.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PowerScale(u32);

impl PowerScale {
    /// Makes the scale of a timer of `period` counts.
    pub const fn new(period: u16) -> Self {
        Self((period as u32) << 1)
    }
}

/// The bits of full power.
const FULL_BITS: u32 = U1F31::ONE.to_bits();

impl Power {
    /// Output off.
    pub const OFF: Self = Self { missing: i32::MIN };
    /// Full power.
    pub const FULL: Self = Self { missing: 0 };

    /// Makes a power from a share of full power; more than full is full.
    pub fn from_share(share: U1F31) -> Self {
        let missing = share.to_bits().wrapping_sub(FULL_BITS).cast_signed();
        Self {
            missing: missing.min(0),
        }
    }

    /// The share of full power, 0 to 1.
    pub const fn share(self) -> U1F31 {
        U1F31::from_bits(self.missing.cast_unsigned().wrapping_add(FULL_BITS))
    }

    /// The compare value for a PWM timer whose period has the scale `scale`, rounded down: 0 is
    /// off, the period is full.
    ///
    /// Called from the step interrupt: one widening multiplication.
    #[inline]
    pub const fn level(self, scale: PowerScale) -> u32 {
        ((self.share().to_bits() as u64 * scale.0 as u64) >> 32) as u32
    }

    /// This power after one more tick. Stays within 0 to 1.
    #[must_use]
    #[inline]
    pub(crate) fn changed_by(self, change: PowerChange) -> Self {
        Self {
            missing: self.missing.saturating_add(change.to_bits()).min(0),
        }
    }
}

impl Default for Power {
    fn default() -> Self {
        Self::OFF
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for Power {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "{=u32}/2^31", self.share().to_bits());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn full_power_is_the_whole_period_and_off_is_nothing() {
        assert_eq!(Power::FULL.level(PowerScale::new(8400)), 8400);
        assert_eq!(
            Power::FULL.level(PowerScale::new(u16::MAX)),
            u32::from(u16::MAX)
        );
        assert_eq!(Power::OFF.level(PowerScale::new(8400)), 0);
    }

    #[test]
    fn a_change_never_leaves_the_range() {
        let step = PowerChange::from_num(0.75);
        assert_eq!(Power::OFF.changed_by(-step), Power::OFF);
        assert_eq!(Power::FULL.changed_by(step), Power::FULL);
        assert_eq!(Power::OFF.changed_by(step).level(PowerScale::new(100)), 75);
    }

    #[test]
    fn more_than_full_is_full() {
        assert_eq!(Power::from_share(U1F31::MAX), Power::FULL);
        assert_eq!(Power::from_share(U1F31::ZERO), Power::default());
    }

    proptest! {
        /// Compares with sums of 64 bits, which cannot overflow.
        #[test]
        fn a_change_is_an_addition_kept_within_the_range(share in 0u32..=1 << 31, change: i32) {
            let power = Power::from_share(U1F31::from_bits(share));
            prop_assert_eq!(power.share().to_bits(), share);
            let sum = i64::from(share) + i64::from(change);
            let changed = power.changed_by(PowerChange::from_bits(change));
            prop_assert_eq!(i64::from(changed.share().to_bits()), sum.clamp(0, 1 << 31));
        }
    }
}
