//! The numbers of programs: decimals with 18 places.

use crate::fault::Math;
use leadscrew_gcode::Number;

/// 1, as a count of 10⁻¹⁸.
const ONE: u128 = 1_000_000_000_000_000_000;
/// The largest magnitude, 10¹⁹. Ten times as much still fits 128 bits, which a division needs.
const MOST: u128 = 10 * ONE * ONE;
/// The largest divisor by which a remainder is divided at once: times 10¹⁸ it still fits 128 bits.
const SHORT: u128 = u128::MAX / ONE;

/// A decimal number in fixed point: a whole count of 10⁻¹⁸, up to ±10¹⁹.
///
/// Sums, differences and remainders are exact. Products and quotients are rounded to the nearest
/// 10⁻¹⁸, halves away from zero. Only integers are calculated: a desk and a microcontroller
/// without double precision find the same bits.
///
/// 18 places are twice as many as [`Number`] has. So `1/3*3000` differs from 1000 by 10⁻¹⁵, and
/// comparisons, FIX and FUP, which look at 12 places, take it for 1000.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Value(i128);

impl Value {
    /// The value 0.
    pub const ZERO: Self = Self(0);
    /// The value 1.
    pub const ONE: Self = Self(ONE as i128);

    /// Makes a value of a count of 10⁻¹⁸, known to lie within the range.
    pub(crate) const fn constant(count: i128) -> Self {
        Self(count)
    }

    /// Returns the value as a count of 10⁻¹⁸.
    pub(crate) const fn count(self) -> i128 {
        self.0
    }

    /// Makes a value of a count of 10⁻¹⁸.
    ///
    /// # Errors
    /// [`Math::TooLarge`] beyond ±10¹⁹.
    pub(crate) fn new(count: i128) -> Result<Self, Math> {
        match count.unsigned_abs() <= MOST {
            true => Ok(Self(count)),
            false => Err(Math::TooLarge),
        }
    }

    /// Makes a value of a magnitude and a sign.
    fn signed(magnitude: Option<u128>, negative: bool) -> Result<Self, Math> {
        let magnitude = magnitude.filter(|count| *count <= MOST);
        let count = magnitude.ok_or(Math::TooLarge)? as i128; // below 2¹²⁷
        Ok(Self(if negative { -count } else { count }))
    }

    /// Makes a value of an integer, exactly.
    pub fn from_int(int: i32) -> Self {
        Self(i128::from(int) * ONE as i128)
    }

    /// Makes a value of a word's number, exactly.
    pub fn from_number(number: Number) -> Self {
        Self(i128::from(number.nanos()) * 1_000_000_000)
    }

    /// Makes a value of 0 or 1.
    pub(crate) fn from_bool(is_true: bool) -> Self {
        match is_true {
            true => Self::ONE,
            false => Self::ZERO,
        }
    }

    /// Returns the value as a word has it, rounded to `places` decimals of at most nine, halves
    /// away from zero. `None` beyond the range of [`Number`].
    pub fn to_number(self, places: u32) -> Option<Number> {
        let nanos = self.rounded(places.min(9)).0 / 1_000_000_000;
        let nanos = i64::try_from(nanos).ok()?;
        (nanos != i64::MIN).then_some(Number::from_nanos(nanos))
    }

    /// Rounds to `places` decimals, 0 to 18, halves away from zero.
    pub(crate) fn rounded(self, places: u32) -> Self {
        let unit = 10_i128.pow(18 - places.min(18));
        let half = if self.0 < 0 { -unit / 2 } else { unit / 2 };
        // A unit is at least 1. The compiler does not see it, and would keep a panic.
        Self((self.0 + half).checked_div(unit).unwrap_or(0) * unit)
    }

    /// Returns what comparisons see: 12 decimals.
    pub(crate) fn seen(self) -> Self {
        self.rounded(12)
    }

    /// Returns the whole number that this value is, seen with 12 decimals.
    #[inline(never)] // what it calculates with is not on the stack of each parameter
    pub(crate) fn whole(self) -> Option<i64> {
        let (seen, one) = (self.seen().0, ONE as i128);
        match seen % one {
            0 => i64::try_from(seen / one).ok(),
            _ => None,
        }
    }

    /// The greatest whole number that is not above the value, seen with 12 decimals.
    pub(crate) fn floor(self) -> Result<Self, Math> {
        let seen = self.seen().0;
        Self::new(seen - seen.rem_euclid(ONE as i128))
    }

    /// Returns true if this is 0.
    pub fn is_zero(self) -> bool {
        self.0 == 0
    }

    /// The value without its sign.
    pub(crate) fn abs(self) -> Self {
        Self(self.0.abs())
    }

    /// The value with the other sign.
    pub(crate) fn negative(self) -> Self {
        Self(-self.0)
    }

    /// Returns the sum, exactly.
    pub(crate) fn plus(self, other: Self) -> Result<Self, Math> {
        Self::new(self.0 + other.0)
    }

    /// Returns the difference, exactly.
    pub(crate) fn minus(self, other: Self) -> Result<Self, Math> {
        Self::new(self.0 - other.0)
    }

    /// Returns the product, rounded.
    pub(crate) fn times(self, other: Self) -> Result<Self, Math> {
        let (a, b) = (self.0.unsigned_abs(), other.0.unsigned_abs());
        let ((aw, af), (bw, bf)) = ((a / ONE, a % ONE), (b / ONE, b % ONE));
        // Whole parts are at most 10¹⁹, fractions below 10¹⁸: only the product of the whole parts
        // can be too large.
        let fractions = (af * bf + ONE / 2) / ONE;
        let rest = aw * bf + af * bw + fractions;
        let product = (aw * bw)
            .checked_mul(ONE)
            .and_then(|whole| whole.checked_add(rest));
        Self::signed(product, (self.0 < 0) != (other.0 < 0))
    }

