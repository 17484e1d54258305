//! The acceleration that the axes allow along a piece of path, which depends on the speed.
//!
//! A piece of path has the unit tangent `p`. When it meets the next one, the path turns with the
//! curvature `k` (a vector, 1/mm). With the squared speed `x` and the acceleration `u` along the
//! path each axis asks for
//!
//! ```text
//!   |p_d·u + k_d·x| ≤ a_d
//! ```
//!
//! That is a polygon in the plane of `u` and `x`. All vectors here are divided by the
//! accelerations, so that the limit reads `|q_d·u + b_d·x| ≤ 1`. A speed is allowed if the polygon
//! contains `u = 0` at that speed. Such a speed can be kept, and the acceleration that is left for
//! braking and for speeding up is never below 0.
//!
//! Between two turns motion is straight. There only `|q_d·u| ≤ 1` is used, although the turn to
//! come might allow more.
//!
//! A piece whose squared speed rises from `x` to `x + g` over its length `L` has `u = g/2L`. The
//! limits apply at both of its ends, each with the curvature there. Braking is the same, seen from
//! the other end: the tangent turns round, the curvature stays.

use crate::real::{max, min};

/// A piece of path: its tangent divided by the acceleration of each axis, s²/mm, and its length,
/// mm.
pub(crate) struct Piece<const AXES: usize> {
    pub(crate) tangent: [f32; AXES],
    pub(crate) length: f32,
}

/// A bound of the squared speed at one end of a piece: `(1 + slope·x)/share`, in which `x` is the
/// squared speed at the other end.
#[derive(Clone, Copy)]
struct Bound {
    share: f32,
    slope: f32,
}

impl Bound {
    /// No bound: it crosses no other one.
    const NONES: [Self; 3] = [Self {
        share: 0.0,
        slope: 0.0,
    }; 3];
}

/// The squared speed at one end of a piece for which the other end may be fastest.
///
/// If a piece turns at one end and hardly moves along an axis, that axis has little left for
/// braking at high speed. So a piece that ends slower may begin faster.
pub(crate) struct Peak {
    /// The squared speed at this end, mm²/s².
    pub(crate) at: f32,
    /// The squared speed at the other end, mm²/s².
    pub(crate) reached: f32,
}

impl Peak {
    /// No bound falls with the speed: the faster this end, the faster the other.
    const NONE: Self = Self {
        at: f32::INFINITY,
        reached: f32::INFINITY,
    };

    /// The place at which the least of all bounds is highest: the lowest crossing of a bound that
    /// rises with `x` and one that falls. (The rising and the falling bound of the same axis cross
    /// at rest.) Its height is computed from the rising bound: on a steep falling one, it would be
    /// a difference of large numbers.
    fn of(bounds: &[Bound]) -> Self {
        let mut peak = Self::NONE;
        for falling in bounds.iter().filter(|bound| bound.slope < 0.0) {
            for rising in bounds.iter().filter(|bound| bound.slope >= 0.0) {
                let apart = falling.share * rising.slope - rising.share * falling.slope;
                let at = (rising.share - falling.share) / apart;
                let reached = (1.0 + rising.slope * at) / rising.share;
                if at >= 0.0 && reached < peak.reached {
                    peak = Self { at, reached };
                }
            }
        }
        peak.reached *= ROUNDED_DOWN;
        peak
    }
}

/// The bounds of an axis: by its share in the tangent, by the curvature at this end, and by the
/// curvature at the other end.
fn bound(bounds: &mut [Bound; 3], share: f32, from: f32, to: f32) {
    let one = 1.0f32.copysign(share);
    let [share, from, to] = [share, from, to].map(|part| part * one);
    let all = [(share, share), (share, share - from), (share + to, share)];
    for (bound, (share, slope)) in bounds.iter_mut().zip(all) {
        if share > 0.0 {
            *bound = Bound { share, slope };
        }
    }
}

/// A factor that makes a crossing of two bounds lower by more than its rounding.
const ROUNDED_DOWN: f32 = 1.0 - 1.0 / (1 << 20) as f32;

/// The direction in which the speed rises.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Rise {
    /// Along the path: motion along the path accelerates.
    Forward,
    /// Against the path: motion along the path brakes.
    Backward,
}

/// The highest squared speed (mm²/s²) at which a path may turn with the curvature `bend` (over the
/// acceleration of each axis, s²/mm²).
pub(crate) fn cap(bend: &[f32]) -> f32 {
    1.0 / greatest(bend)
}

/// The greatest component of a curvature, without sign.
pub(crate) fn greatest(bend: &[f32]) -> f32 {
    bend.iter().fold(0.0, |worst, b| max(worst, b.abs()))
}

