//! The functions of expressions. Each result is rounded to 12 decimals; its error before that is
//! below 10⁻¹³ (EXP and powers: 10⁻¹³ of the result). Series of integers calculate them, the same
//! on a desk and on a microcontroller.
//!
//! ```text
//! sin r    = r − r³/3! + r⁵/5! …              |r| ≤ π/4, after the quadrants are folded
//! atan t   = 4 atan u, twice u = t / (1 + √(1 + t²));   u − u³/3 + u⁵/5 …   |u| < 0.2
//! exp x    = 2ᵏ · exp r                        |r| ≤ ln 2 / 2
//! ln x     = k ln 2 + 2 (z + z³/3 + z⁵/5 …)     z = (m − 1) / (m + 1), m from 0.75 to 1.5
//! ```

use crate::fault::Math;
use crate::value::Value;

type Answer = Result<Value, Math>;

/// π / 180.
const RADIAN: Value = Value::constant(17_453_292_519_943_296);
/// 180 / π.
const DEGREES: Value = Value::constant(57_295_779_513_082_320_877);
/// ln 2.
const LN_2: Value = Value::constant(693_147_180_559_945_309);

/// Whole exponents up to this are multiplied out.
const LARGEST_EXPONENT: i64 = 1 << 20;

fn int(int: i32) -> Value {
    Value::from_int(int)
}

/// The sine of an angle in degrees.
pub(crate) fn sin(angle: Value) -> Answer {
    Ok(exact_sin(angle)?.seen())
}

/// The cosine of an angle in degrees.
pub(crate) fn cos(angle: Value) -> Answer {
    Ok(exact_cos(angle)?.seen())
}

/// The tangent of an angle in degrees.
pub(crate) fn tan(angle: Value) -> Answer {
    Ok(exact_sin(angle)?.over(exact_cos(angle)?)?.seen())
}

fn exact_cos(angle: Value) -> Answer {
    exact_sin(angle.modulo(int(360))?.plus(int(90))?)
}

fn exact_sin(angle: Value) -> Answer {
    let mut angle = angle.modulo(int(360))?;
    let negative = angle >= int(180);
    if negative {
        angle = angle.minus(int(180))?;
    }
    if angle > int(90) {
        angle = int(180).minus(angle)?;
    }
    let sine = match angle > int(45) {
        true => wave(int(90).minus(angle)?.times(RADIAN)?, 0)?,
        false => wave(angle.times(RADIAN)?, 1)?,
    };
    Ok(if negative { sine.negative() } else { sine })
}

/// The series of the sine (from the power 1) or of the cosine (from 0).
fn wave(angle: Value, power: i32) -> Answer {
    let square = angle.times(angle)?;
    let mut term = if power == 0 { Value::ONE } else { angle };
    let (mut sum, mut power) = (term, power);
    while !term.is_zero() {
        term = term
            .times(square)?
            .over(int((power + 1) * (power + 2)))?
            .negative();
        sum = sum.plus(term)?;
        power += 2;
    }
    Ok(sum)
}

/// The angle whose sine is given, degrees from −90 to 90.
pub(crate) fn asin(sine: Value) -> Answer {
    atan(sine, other_leg(sine)?)
}

/// The angle whose cosine is given, degrees from 0 to 180.
pub(crate) fn acos(cosine: Value) -> Answer {
    atan(other_leg(cosine)?, cosine)
}

/// Returns √(1 − x²).
fn other_leg(leg: Value) -> Answer {
    if leg.abs() > Value::ONE {
        return Err(Math::NoAngle);
    }
    // (1 − x)(1 + x) keeps the places that 1 − x² loses near 1.
    sqrt(Value::ONE.minus(leg)?.times(Value::ONE.plus(leg)?)?)
}

/// The direction of the point (`x`, `y`), degrees above −180 up to 180; 0 for the origin.
pub(crate) fn atan(y: Value, x: Value) -> Answer {
    let (height, width) = (y.abs(), x.abs());
    if height.is_zero() && width.is_zero() {
        return Ok(Value::ZERO);
    }
    let mut angle = match height > width {
        true => int(90).minus(slope(width.over(height)?)?)?,
        false => slope(height.over(width)?)?,
    };
    if x < Value::ZERO {
        angle = int(180).minus(angle)?;
    }
    let angle = angle.seen();
    Ok(match y < Value::ZERO {
        true => angle.negative(),
        false => angle,
    })
}

