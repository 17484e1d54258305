//! The arithmetic that instructions share: addition with carry, shifts, saturation (DDI 0403,
//! A2.2.1, A7.4.2).
use crate::instruction::Shift;

/// A sum, its carry and its signed overflow.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Sum {
    pub(super) value: u32,
    pub(super) carry: bool,
    pub(super) overflow: bool,
}

/// AddWithCarry. A subtraction is the addition of the complement, with a carry.
#[inline(always)]
pub(super) fn add(a: u32, b: u32, carry: bool) -> Sum {
    let wide = u64::from(a) + u64::from(b) + u64::from(carry);
    let value = wide as u32;
    Sum {
        value,
        carry: wide >> 32 != 0,
        overflow: ((a ^ value) & (b ^ value)) >> 31 != 0,
    }
}

/// Shift_C: the shifted value, and the last bit shifted out.
#[inline(always)]
pub(super) fn shift(value: u32, kind: Shift, amount: u32, carry: bool) -> (u32, bool) {
    if amount == 0 {
        return (value, carry);
    }
    match kind {
        Shift::Left => {
            let wide = u64::from(value) << amount.min(33);
            (wide as u32, wide >> 32 & 1 != 0)
        }
        Shift::Right => {
            let wide = (u64::from(value) << 1) >> amount.min(33);
            ((wide >> 1) as u32, wide & 1 != 0)
        }
        Shift::ArithmeticRight => {
            let wide = (i64::from(value as i32) << 1) >> amount.min(33);
            ((wide >> 1) as u32, wide & 1 != 0)
        }
        Shift::Rotate => {
            let rotated = value.rotate_right(amount & 31);
            (rotated, rotated >> 31 != 0)
        }
        Shift::RotateWithCarry => (value >> 1 | u32::from(carry) << 31, value & 1 != 0),
    }
}

/// SignedSatQ: the nearest value of `bits` bits, and whether it differs.
pub(super) fn saturate_signed(value: i64, bits: u32) -> (i64, bool) {
    let limit = 1i64 << (bits - 1);
    let saturated = value.clamp(-limit, limit - 1);
    (saturated, saturated != value)
}

/// Saturates a value to `bits` unsigned bits: UnsignedSatQ of the manual.
pub(super) fn saturate_unsigned(value: i64, bits: u32) -> (i64, bool) {
    let saturated = value.clamp(0, (1i64 << bits) - 1);
    (saturated, saturated != value)
}

/// Half of a register, sign-extended.
pub(super) fn half(value: u32, top: bool) -> i64 {
    i64::from(if top {
        (value >> 16) as i16
    } else {
        value as i16
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Shifts one bit at a time.
    fn slow_shift(mut value: u32, kind: Shift, amount: u32, mut carry: bool) -> (u32, bool) {
        for _ in 0..amount {
            let (low, high) = (value & 1 != 0, value >> 31 != 0);
            (value, carry) = match kind {
                Shift::Left => (value << 1, high),
                Shift::Right => (value >> 1, low),
                Shift::ArithmeticRight => (value >> 1 | value & 1 << 31, low),
                Shift::Rotate => (value.rotate_right(1), low),
                Shift::RotateWithCarry => (value >> 1 | u32::from(carry) << 31, low),
            };
        }
        (value, carry)
    }

    proptest! {
        #[test]
        fn shifts_are_repeated_shifts_by_one(value: u32, amount in 0u32..256, carry: bool) {
            for kind in [Shift::Left, Shift::Right, Shift::ArithmeticRight, Shift::Rotate] {
                prop_assert_eq!(shift(value, kind, amount, carry), slow_shift(value, kind, amount, carry));
            }
        }

        #[test]
        fn sums_carry_and_overflow_as_wide_ones_do(a: u32, b: u32, carry: bool) {
            let sum = add(a, b, carry);
            let unsigned = u64::from(a) + u64::from(b) + u64::from(carry);
            let signed = i64::from(a as i32) + i64::from(b as i32) + i64::from(carry);
            prop_assert_eq!(sum.carry, unsigned > u64::from(u32::MAX));
            prop_assert_eq!(sum.overflow, signed != i64::from(sum.value as i32));
        }
    }

    #[test]
    fn saturation_stops_at_both_ends() {
        assert_eq!(saturate_signed(128, 8), (127, true));
        assert_eq!(saturate_signed(-128, 8), (-128, false));
        assert_eq!(saturate_unsigned(-1, 8), (0, true));
        assert_eq!(saturate_unsigned(256, 8), (255, true));
    }
}