/// The common part of two curvatures, for each axis: the curvature of the path between them.
pub(crate) fn common<const N: usize>(one: &[f32; N], other: &[f32; N]) -> [f32; N] {
    let mut both = *one;
    for (both, other) in both.iter_mut().zip(other) {
        *both = if *both * other <= 0.0 {
            0.0
        } else if both.abs() < other.abs() {
            *both
        } else {
            *other
        };
    }
    both
}

impl<const AXES: usize> Piece<AXES> {
    /// Returns by how much the squared speed can rise from each of `xs` over the piece, mm²/s².
    /// `from` is the curvature at the end with the speed `x`, `to` is the curvature at the other
    /// end.
    ///
    /// Each axis has the share `p` of a gain `g`, and its limits are
    ///
    /// ```text
    ///   |p·g + from·x| ≤ 1        |p·g + to·(x + g)| ≤ 1
    /// ```
    pub(crate) fn gains<const N: usize>(
        &self,
        xs: [f32; N],
        from: &[f32],
        to: &[f32],
        rise: Rise,
    ) -> [f32; N] {
        let per_length = rise.sign() * 0.5 / self.length;
        let mut gains = [f32::INFINITY; N];
        for (q, (from, to)) in self.tangent.iter().zip(from.iter().zip(to)) {
            if *q == 0.0 && *to == 0.0 {
                continue; // the axis rests
            }
            let share = q * per_length;
            let one = 1.0f32.copysign(share);
            let (per_share, steeper) = (1.0 / share, share + to);
            // If `steeper` and `share` differ in sign, the limit at the other end bounds
            // nothing.
            let ends = (steeper * one > 0.0).then(|| 1.0 / steeper);
            for (gain, x) in gains.iter_mut().zip(&xs) {
                let start = min(per_share.abs(), (one - from * x) * per_share);
                *gain = min(*gain, start);
                if let Some(per_steeper) = ends {
                    *gain = min(*gain, (one - to * x) * per_steeper);
                }
            }
        }
        gains.map(|gain| max(gain, 0.0))
    }

    /// The squared speed at this end for which the other end may be fastest; [`Peak::NONE`] if
    /// there is none.
    pub(crate) fn peak(&self, from: &[f32], to: &[f32], rise: Rise) -> Peak {
        let per_length = rise.sign() * 0.5 / self.length;
        let falls = |(q, from): (&f32, &f32)| {
            let share = q * per_length;
            from * share > share * share
        };
        if !self.tangent.iter().zip(from).any(falls) {
            return Peak::NONE; // without a division
        }
        let mut bounds = [Bound::NONES; AXES];
        let axes = self.tangent.iter().zip(from.iter().zip(to));
        for (bounds, (q, (from, to))) in bounds.iter_mut().zip(axes) {
            bound(bounds, q * per_length, *from, *to);
        }
        Peak::of(bounds.as_flattened())
    }

    /// The highest squared speed (mm²/s²) at this end with which the other end may have the squared
    /// speed `other`: if a bound falls, the other end may be faster if this end is slower.
    pub(crate) fn fastest_end(&self, other: f32, from: &[f32], rise: Rise) -> f32 {
        let per_length = rise.sign() * 0.5 / self.length;
        let axes = self.tangent.iter().zip(from);
        let fastest = axes.fold(f32::INFINITY, |fastest, (q, from)| {
            let share = q * per_length;
            let falls = (from * 1.0f32.copysign(share)) - share.abs();
            if falls > 0.0 {
                min(fastest, (1.0 - share.abs() * other) / falls)
            } else {
                fastest
            }
        });
        max(fastest * ROUNDED_DOWN, 0.0)
    }

    /// The acceleration left along the path at the squared speed `x` if it turns with the
    /// curvature `bend`, mm/s².
    pub(crate) fn left(&self, x: f32, bend: &[f32], rise: Rise) -> f32 {
        let axes = self.tangent.iter().zip(bend);
        let left = axes.fold(f32::INFINITY, |left, (q, bend)| {
            let one = 1.0f32.copysign(q * rise.sign());
            min(left, min(1.0, 1.0 - one * bend * x) / q.abs())
        });
        max(left, 0.0)
    }
}

