//! Converts digits to exact lengths.

use crate::Mm;
use std::str::FromStr;

/// Units of 1e-9 mm in a millimetre.
pub(crate) const NANOS_PER_MM: i64 = 1_000_000_000;
/// Units of 1e-9 mm in an inch.
pub(crate) const NANOS_PER_INCH: i64 = 25_400_000_000;

impl FromStr for Mm {
    type Err = String;

    /// Reads `7.62`, `-0.5` or `40`.
    fn from_str(text: &str) -> Result<Self, String> {
        length(text, NANOS_PER_MM)
    }
}

/// Reads `[+-] digits [. digits]` as a length in units of `unit_nanos`.
///
/// # Errors
/// The mistake in the number: no digits, more decimals than can be held exactly, or a length that
/// is too large.
pub(crate) fn length(text: &str, unit_nanos: i64) -> Result<Mm, String> {
    let (negative, digits) = split_sign(text);
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    scaled(negative, whole, fraction, unit_nanos)
}

/// Splits the sign off a number. Returns whether it is negative, and its digits.
pub(crate) fn split_sign(text: &str) -> (bool, &str) {
    match text.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    }
}

/// Makes a length from the digits before and after the decimal point.
///
/// # Errors
/// As [`length`].
pub(crate) fn scaled(
    negative: bool,
    whole: &str,
    fraction: &str,
    unit_nanos: i64,
) -> Result<Mm, String> {
    let is_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.len() + fraction.len() == 0 || !is_digits(whole) || !is_digits(fraction) {
        return Err("expected a number".to_owned());
    }
    let fraction = fraction.trim_end_matches('0');
    let too_far = || "is further than 100 m".to_owned();
    let decimals = u32::try_from(fraction.len()).map_err(|_| too_far())?;
    let power = 10_i128.checked_pow(decimals).ok_or("has too many digits")?;
    let digits = format!("{whole}{fraction}");
    let mantissa: i128 = digits.parse().map_err(|_| "has too many digits")?;
    let nanos = mantissa
        .checked_mul(i128::from(unit_nanos))
        .ok_or_else(too_far)?;
    if nanos % power != 0 {
        return Err("has more decimals than can be kept (1e-9 mm)".to_owned());
    }
    let magnitude = i64::try_from(nanos / power).map_err(|_| too_far())?;
    if magnitude > Mm::LIMIT.nanos() {
        return Err(too_far());
    }
    Ok(Mm::from_nanos(if negative {
        -magnitude
    } else {
        magnitude
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inches_become_millimetres_exactly() {
        for (inches, mm) in [
            ("0.034", "0.8636"),
            ("-.1", "-2.54"),
            ("+1.00000000000", "25.4"),
            ("0.00001", "0.000254"),
            ("3.", "76.2"),
        ] {
            let length = length(inches, NANOS_PER_INCH).unwrap();
            assert_eq!(length.to_string(), mm, "{inches}");
        }
    }

    #[test]
    fn what_is_no_number_or_too_much_of_one_is_refused() {
        let long = "9".repeat(60);
        for text in [
            "",
            "-",
            ".",
            "1-2",
            "--1",
            "1e3",
            "0.0000000001",
            &long,
            "100001",
        ] {
            assert!(length(text, NANOS_PER_MM).is_err(), "{text}");
        }
    }
}
