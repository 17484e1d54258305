//! Arcs: from the program's words to the centre.
//!
//! Lengths are whole numbers of 10⁻⁹ mm and are compared by their exact squares, so that a radius
//! of half the chord is enough and 10⁻⁹ mm less is not. Only the height of a centre over its chord
//! is rounded.

use super::modal_state::Turn;
use super::Coordinate;
use crate::Status;
use leadscrew_gcode::Number;

/// Finds the centre of an arc given by its radius (R), as an offset from the start.
///
/// `travel` leads from start to end in the plane. A negative radius asks for the arc of more than
/// half a turn. The centre lies on the bisector of the chord, `√(r² − (chord/2)²)` from its middle.
///
/// # Errors
///
/// [`Status::InvalidTarget`] if start and end are the same: the circle could lie anywhere.
/// [`Status::ArcRadiusTooSmall`] if the radius is less than half the chord.
pub(super) fn centre_from_radius(
    travel: [Coordinate; 2],
    radius: Coordinate,
    turn: Turn,
) -> Result<[Coordinate; 2], Status> {
    let chord2 = square_of_length(travel);
    if chord2 == 0 {
        return Err(Status::InvalidTarget);
    }
    let height2 = (4 * square(radius))
        .checked_sub(chord2)
        .ok_or(Status::ArcRadiusTooSmall)?;
    // The ratio of twice the centre's height over the chord to the chord's length. The centre of a
    // short clockwise arc lies to the right of the chord.
    let ratio = libm::sqrtf(height2 as f32 / chord2 as f32);
    let to_the_left = (turn == Turn::Counterclockwise) == (radius >= Coordinate::ZERO);
    let height = if to_the_left { ratio } else { -ratio };
    let [x, y] = travel;
    Ok([
        half(x) - scaled(y, 0.5 * height),
        half(y) + scaled(x, 0.5 * height),
    ])
}

/// The length by which one end of an arc may be farther from the centre than the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ArcMismatch {
    /// The difference that is always allowed, mm.
    pub length: Number,
    /// The share of the radius that is allowed up to 0.5 mm, %.
    pub percent: Number,
}

impl ArcMismatch {
    /// GRBL allows 0.005 mm, and beyond that a thousandth of the radius up to 0.5 mm.
    pub const GRBL: Self = Self {
        length: Number::from_nanos(5_000_000),
        percent: Number::from_nanos(100_000_000),
    };

    /// The difference that is allowed at this radius; both 10⁻⁹ mm.
    fn at(self, radius: u64) -> u64 {
        let percent = self.percent.nanos().unsigned_abs() / 1_000;
        let share = (radius / 1_000).saturating_mul(percent) / 100_000;
        self.nanos().max(share.min(SHARE_ENDS))
    }

    fn nanos(self) -> u64 {
        self.length.nanos().unsigned_abs()
    }
}

/// Finds the centre of an arc given by its offset from the start (I, J, K).
///
/// Start and end are to be equally far from it. A difference that GRBL allows changes nothing, and
/// the arc ends with a small step. A larger one that is `allowed` moves the centre to the nearest
/// place that is equally far from both.
///
/// # Errors
///
/// The difference, if it is not allowed; or if the centre of an arc of more than half a turn would
/// move by more than the difference that is allowed.
pub(super) fn fitted_centre(
    travel: [Coordinate; 2],
    centre: [Coordinate; 2],
    turn: Turn,
    allowed: ArcMismatch,
) -> Result<[Coordinate; 2], Coordinate> {
    let [x, y] = travel;
    let [i, j] = centre;
    let start2 = square_of_length(centre);
    let end2 = square_of_length([x - i, y - j]);
    let longest = u128::from(i.nanos().unsigned_abs().max(j.nanos().unsigned_abs()));
    // The radii at start and end, a and b, differ by
    // |a − b| = |a² − b²| / (a + b)
    // and a + b is no less than a's longest component: most arcs need no root.
    let least = ArcMismatch::GRBL.nanos().min(allowed.nanos());
    if start2.abs_diff(end2) <= u128::from(least) * longest {
        return Ok(centre);
    }
    let (start, end) = (root(start2), root(end2));
    let mismatch = start.abs_diff(end);
    let apart = Coordinate::from_nanos(mismatch.min(i64::MAX as u64) as i64);
    let usual = ArcMismatch::GRBL
        .nanos()
        .max((start / 1_000).min(SHARE_ENDS));
    let most = match allowed == ArcMismatch::GRBL {
        true => usual,
        false => allowed.at(start),
    };
    if mismatch > most {
        return Err(apart);
    }
    if mismatch <= usual {
        return Ok(centre);
    }
    // The centre moves along the chord, by (end² − start²) / (2·chord).
    let [[x, y], [i, j]] = [travel, centre].map(|place| place.map(mm));
    let chord2 = x * x + y * y;
    let share = mismatch as f32 * (start + end) as f32 / (2e18 * chord2);
    let is_long = (x * j > y * i) != (turn == Turn::Counterclockwise);
    if is_long && share * share * chord2 * 1e18 > (most as f32) * (most as f32) {
        return Err(apart);
    }
    let share = if end2 > start2 { share } else { -share };
    let ([i, j], [x, y]) = (centre, travel);
    Ok([i + scaled(x, share), j + scaled(y, share)])
}

