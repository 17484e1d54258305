//! The highest speed at which a corner may be taken.
//!
//! ```text
//!            u1
//!           /     θ: the angle between the moves, 180° if they go straight on
//!    u0    / θ
//!   ------+
//! ```
//!
//! A circle that is tangent to both moves and passes the corner at the distance `d` (junction
//! deviation) has the radius
//!
//! ```text
//!   R = d·s / (1 − s)        s = sin(θ/2)
//! ```
//!
//! The corner may be taken as fast as that circle: `v² = a·R`. `a` is the acceleration that the
//! axes allow along the change of direction `u1 − u0`. The path itself keeps its corner.
//!
//! Source: S. K. Jeon, *Improving Grbl: Cornering Algorithm* (2011); the per-axis acceleration as
//! in Grbl 1.1.
//!
//! Near θ = 180° the formula cancels in `f32`. With the sum and the difference of the unit vectors
//! it does not:
//!
//! ```text
//!   s = |u0 + u1| / 2        1 − s² = |u1 − u0|² / 4
//!   v² = a·d·s·(1 + s) / (1 − s²) = 4·a·d·s·(1 + s) / |u1 − u0|²
//! ```

use crate::config::Limits;
use crate::real::{max, norm2, sqrt, worst};

/// Corners whose `|cos θ|` is within this of 1 count as straight on or as reversal (Grbl:
/// 0.999999).
const FLAT: f32 = 1e-6;

/// The greatest error of the sum and of the difference of two unit vectors: seven roundings of an
/// `f32`.
const UNCERTAIN: f32 = 4e-7;

/// The squared speed (mm²/s²) at which the direction may change from `u0` to `u1` (unit vectors): 0
/// at a reversal, infinite straight on.
pub(crate) fn junction_v2<const AXES: usize>(
    u0: &[f32; AXES],
    u1: &[f32; AXES],
    limits: &Limits<AXES>,
) -> f32 {
    let (mut sum, mut change) = (*u0, *u1);
    for ((sum, change), (u0, u1)) in sum.iter_mut().zip(&mut change).zip(u0.iter().zip(u1)) {
        *sum += u1;
        *change -= u0;
    }
    let (sum2, change2) = (norm2(&sum), norm2(&change));
    if change2 < 2.0 * FLAT {
        return f32::INFINITY;
    }
    if sum2 < 2.0 * FLAT {
        return 0.0;
    }
    let s = max(0.5 * sqrt(sum2) - UNCERTAIN, 0.0);
    // a = |change| / worst: one factor |change| of the formula's square cancels.
    let per_acceleration = (worst(&change, &limits.per_acceleration)
        + UNCERTAIN * limits.per_weakest)
        * (sqrt(change2) + UNCERTAIN);
    4.0 * limits.deviation * s * (1.0 + s) / per_acceleration
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;
    use proptest::prelude::*;

    fn limits(acceleration: [f32; 2]) -> Limits<2> {
        Limits::new(&Config {
            acceleration,
            ..Config::default()
        })
    }

    /// Jeon's formula as it is written, in `f64`.
    fn by_the_book(turn: f64, u0: [f64; 2], u1: [f64; 2], acceleration: [f64; 2]) -> f64 {
        let s = ((1.0 + turn.cos()) / 2.0).sqrt();
        let n = [u1[0] - u0[0], u1[1] - u0[1]];
        let length = n[0].hypot(n[1]);
        let a = (acceleration[0] * length / n[0].abs()).min(acceleration[1] * length / n[1].abs());
        a * 0.01 * s / (1.0 - s)
    }

    #[test]
    fn straight_on_is_unlimited_and_back_is_a_stop() {
        let limits = limits([10.0, 10.0]);
        assert_eq!(
            junction_v2(&[1.0, 0.0], &[1.0, 0.0], &limits),
            f32::INFINITY
        );
        assert_eq!(junction_v2(&[1.0, 0.0], &[-1.0, 0.0], &limits), 0.0);
    }

    #[test]
    fn a_right_angle_is_taken_as_the_paper_says() {
        let v2 = junction_v2(&[1.0, 0.0], &[0.0, 1.0], &limits([10.0, 10.0]));
        let expected = 10.0 * 0.01 / (1.0 - 0.5f32.sqrt());
        assert!((v2 - expected).abs() < 2e-6);
    }

    proptest! {
        #[test]
        fn any_corner_is_taken_as_the_paper_says(heading in 0.0f64..6.2, turn in 0.01f64..3.0, x in 1.0f32..1e4, y in 1.0f32..1e4) {
            let u = |angle: f64| [angle.cos(), angle.sin()];
            let (u0, u1) = (u(heading), u(heading + turn));
            let v2 = junction_v2(&u0.map(|x| x as f32), &u1.map(|x| x as f32), &limits([x, y]));
            let exact = by_the_book(turn, u0, u1, [x.into(), y.into()]);
            let ratio = f64::from(v2) / exact;
            prop_assert!(ratio > 1.0 - 1e-3 && ratio <= 1.0, "{} {}", v2, exact);
        }
    }
}
