//! Computes steps per mm from a measurement by hand.

use crate::Mm;
use leadscrew_gcode::Number;

/// Returns the steps per mm with which a move of `commanded` mm has this length. With `now` steps
/// per mm it measured `measured` mm.
///
/// Rounded to three decimals, as `$$` prints them.
///
/// # Errors
/// A length that is not more than 0, or a result that is no setting.
pub fn steps_per_mm(now: Number, commanded: Mm, measured: Mm) -> Result<Number, String> {
    const THOUSANDTH: i128 = 1_000_000;
    for (name, length) in [("--commanded", commanded), ("--measured", measured)] {
        if length <= Mm::ZERO {
            return Err(format!("{name} must be more than 0"));
        }
    }
    let divisor = i128::from(measured.nanos()) * THOUSANDTH;
    let product = i128::from(now.nanos()) * i128::from(commanded.nanos());
    let nanos = (product + divisor / 2) / divisor * THOUSANDTH;
    let steps = i64::try_from(nanos).ok().filter(|nanos| *nanos > 0);
    let steps = steps.ok_or("the result is no number of steps")?;
    Ok(Number::from_nanos(steps))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decimal::{length, NANOS_PER_MM};

    fn calibrated(now: i32, commanded: &str, measured: &str) -> Result<String, String> {
        let mm = |text| length(text, NANOS_PER_MM).unwrap();
        let steps = steps_per_mm(Number::from_int(now), mm(commanded), mm(measured));
        steps.map(|steps| steps.to_string())
    }

    #[test]
    fn a_move_that_came_out_short_needs_more_steps() {
        assert_eq!(calibrated(250, "100", "99.2"), Ok("252.016".to_owned()));
        assert_eq!(calibrated(80, "100", "100"), Ok("80".to_owned()));
        assert_eq!(calibrated(80, "100", "200"), Ok("40".to_owned()));
    }

    #[test]
    fn lengths_are_more_than_nothing() {
        assert!(calibrated(250, "100", "0").is_err());
        assert!(calibrated(250, "-100", "100").is_err());
        assert!(calibrated(250, "0.000001", "100000").is_err());
    }
}