/// The angle of a slope from 0 to 1, degrees.
fn slope(tangent: Value) -> Answer {
    let mut tangent = tangent;
    for _ in 0..2 {
        let root = sqrt(Value::ONE.plus(tangent.times(tangent)?)?)?;
        tangent = tangent.over(Value::ONE.plus(root)?)?;
    }
    odd_series(tangent, true)?.times(int(4))?.times(DEGREES)
}

/// x ∓ x³/3 + x⁵/5 …: the inverse tangent if the signs take turns, else its hyperbolic sister.
/// `|x|` is below 0.2.
fn odd_series(x: Value, turns: bool) -> Answer {
    let square = x.times(x)?;
    let (mut power, mut sum, mut odd) = (x, x, 1);
    while !power.is_zero() {
        power = power.times(square)?;
        if turns {
            power = power.negative();
        }
        odd += 2;
        sum = sum.plus(power.over(int(odd))?)?;
    }
    Ok(sum)
}

/// The square root, rounded down to 10⁻¹⁸ below 340, else with an error below 10⁻¹⁶.
pub(crate) fn sqrt(value: Value) -> Answer {
    const BILLION: u128 = 1_000_000_000;
    let count = u128::try_from(value.count()).map_err(|_| Math::NegativeRoot)?;
    if let Some(wide) = count.checked_mul(BILLION * BILLION) {
        return Value::new(wide.isqrt() as i128);
    }
    // Newton's step doubles the places of a root that has ten already.
    let first = Value::new((count.isqrt() * BILLION) as i128)?;
    first.plus(value.over(first)?)?.over(int(2))
}

/// e to this power.
pub(crate) fn exp(power: Value) -> Answer {
    Ok(exact_exp(power)?.seen())
}

fn exact_exp(power: Value) -> Answer {
    // Below e⁻⁴³ is nothing that 18 places show.
    if power < int(-43) {
        return Ok(Value::ZERO);
    }
    if power > int(60) {
        return Err(Math::TooLarge);
    }
    let doublings = power.over(LN_2)?.rounded(0);
    let rest = power.minus(doublings.times(LN_2)?)?;
    let (mut sum, mut term, mut n) = (Value::ONE, Value::ONE, 0);
    while !term.is_zero() {
        n += 1;
        term = term.times(rest)?.over(int(n))?;
        sum = sum.plus(term)?;
    }
    let factor = whole_power(int(2), doublings.abs().whole().unwrap_or(0))?;
    match doublings < Value::ZERO {
        true => sum.over(factor),
        false => sum.times(factor),
    }
}

/// The natural logarithm.
pub(crate) fn ln(value: Value) -> Answer {
    Ok(exact_ln(value)?.seen())
}

fn exact_ln(value: Value) -> Answer {
    if value <= Value::ZERO {
        return Err(Math::NoLogarithm);
    }
    let (low, high) = (
        Value::constant(750_000_000_000_000_000),
        int(3).over(int(2))?,
    );
    let (mut rest, mut doublings) = (value, 0);
    while rest >= high {
        (rest, doublings) = (rest.over(int(2))?, doublings + 1);
    }
    while rest < low {
        (rest, doublings) = (rest.times(int(2))?, doublings - 1);
    }
    let ratio = rest.minus(Value::ONE)?.over(rest.plus(Value::ONE)?)?;
    let twice = odd_series(ratio, false)?.times(int(2))?;
    twice.plus(LN_2.times(int(doublings))?)
}

/// `base` to the power `exponent`.
pub(crate) fn power(base: Value, exponent: Value) -> Answer {
    let whole = exponent
        .whole()
        .filter(|whole| (-LARGEST_EXPONENT..=LARGEST_EXPONENT).contains(whole));
    match whole {
        Some(whole @ 0..) => whole_power(base, whole),
        Some(_) if base.is_zero() => Err(Math::ByZero),
        // A power beyond the range is above 10¹⁹: one over it is 0 to 18 places.
        Some(whole) => match whole_power(base, -whole) {
            Ok(power) => Value::ONE.over(power).or(Err(Math::TooLarge)),
            Err(_) => Ok(Value::ZERO),
        },
        None if base < Value::ZERO => Err(Math::NoPower),
        None if base.is_zero() && exponent < Value::ZERO => Err(Math::ByZero),
        None if base.is_zero() => Ok(Value::ZERO),
        None => exp(exponent.times(exact_ln(base)?)?),
    }
}

