//! The few operations on real numbers that `core` lacks or does slowly.
//!
//! All are plain `f32`: correctly rounded, never fused, so that desk and microcontroller agree to
//! the bit.

/// The correctly rounded square root; 0 for a negative number (a rounding error below 0).
pub(crate) fn sqrt(x: f32) -> f32 {
    if x > 0.0 {
        leadscrew_fpu::sqrt(x)
    } else {
        0.0
    }
}

/// The smaller of two numbers. (`f32::min` is a library call on a Cortex-M4F.)
pub(crate) fn min(a: f32, b: f32) -> f32 {
    if b < a {
        b
    } else {
        a
    }
}

/// The larger of two numbers.
pub(crate) fn max(a: f32, b: f32) -> f32 {
    if b > a {
        b
    } else {
        a
    }
}

/// The sum of the squares of a vector's components.
pub(crate) fn norm2<const N: usize>(vector: &[f32; N]) -> f32 {
    vector.iter().fold(0.0, |sum, x| sum + x * x)
}

/// The largest `|x_i| · k_i`.
///
/// With `k_i = 1/limit_i` its reciprocal is the limit along the direction `x`.
pub(crate) fn worst<const N: usize>(vector: &[f32; N], reciprocals: &[f32; N]) -> f32 {
    vector
        .iter()
        .zip(reciprocals)
        .fold(0.0, |worst, (x, k)| max(worst, x.abs() * k))
}

/// A cube root of a positive number, 0.93 to 1.04 times the true one.
///
/// Dividing the bits by three divides the exponent by three; the constant (W. Kahan, *Computing a
/// Real Cube Root*, 1991) restores the bias. Good enough for a bound on a duration.
pub(crate) fn rough_cube_root(x: f32) -> f32 {
    const BIAS: u32 = 709_958_130;
    f32::from_bits(x.to_bits() / 3 + BIAS)
}

/// `a / b` as a sum of two floats, about 45 bits of the quotient.
///
/// The remainder `a − q·b` is exact by Dekker's product (T. J. Dekker, *A floating-point technique
/// for extending the available precision*, 1971). For `|q|` and `|b|` below 2¹⁰⁰.
pub(crate) fn divide_twice(a: f32, b: f32) -> (f32, f32) {
    let quotient = a / b;
    let (product, error) = exact_product(quotient, b);
    let remainder = (a - product) - error;
    (quotient, remainder / b)
}

/// `a·b` as its rounded value and the exact rest.
fn exact_product(a: f32, b: f32) -> (f32, f32) {
    let product = a * b;
    let ((a1, a2), (b1, b2)) = (halves(a), halves(b));
    let error = ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2;
    (product, error)
}

/// Splits a float into two of 12 bits each.
fn halves(x: f32) -> (f32, f32) {
    const SPLIT: f32 = 4097.0; // 2^12 + 1
    let scaled = SPLIT * x;
    let high = scaled - (scaled - x);
    (high, x - high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_quotient_in_two_parts_has_forty_bits(a in 1.0f32..1e9, b in 1e-3f32..1e6) {
            let (q, r) = divide_twice(a, b);
            let exact = f64::from(a) / f64::from(b);
            prop_assert!((f64::from(q) + f64::from(r) - exact).abs() <= exact * 1e-12);
        }

        #[test]
        fn the_rough_cube_root_is_within_seven_per_cent(x in 1e-20f32..1e20) {
            let ratio = f64::from(rough_cube_root(x)) / f64::from(x).cbrt();
            prop_assert!((0.93..1.04).contains(&ratio), "{}", ratio);
        }
    }

    #[test]
    fn the_root_of_a_negative_rounding_error_is_zero() {
        assert_eq!(sqrt(-1e-9), 0.0);
        assert_eq!(sqrt(2.25), 1.5);
    }
}
