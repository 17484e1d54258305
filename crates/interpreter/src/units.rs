//! Words to lengths: inches to millimetres, exactly.

use super::Coordinate;
use crate::Status;
use leadscrew_gcode::Number;

/// The farthest offset, centre or radius, mm or degrees: 10⁶ m, so that no sum of offsets
/// overflows. What lies beyond it is refused.
pub const MAX_WORD: Coordinate = Coordinate::from_nanos(1_000_000_000_000_000_000);

/// Reads a length in millimetres, or an angle in degrees.
///
/// # Errors
///
/// [`Status::OutOfRange`] beyond ±[`MAX_WORD`].
#[inline]
pub(super) fn millimetres(value: Number) -> Result<Coordinate, Status> {
    let nanos = value.nanos();
    if nanos.unsigned_abs() > MAX_WORD.nanos().unsigned_abs() {
        return Err(Status::OutOfRange);
    }
    Ok(Coordinate::from_nanos(nanos))
}

/// Multiplies by 25.4. Exact to 8 decimals of an inch; the ninth is rounded to the nearest 10⁻⁹ mm.
/// A product beyond the range of [`Number`] becomes the end of that range.
pub(super) fn inches_to_millimetres(value: Number) -> Number {
    let inches = value.nanos().unsigned_abs();
    // 25.4·n = 25·n + 2·n/5
    let (fifths, rest) = divide_by_5(inches);
    let magnitude = 25_u64
        .saturating_mul(inches)
        .saturating_add(2 * fifths + u64::from((2 * rest + 2) / 5));
    let magnitude = i64::try_from(magnitude).unwrap_or(i64::MAX);
    Number::from_nanos(if value < Number::default() {
        -magnitude
    } else {
        magnitude
    })
}

/// Divides by 25.4: the number of a feed as a program in inches has written it. Rounded toward zero
/// to 10⁻⁹.
pub(super) fn millimetres_to_inches(value: Number) -> Number {
    // 1/25.4 = 5/127
    let nanos = value.nanos();
    Number::from_nanos(nanos / 127 * 5 + nanos % 127 * 5 / 127)
}

/// Quotient and remainder, by long division in digits of 16 bits: the hardware divides 32 bits
/// only.
fn divide_by_5(n: u64) -> (u64, u32) {
    let (high, low) = ((n >> 32) as u32, n as u32);
    let middle = ((high % 5) << 16) | (low >> 16);
    let last = ((middle % 5) << 16) | (low & 0xffff);
    let quotient =
        (u64::from(high / 5) << 32) | (u64::from(middle / 5) << 16) | u64::from(last / 5);
    (quotient, last % 5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_tenth_of_an_inch_is_2_54_mm() {
        let inches = Number::from_nanos(100_000_000);
        let mm = Number::from_nanos(2_540_000_000);
        assert_eq!(inches_to_millimetres(inches), mm);
    }

    #[test]
    fn whole_inches_come_back_from_millimetres() {
        for inches in [0, 1, 10, 600, 9_000_000] {
            let inches = Number::from_int(inches);
            assert_eq!(millimetres_to_inches(inches_to_millimetres(inches)), inches);
        }
    }

    #[test]
    fn a_length_beyond_all_reach_is_refused() {
        let beyond = Number::from_nanos(MAX_WORD.nanos() + 1);
        assert_eq!(millimetres(beyond), Err(Status::OutOfRange));
        assert_eq!(
            millimetres(Number::from_nanos(-MAX_WORD.nanos())),
            Ok(Coordinate::from_nanos(-MAX_WORD.nanos()))
        );
    }

    proptest! {
        #[test]
        fn inches_agree_with_exact_arithmetic(nanos in any::<i64>(), shift in 0..63u32) {
            let inches = Number::from_nanos(nanos >> shift);
            let tenths = i128::from(inches.nanos()) * 254;
            let rounded = (tenths + 5 * tenths.signum()) / 10;
            let most = i128::from(i64::MAX);
            let mm = inches_to_millimetres(inches);
            prop_assert_eq!(i128::from(mm.nanos()), rounded.clamp(-most, most));
        }
    }
}