/// `base` to a whole power from 0 on, by squaring.
fn whole_power(base: Value, exponent: i64) -> Answer {
    let (mut base, mut exponent, mut product) = (base, exponent, Value::ONE);
    loop {
        if exponent & 1 == 1 {
            product = product.times(base)?;
        }
        exponent >>= 1;
        if exponent <= 0 {
            return Ok(product);
        }
        base = base.times(base)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn value(float: f64) -> Value {
        Value::new((float * 1e9).round() as i128 * 1_000_000_000).unwrap()
    }

    fn float(value: Value) -> f64 {
        value.count() as f64 / 1e18
    }

    /// Compares with the standard library's function, relative to the result if that is large.
    fn near(ours: Answer, theirs: f64) -> Result<(), TestCaseError> {
        let ours = float(ours.unwrap());
        let bound = 2e-12 * theirs.abs().max(1.0);
        prop_assert!((ours - theirs).abs() <= bound, "{ours} {theirs}");
        Ok(())
    }

    #[test]
    fn round_angles_have_exact_values() {
        let half = int(1).over(int(2)).unwrap();
        assert_eq!(sin(int(30)), Ok(half));
        assert_eq!(cos(int(60)), Ok(half));
        assert_eq!(cos(int(90)), Ok(Value::ZERO));
        assert_eq!(sin(int(-90)), Ok(int(-1)));
        assert_eq!(tan(int(45)), Ok(int(1)));
        assert_eq!(asin(half), Ok(int(30)));
        assert_eq!(acos(half.negative()), Ok(int(120)));
        assert_eq!(atan(int(-1), int(-1)), Ok(int(-135)));
        assert_eq!(atan(Value::ZERO, int(-1)), Ok(int(180)));
        assert_eq!(atan(int(3), Value::ZERO), Ok(int(90)));
    }

    #[test]
    fn what_has_no_value_is_told() {
        assert_eq!(tan(int(90)), Err(Math::ByZero));
        assert_eq!(asin(int(2)), Err(Math::NoAngle));
        assert_eq!(sqrt(int(-1)), Err(Math::NegativeRoot));
        assert_eq!(ln(Value::ZERO), Err(Math::NoLogarithm));
        assert_eq!(power(int(-8), value(0.5)), Err(Math::NoPower));
        assert_eq!(power(int(0), int(-1)), Err(Math::ByZero));
        assert_eq!(exp(int(45)), Err(Math::TooLarge));
    }

    #[test]
    fn powers_by_whole_numbers_are_exact() {
        let cases = [(0, 0, 1), (2, 10, 1024), (-2, 3, -8), (0, 5, 0), (7, 1, 7)];
        for (base, exponent, product) in cases {
            assert_eq!(power(int(base), int(exponent)), Ok(int(product)));
        }
        assert_eq!(power(int(2), int(-2)), Ok(value(0.25)));
        assert_eq!(power(int(10), int(-30)), Ok(Value::ZERO));
    }

    #[test]
    fn roots_of_all_sizes_are_near() {
        let sizes: Vec<f64> = (-9..19).map(|size| 10_f64.powi(size)).collect();
        for size in sizes {
            let root = float(sqrt(value(size)).unwrap());
            assert!(
                (root - size.sqrt()).abs() <= 2e-12 * root.max(1e-3),
                "{size} {root}"
            );
        }
    }

    proptest! {
        #[test]
        fn angles_agree_with_doubles(angle in -720.0..720.0_f64, y in -99.0..99.0_f64, x in -99.0..99.0_f64) {
            let angle = float(value(angle));
            near(sin(value(angle)), angle.to_radians().sin())?;
            near(cos(value(angle)), angle.to_radians().cos())?;
            let (y, x) = (float(value(y)), float(value(x)));
            near(atan(value(y), value(x)), y.atan2(x).to_degrees())?;
            let unit = float(value(x / 100.0));
            near(asin(value(unit)), unit.asin().to_degrees())?;
            near(acos(value(unit)), unit.acos().to_degrees())?;
        }

        #[test]
        fn powers_agree_with_doubles(base in 0.001..1000.0_f64, exponent in -4.0..4.0_f64) {
            let (base, exponent) = (float(value(base)), float(value(exponent)));
            near(ln(value(base)), base.ln())?;
            near(exp(value(exponent)), exponent.exp())?;
            near(power(value(base), value(exponent)), base.powf(exponent))?;
            near(sqrt(value(base)), base.sqrt())?;
        }
    }
}
