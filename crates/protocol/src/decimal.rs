//! Exact values as the fixed decimals that go over the wire.
//!
//! A value is a whole count of 10⁻⁹ mm. One unit of the last printed digit is a whole count, too,
//! even in inches:
//!
//! ```text
//! 10⁻⁴ inch = 2 540 000 · 10⁻⁹ mm
//! ```
//!
//! So one integer division gives the printed digits, rounded half away from zero. A value that
//! rounds to zero has no sign.

use core::fmt;
use leadscrew_gcode::Number;

/// A number with a fixed count of decimals. Displayed in at most [`Decimal::MAX_LENGTH`]
/// characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Decimal {
    /// The printed digits without the point.
    digits: i64,
    /// The number of them that stand after the point, 0 to 4.
    places: u8,
}

impl Decimal {
    /// Longest printed form: sign, 10 digits, point, 3 digits; for inches 9 digits, point, 4
    /// digits.
    pub const MAX_LENGTH: usize = 15;

    /// Makes a length in millimetres, or an angle, with 3 decimals.
    pub fn millimetres(value: Number) -> Self {
        Self::new(value, 1_000_000, 3)
    }

    /// Makes a length given in millimetres as inches with 4 decimals.
    pub fn inches(value: Number) -> Self {
        Self::new(value, 2_540_000, 4)
    }

    /// Makes a feed given in mm/min as inch/min with 1 decimal.
    pub fn inches_per_minute(value: Number) -> Self {
        Self::new(value, 2_540_000_000, 1)
    }

    /// Makes a value with 1 decimal: a time in s.
    pub fn tenths(value: Number) -> Self {
        Self::new(value, 100_000_000, 1)
    }

    /// Makes a value without decimals: feeds in mm/min, speeds in 1/min, whole settings.
    pub fn whole(value: Number) -> Self {
        Self::new(value, 1_000_000_000, 0)
    }

    /// Returns Grbl's output for a value of this sign that is too large for it: 2³¹ of the last
    /// digit.
    pub fn saturated(self) -> Self {
        Self {
            digits: self.digits.signum() << 31,
            ..self
        }
    }

    /// `unit`: the value of one unit of the last printed digit, in 10⁻⁹.
    #[inline(never)] // inlined, an image with a record takes 1076 bytes more
    fn new(value: Number, unit: i64, places: u8) -> Self {
        let nanos = value.nanos();
        let rest = nanos % unit;
        let away = i64::from(rest.abs() >= unit - rest.abs()) * rest.signum();
        Self {
            digits: nanos / unit + away,
            places,
        }
    }
}

impl fmt::Display for Decimal {
    /// Writes digit by digit, the last digit first. With `{}` the longest poll that sends a list
    /// takes 800 instructions more (`cargo xtask icount`).
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = [0; Self::MAX_LENGTH];
        let mut from = text.len();
        let mut put = |byte| {
            from = from.saturating_sub(1);
            if let Some(place) = text.get_mut(from) {
                *place = byte;
            }
        };
        let mut rest = self.digits.unsigned_abs();
        for place in 0.. {
            if place > 0 && place == self.places {
                put(b'.');
            }
            put(b'0' + (rest % 10) as u8);
            rest /= 10;
            if rest == 0 && place >= self.places {
                break;
            }
        }
        if self.digits < 0 {
            put(b'-');
        }
        let text = text.get(from..).unwrap_or_default();
        f.write_str(core::str::from_utf8(text).unwrap_or_default())
    }
}

/// Returns a measured value cut to thousandths, for reports; 0 for a value that is no number.
pub fn from_f32(value: f32) -> Number {
    Number::from_nanos(((value * 1000.0) as i64).saturating_mul(1_000_000))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::format;
    use std::string::{String, ToString};

    fn number(text: &str) -> Number {
        leadscrew_gcode::leading_number(text.as_bytes()).unwrap().0
    }

    #[test]
    fn millimetres_have_three_decimals_rounded_half_away_from_zero() {
        let cases = [
            ("0", "0.000"),
            ("-0.0001", "0.000"),
            ("-0.0005", "-0.001"),
            ("0.00049", "0.000"),
            ("1.0005", "1.001"),
            ("1.9995", "2.000"),
            ("123.4565", "123.457"),
            ("1234567.89", "1234567.890"),
            ("999999.999", "999999.999"),
            ("12345678", "12345678.000"),
            ("-4294968", "-4294968.000"),
        ];
        for (value, text) in cases {
            assert_eq!(Decimal::millimetres(number(value)).to_string(), text);
        }
    }

    #[test]
    fn what_is_too_large_prints_as_grbl_prints_it() {
        let far = |text| Decimal::millimetres(number(text)).saturated().to_string();
        assert_eq!(far("1000000000"), "2147483.648");
        assert_eq!(far("-1000000000"), "-2147483.648");
        let inches = Decimal::inches(number("1000000000")).saturated();
        assert_eq!(inches.to_string(), "214748.3648");
    }

    #[test]
    fn inches_are_exact() {
        let cases = [
            ("25.4", "1.0000"),
            ("-10", "-0.3937"),
            ("27.4", "1.0787"),
            ("0.00127", "0.0001"),
            ("-0.001269999", "0.0000"),
        ];
        for (value, text) in cases {
            assert_eq!(Decimal::inches(number(value)).to_string(), text);
        }
        assert_eq!(Decimal::inches_per_minute(number("50")).to_string(), "2.0");
        assert_eq!(
            Decimal::inches_per_minute(number("254")).to_string(),
            "10.0"
        );
    }

    #[test]
    fn whole_numbers_round_half_up() {
        for (value, text) in [
            ("0.4", "0"),
            ("0.5", "1"),
            ("2.5", "3"),
            ("99.49", "99"),
            ("99999999", "99999999"),
        ] {
            assert_eq!(Decimal::whole(number(value)).to_string(), text);
        }
    }

    #[test]
    fn the_longest_values_keep_to_the_bound() {
        for value in [Number::MAX, Number::from_nanos(-i64::MAX)] {
            for decimal in [
                Decimal::millimetres(value),
                Decimal::inches(value),
                Decimal::whole(value),
            ] {
                assert!(decimal.to_string().len() <= Decimal::MAX_LENGTH);
            }
        }
    }

    #[test]
    fn measured_values_are_cut_to_thousandths() {
        assert_eq!(from_f32(1.5), number("1.5"));
        assert_eq!(from_f32(f32::NAN), number("0"));
        assert_eq!(from_f32(f32::INFINITY), Number::MAX);
    }

    /// Rounds in `i128`, with room to spare.
    fn reference(nanos: i64, unit: i128, places: usize) -> String {
        let magnitude = (i128::from(nanos).abs() * 2 + unit) / (2 * unit);
        let sign = if nanos < 0 && magnitude > 0 { "-" } else { "" };
        let digits = format!("{magnitude:0width$}", width = places + 1);
        let (whole, fraction) = digits.split_at(digits.len() - places);
        format!("{sign}{whole}.{fraction}")
    }

    proptest! {
        #[test]
        fn decimals_are_what_wide_integers_make_of_them(nanos in any::<i64>(), shift in 0..63_u32) {
            let nanos = nanos >> shift;
            let value = Number::from_nanos(nanos);
            prop_assert_eq!(Decimal::millimetres(value).to_string(), reference(value.nanos(), 1_000_000, 3));
            prop_assert_eq!(Decimal::inches(value).to_string(), reference(value.nanos(), 2_540_000, 4));
        }
    }
}
