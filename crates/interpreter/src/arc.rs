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

/// Checks that start and end are equally far from a centre given by its offset from the start (I,
/// J, K).
///
/// GRBL allows 0.005 mm, and beyond that a thousandth of the radius up to 0.5 mm.
///
/// # Errors
///
/// [`Status::InvalidTarget`] if they are not.
pub(super) fn check_centre(travel: [Coordinate; 2], centre: [Coordinate; 2]) -> Result<(), Status> {
    let [x, y] = travel;
    let [i, j] = centre;
    let start2 = square_of_length(centre);
    let end2 = square_of_length([x - i, y - j]);
    let longest = u128::from(i.nanos().unsigned_abs().max(j.nanos().unsigned_abs()));
    // The radii at start and end, a and b, differ by
    // |a − b| = |a² − b²| / (a + b)
    // where a + b is no less than a's longest component: most arcs need no root.
    if start2.abs_diff(end2) <= u128::from(ALWAYS_ALLOWED) * longest {
        return Ok(());
    }
    let (start, end) = (root(start2), root(end2));
    let mismatch = start.abs_diff(end);
    if mismatch > ALWAYS_ALLOWED && (mismatch > NEVER_ALLOWED || mismatch > start / 1000) {
        return Err(Status::InvalidTarget);
    }
    Ok(())
}

/// A difference of 0.005 mm is always allowed, in 10⁻⁹ mm.
const ALWAYS_ALLOWED: u64 = 5_000_000;
/// A difference of more than 0.5 mm is never allowed, in 10⁻⁹ mm.
const NEVER_ALLOWED: u64 = 500_000_000;

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

fn scaled(length: Coordinate, factor: f32) -> Coordinate {
    let scaled = Number::from_nanos(length.nanos()).to_f32() * factor;
    // No word is beyond ±10⁹ mm, and neither is the part of one.
    Coordinate::from_mm(scaled).unwrap_or_default()
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
            let answer = check_centre([mm(x), Coordinate::ZERO], [mm(i), Coordinate::ZERO]);
            assert_eq!(answer.is_ok(), allowed, "X{x} I{i}");
        }
    }

    proptest! {
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
