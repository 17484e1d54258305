//! Sine and cosine in plain `f32`.
//!
//! The `libm` crate's `sinf` computes in `f64`, which the M4F does in software. An angle is reduced
//! to ±π/4 by a multiple of π/2 in three parts (W. Cody and W. Waite, *Software Manual for the
//! Elementary Functions*, 1980); there the polynomials are those of the Cephes library's `sinf` and
//! `cosf` (S. Moshier, <https://www.netlib.org/cephes/>). The error is below 1.2·10⁻⁷ for |angle|
//! ≤ 8.

const HALF_PI: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];
const SINE: [f32; 3] = [-1.951_529_6e-4, 8.332_161e-3, -1.666_665_5e-1];
const COSINE: [f32; 3] = [2.443_315_7e-5, -1.388_731_6e-3, 4.166_664_6e-2];

/// Sine and cosine of `angle` radians.
pub(crate) fn sin_cos(angle: f32) -> (f32, f32) {
    let turns = angle * core::f32::consts::FRAC_2_PI;
    let quarter = (turns + if turns < 0.0 { -0.5 } else { 0.5 }) as i32;
    let x = HALF_PI
        .iter()
        .fold(angle, |x, part| x - quarter as f32 * part);
    let (sin, cos) = near_zero(x);
    match quarter.rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Sine and cosine for |x| ≤ π/4.
fn near_zero(x: f32) -> (f32, f32) {
    let z = x * x;
    let horner = |terms: [f32; 3]| (terms[0] * z + terms[1]) * z + terms[2];
    let sin = x + x * z * horner(SINE);
    let cos = 1.0 - 0.5 * z + z * z * horner(COSINE);
    (sin, cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_are_within_their_bound_all_round() {
        for k in -800_000i32..=800_000 {
            let angle = k as f32 * 1e-5;
            let (sin, cos) = sin_cos(angle);
            let (s, c) = f64::from(angle).sin_cos();
            assert!((f64::from(sin) - s).abs() < 1.2e-7, "sin {angle}");
            assert!((f64::from(cos) - c).abs() < 1.2e-7, "cos {angle}");
        }
    }
}