    /// Returns the quotient, rounded.
    ///
    /// # Errors
    /// [`Math::ByZero`], and [`Math::TooLarge`] beyond the range.
    pub fn over(self, other: Self) -> Result<Self, Math> {
        let (a, b) = (self.0.unsigned_abs(), other.0.unsigned_abs());
        if b == 0 {
            return Err(Math::ByZero);
        }
        let (whole, mut rest) = (a / b, a % b);
        let mut fraction = 0;
        if b <= SHORT {
            (fraction, rest) = (rest * ONE / b, rest * ONE % b);
        } else {
            for _ in 0..18 {
                rest *= 10; // below 10 · MOST
                (fraction, rest) = (fraction * 10 + rest / b, rest % b);
            }
        }
        fraction += u128::from(rest >= b - rest);
        let quotient = whole
            .checked_mul(ONE)
            .and_then(|whole| whole.checked_add(fraction));
        Self::signed(quotient, (self.0 < 0) != (other.0 < 0))
    }

    /// Returns the remainder, exactly: from 0 up to below the magnitude of the divisor.
    pub(crate) fn modulo(self, other: Self) -> Result<Self, Math> {
        let remainder = self.0.checked_rem_euclid(other.0);
        remainder.map(Self).ok_or(Math::ByZero)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_value() -> impl Strategy<Value = Value> {
        (any::<i128>(), 3..127_u32)
            .prop_filter_map("range", |(count, shift)| Value::new(count >> shift).ok())
    }

    /// A product of two magnitudes as high and low half, by schoolbook in 64 bits.
    fn wide(a: u128, b: u128) -> (u128, u128) {
        let (ah, al, bh, bl) = (
            a >> 64,
            a & (u128::MAX >> 64),
            b >> 64,
            b & (u128::MAX >> 64),
        );
        let (mid, carry) = (ah * bl).overflowing_add(al * bh);
        let (low, carry_low) = (al * bl).overflowing_add(mid << 64);
        let high = ah * bh + (mid >> 64) + (u128::from(carry) << 64) + u128::from(carry_low);
        (high, low)
    }

    #[test]
    fn a_third_of_three_thousand_is_seen_as_a_thousand() {
        let third = Value::ONE.over(Value::from_int(3)).unwrap();
        let back = third.times(Value::from_int(3000)).unwrap();
        assert_ne!(back, Value::from_int(1000));
        assert_eq!(back.whole(), Some(1000));
        assert_eq!(back.floor().unwrap(), Value::from_int(1000));
    }

    #[test]
    fn the_ends_of_the_range_are_told() {
        let most = Value::new(MOST as i128).unwrap();
        assert_eq!(most.plus(Value::ONE), Err(Math::TooLarge));
        assert_eq!(most.times(most), Err(Math::TooLarge));
        assert_eq!(most.over(Value::constant(1)), Err(Math::TooLarge));
        assert_eq!(most.over(most), Ok(Value::ONE));
        assert_eq!(Value::ONE.over(Value::ZERO), Err(Math::ByZero));
        assert_eq!(most.to_number(9), None);
    }

    #[test]
    fn words_are_rounded_halves_away_from_zero() {
        let half = Value::constant(500_000_000_000);
        let micro = Number::from_nanos(1_000);
        assert_eq!(half.to_number(6), Some(micro));
        assert_eq!(
            half.negative().to_number(6),
            Some(Number::from_nanos(-1_000))
        );
        assert_eq!(
            Value::constant(499_999_999_999).to_number(6),
            Some(Number::default())
        );
    }

    proptest! {
        #[test]
        fn a_product_is_the_nearest_decimal(a in any_value(), b in any_value()) {
            let exact = wide(a.0.unsigned_abs(), b.0.unsigned_abs());
            if let Ok(product) = a.times(b) {
                // |product · 10¹⁸ − a · b| ≤ 10¹⁸ / 2
                let near = wide(product.0.unsigned_abs(), ONE);
                let (larger, smaller) = if near > exact { (near, exact) } else { (exact, near) };
                let (low, borrow) = larger.1.overflowing_sub(smaller.1);
                prop_assert_eq!(larger.0 - smaller.0 - u128::from(borrow), 0);
                prop_assert!(low <= ONE / 2);
            } else {
                prop_assert!(exact >= wide(MOST, ONE));
            }
        }

        #[test]
        fn a_quotient_is_the_nearest_decimal(a in any_value(), b in any_value()) {
            prop_assume!(!b.is_zero());
            if let Ok(quotient) = a.over(b) {
                // |quotient · b − a · 10¹⁸| ≤ |b| / 2
                let near = wide(quotient.0.unsigned_abs(), b.0.unsigned_abs());
                let exact = wide(a.0.unsigned_abs(), ONE);
                let (larger, smaller) = if near > exact { (near, exact) } else { (exact, near) };
                let (low, borrow) = larger.1.overflowing_sub(smaller.1);
                prop_assert_eq!(larger.0 - smaller.0 - u128::from(borrow), 0);
                prop_assert!(low <= b.0.unsigned_abs().div_ceil(2));
            }
        }

        #[test]
        fn a_remainder_fits_below_the_divisor(a in any_value(), b in any_value()) {
            prop_assume!(!b.is_zero());
            let rest = a.modulo(b).unwrap();
            prop_assert!(rest >= Value::ZERO && rest < b.abs());
            prop_assert_eq!((a.0 - rest.0) % b.0, 0);
        }
    }
}
