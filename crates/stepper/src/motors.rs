//! Sets of motors, one bit a motor.

/// The largest number of motors that a [`MotorMask`] can name.
pub const MAX_MOTORS: usize = 8;

/// A set of motors: bit *m* stands for motor *m* (bit 0 is X where axes and motors coincide).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotorMask(u8);

impl MotorMask {
    /// No motor.
    pub const NONE: Self = Self(0);

    /// All eight motors.
    pub const ALL: Self = Self(u8::MAX);

    /// Makes a set from its bits.
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// Returns the set's bits.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Makes a set of the one motor `motor`; empty where `motor` is not below [`MAX_MOTORS`].
    pub const fn only(motor: usize) -> Self {
        if motor < MAX_MOTORS {
            Self(1 << motor)
        } else {
            Self::NONE
        }
    }

    /// Whether the set is empty.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether `motor` is in the set.
    pub const fn contains(self, motor: usize) -> bool {
        motor < MAX_MOTORS && self.0 >> motor & 1 == 1
    }

    /// The motors that are in either set.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The motors of this set that are not in `other`.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motor_beyond_the_last_is_in_no_set() {
        assert_eq!(MotorMask::only(MAX_MOTORS), MotorMask::NONE);
        assert!(!MotorMask::from_bits(0xFF).contains(MAX_MOTORS));
    }

    #[test]
    fn with_and_without_undo_each_other() {
        let xz = MotorMask::only(0).with(MotorMask::only(2));
        assert_eq!(xz.bits(), 0b101);
        assert_eq!(xz.without(MotorMask::only(2)), MotorMask::only(0));
    }
}