/// The share of the radius is allowed up to 0.5 mm, in 10⁻⁹ mm.
const SHARE_ENDS: u64 = 500_000_000;

fn square_of_length([x, y]: [Coordinate; 2]) -> u128 {
    square(x) + square(y)
}

fn square(length: Coordinate) -> u128 {
    let length = u128::from(length.nanos().unsigned_abs());
    length * length
}

/// The square root, rounded down, bit by bit: 128-bit division would cost more.
fn root(square: u128) -> u64 {
    let bits = (128 - square.leading_zeros()).div_ceil(2);
    let mut root = 0;
    for bit in (0..bits).rev() {
        let trial = root | 1_u64 << bit;
        if u128::from(trial) * u128::from(trial) <= square {
            root = trial;
        }
    }
    root
}

fn half(length: Coordinate) -> Coordinate {
    Coordinate::from_nanos(length.nanos() / 2)
}

#[inline(never)] // it is called four times
fn scaled(length: Coordinate, factor: f32) -> Coordinate {
    // No word is beyond ±10⁹ mm, and neither is the part of one.
    Coordinate::from_mm(mm(length) * factor).unwrap_or_default()
}

fn mm(length: Coordinate) -> f32 {
    Number::from_nanos(length.nanos()).to_f32()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn mm(value: f64) -> Coordinate {
        Coordinate::from_nanos((value * 1e9).round() as i64)
    }

    #[test]
    fn the_short_and_the_long_arc_have_their_centres_on_either_side() {
        let travel = [mm(1.0), mm(1.0)];
        let cases = [
            (Turn::Clockwise, 1.0, [1.0, 0.0]),
            (Turn::Clockwise, -1.0, [0.0, 1.0]),
            (Turn::Counterclockwise, 1.0, [0.0, 1.0]),
            (Turn::Counterclockwise, -1.0, [1.0, 0.0]),
        ];
        for (turn, radius, [i, j]) in cases {
            let centre = centre_from_radius(travel, mm(radius), turn);
            assert_eq!(centre, Ok([mm(i), mm(j)]), "{turn} R{radius}");
        }
    }

    #[test]
    fn half_the_chord_is_the_smallest_radius() {
        let travel = [mm(3.0), mm(4.0)];
        let centre = centre_from_radius(travel, mm(2.5), Turn::Clockwise);
        assert_eq!(centre, Ok([mm(1.5), mm(2.0)]));
        let centre = centre_from_radius(travel, mm(2.499999999), Turn::Clockwise);
        assert_eq!(centre, Err(Status::ArcRadiusTooSmall));
    }

    #[test]
    fn an_arc_by_radius_needs_two_ends() {
        let centre = centre_from_radius([Coordinate::ZERO; 2], mm(5.0), Turn::Clockwise);
        assert_eq!(centre, Err(Status::InvalidTarget));
    }

    /// Each case: the travel along X, I, and whether they are accepted. Grbl's answers, and the
    /// thresholds to the last digit.
    #[test]
    fn the_radii_may_differ_by_5_um_or_a_thousandth_up_to_half_a_millimetre() {
        let cases = [
            (2.0, 1.0024, true),
            (2.0, 1.0025, true),
            (2.0, 1.002500001, false),
            (2.0, 1.0026, false),
            (20.0, 10.004, true),
            (20.0, 10.005, true),
            (20.0, 10.0052, false),
            (200.0, 100.04, true),
            (200.0, 100.06, false),
            (2000.0, 1000.2, true),
            (2000.0, 1000.25, true),
            (2000.0, 1000.250000001, false),
            (2000.0, 1000.26, false),
            (0.0, 0.0, true),
            (1.0, 0.0, false),
        ];
        for (x, i, allowed) in cases {
            let centre = [mm(i), Coordinate::ZERO];
            let answer = fitted_centre(
                [mm(x), Coordinate::ZERO],
                centre,
                Turn::Clockwise,
                ArcMismatch::GRBL,
            );
            assert_eq!(answer.ok(), allowed.then_some(centre), "X{x} I{i}");
        }
    }

    #[test]
    fn a_difference_beyond_what_is_allowed_is_told() {
        let answer = fitted_centre(
            [mm(2.0), mm(0.0)],
            [mm(1.02), mm(0.0)],
            Turn::Clockwise,
            ArcMismatch::GRBL,
        );
        assert_eq!(answer, Err(mm(0.04)));
    }

    /// The ends of an almost full circle are close together: its centre would have to move far.
    #[test]
    fn a_long_arc_whose_centre_would_move_far_is_refused() {
        let allowed = ArcMismatch {
            length: Number::from_nanos(100_000_000),
            ..ArcMismatch::GRBL
        };
        let fit = |turn| fitted_centre([mm(0.5), mm(0.2)], [mm(0.0), mm(10.0)], turn, allowed);
        assert_eq!(fit(Turn::Clockwise).map_err(|_| ()), Err(()));
        assert!(fit(Turn::Counterclockwise).is_err());
        // Within what is allowed: to the left of the start the arc is short.
        let fit = |turn| fitted_centre([mm(0.5), mm(0.05)], [mm(0.0), mm(10.0)], turn, allowed);
        assert!(fit(Turn::Clockwise).is_err());
        assert!(fit(Turn::Counterclockwise).is_ok());
    }

    proptest! {
        /// The reference is geometry in double precision: equal distances, and no move across the
        /// chord.
        #[test]
        fn a_centre_that_is_moved_is_equally_far_from_both_ends(
            radius in 1.0..500.0_f64, from in 0.0..6.3_f64, sweep in 0.3..3.0_f64,
            apart in -0.4..0.4_f64,
        ) {
            let allowed = ArcMismatch {
                length: Number::from_nanos(400_100_000), percent: Number::from_int(0),
            };
            let point = |radius: f64, angle: f64| [radius * angle.cos(), radius * angle.sin()];
            let (start, end) = (point(radius, from), point(radius + apart, from + sweep));
            let travel = [end[0] - start[0], end[1] - start[1]];
            let given = [-start[0], -start[1]];
            let fitted = fitted_centre(travel.map(mm), given.map(mm), Turn::Counterclockwise, allowed)
                .unwrap().map(|c| c.nanos() as f64 / 1e9);
            if apart.abs() > 0.0051 && apart.abs() > radius / 999.0 {
                let far = f64::hypot(travel[0] - fitted[0], travel[1] - fitted[1]);
                prop_assert!((f64::hypot(fitted[0], fitted[1]) - far).abs() < 1e-6 * radius);
            }
            let moved = [fitted[0] - given[0], fitted[1] - given[1]];
            let across = moved[0] * travel[1] - moved[1] * travel[0];
            prop_assert!(across.abs() < 1e-5 * radius, "{}", across);
            prop_assert!(f64::hypot(moved[0], moved[1]) < 4.0 * apart.abs() + 1e-6);
        }

        #[test]
        fn a_root_is_rounded_down(n in 0..u64::MAX / 2) {
            let square = u128::from(n) * u128::from(n);
            prop_assert_eq!(root(square), n);
            prop_assert_eq!(root(square + 2 * u128::from(n)), n);
        }

        #[test]
        fn a_centre_from_a_radius_is_that_far_from_both_ends(
            x in -1000.0..1000.0, y in -1000.0..1000.0, surplus in 1.0..3.0_f64,
            long: bool, turn in prop_oneof![Just(Turn::Clockwise), Just(Turn::Counterclockwise)],
        ) {
            let radius = f64::hypot(x, y) / 2.0 * surplus + 1e-6;
            let sign = if long { -1.0 } else { 1.0 };
            let [i, j] = centre_from_radius([mm(x), mm(y)], mm(sign * radius), turn).unwrap()
                .map(|c| c.nanos() as f64 / 1e9);
            prop_assert!((f64::hypot(i, j) - radius).abs() < 1e-6 * radius.max(1.0));
            prop_assert!((f64::hypot(x - i, y - j) - radius).abs() < 1e-6 * radius.max(1.0));
        }
    }
}