impl Rise {
    /// The sign of the direction along the piece.
    const fn sign(self) -> f32 {
        match self {
            Self::Forward => 1.0,
            Self::Backward => -1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Two steep bounds cross one that hardly rises, at nearly the same height.
    #[test]
    fn the_lower_one_of_two_crossings_is_the_peak() {
        let angle = 4.711_852_6_f32;
        let piece = Piece {
            tangent: [angle.cos(), angle.sin()],
            length: 4.764_33,
        };
        let bends = [[0.681_002_9, 0.488_359_4], [0.203_122_6, 0.0]];
        let peak = piece.peak(&bends[0], &bends[1], Rise::Backward);
        assert!((peak.at - 1.26).abs() < 0.01, "{}", peak.at);
    }

    proptest! {
        /// Of 1000 speeds at this end none lets the other end be faster than promised, and one lets
        /// it be as fast.
        #[test]
        fn the_best_speed_at_one_end_lets_the_other_be_as_fast_as_promised(
            angle in 0.0..core::f32::consts::TAU, length in 0.01f32..10.0, share in 0.0f32..1.0,
            bends in prop::array::uniform4(-1.0f32..1.0),
        ) {
            let piece = Piece { tangent: [angle.cos(), angle.sin()], length };
            let [fx, fy, tx, ty] = bends;
            let (from, to, rise) = ([fx, fy], [tx, ty], Rise::Backward);
            let most = share * cap(&from).min(cap(&to));
            let there = |x: f32| x + piece.gains([x], &from, &to, rise)[0];
            let peak = piece.peak(&from, &to, rise);
            let best = min(most, peak.at);
            for step in 0..=1000 {
                prop_assert!(there(most * step as f32 / 1000.0) <= there(best) * 1.0001);
            }
            if peak.at < most {
                prop_assert!((there(best) / peak.reached - 1.0).abs() < 1e-4 || there(best) == best);
            }
        }

        /// At the fastest end the other end may be as fast as it was to be; at a faster one it may
        /// not.
        #[test]
        fn no_faster_end_lets_the_other_end_be_as_fast(
            angle in 0.0..core::f32::consts::TAU, length in 0.01f32..10.0, share in 0.1f32..0.95,
            bends in prop::array::uniform4(-1.0f32..1.0),
        ) {
            let piece = Piece { tangent: [angle.cos(), angle.sin()], length };
            let [fx, fy, tx, ty] = bends;
            let (from, to, rise) = ([fx, fy], [tx, ty], Rise::Backward);
            let there = |x: f32| x + piece.gains([x], &from, &to, rise)[0];
            let (peak, most) = (piece.peak(&from, &to, rise), cap(&from));
            if peak.at > 0.95 * most || there(peak.at) < 1.05 * most {
                return Ok(());
            }
            let other = there(peak.at) - share * (there(peak.at) - most);
            let end = piece.fastest_end(other, &from, rise);
            if 1.02 * end > most {
                return Ok(());
            }
            prop_assert!(there(end * 0.999) >= other * 0.9999, "{} {}", there(end * 0.999), other);
            prop_assert!(there(end * 1.01) < other, "{} {}", there(end * 1.01), other);
        }

        /// Computed in `f64` at both ends: no axis exceeds its limit, and one of them reaches it,
        /// or nothing bounds the gain.
        #[test]
        fn a_gain_uses_all_of_one_axis_and_no_more_of_any(
            angle in 0.0..core::f32::consts::TAU, length in 0.01f32..10.0, share in 0.0f32..1.0,
            bends in prop::array::uniform4(-1.0f32..1.0), forward: bool,
        ) {
            let piece = Piece { tangent: [angle.cos(), angle.sin()], length };
            let ([fx, fy, tx, ty], rise) = (bends, if forward { Rise::Forward } else { Rise::Backward });
            let (from, to) = ([fx, fy], [tx, ty]);
            let x = share * cap(&from).min(cap(&to));
            let [gain] = piece.gains([x], &from, &to, rise);
            let gain = f64::from(gain);
            prop_assert!(gain >= 0.0);
            let u = gain / 2.0 / f64::from(length) * if forward { 1.0 } else { -1.0 };
            let mut most = 0.0f64;
            for axis in 0..2 {
                let q = f64::from(piece.tangent[axis]);
                let asked = |bend: f32, x: f64| (q * u + f64::from(bend) * x).abs();
                let start = asked(from[axis], x.into()).max((q * u).abs());
                let end = asked(to[axis], f64::from(x) + gain);
                // Above the highest speed of the other end the gain does not matter: other limits
                // bound the speed there.
                let end = if f64::from(x) + gain > f64::from(cap(&to)) * 1.0001 { 1.0 } else { end };
                prop_assert!(start < 1.0 + 1e-4 && end < 1.0 + 1e-4, "{} {}", start, end);
                most = most.max(start).max(end);
            }
            prop_assert!(most > 1.0 - 1e-3, "{}", most);
        }
    }
}
