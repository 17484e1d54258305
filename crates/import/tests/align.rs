//! A job on a board that is not clamped straight: its points move to where they were found.

use leadscrew_import::align::{job, Fit, Pair, Place};
use proptest::prelude::*;

fn pairs(points: &[(Place, Place)]) -> Vec<Pair> {
    let pair = |(nominal, measured): &(Place, Place)| Pair {
        nominal: *nominal,
        measured: *measured,
    };
    points.iter().map(pair).collect()
}

/// A quarter turn counter-clockwise that moves X0 Y0 to X10 Y20.
fn quarter() -> Fit {
    Fit::new(
        &pairs(&[([0.0, 0.0], [10.0, 20.0]), ([8.0, 0.0], [10.0, 28.0])]),
        false,
    )
    .unwrap()
}

/// A scale of 2 that moves X0 Y0 to X1 Y1.
fn doubled() -> Fit {
    Fit::new(
        &pairs(&[([0.0, 0.0], [1.0, 1.0]), ([5.0, 0.0], [11.0, 1.0])]),
        true,
    )
    .unwrap()
}

fn turned(text: &str, fit: &Fit) -> Vec<String> {
    job(text, fit)
        .unwrap_or_else(|faults| panic!("{}", faults.show("job", text)))
        .lines
}

#[test]
fn only_places_change() {
    let text = "%\n(start)\nG21 G90\nM3 S1000\nG0 Z2\nN7 G0 X3 Y4 ; there (really)\nG1 Z-1 F100\nX5\n$H\nM30";
    let wanted = "%\n(start)\nG21 G90\nM3 S1000\nG0 Z2\nN7 G0 X6 Y23 ; there (really)\nG1 Z-1 F100\nX6 Y25\n$H\nM30";
    assert_eq!(turned(text, &quarter()).join("\n"), wanted);
}

#[test]
fn relative_ways_and_arcs_turn_without_the_shift() {
    let text = "G91\nG1 X3 F100\nG2 X2 Y2 I2 J0\nG3 X2 Y2 R2\nG90 G0 X1 Y1";
    let wanted = "G91\nG1 X0 Y3 F100\nG2 X-2 Y2 I0 J2\nG3 X-2 Y2 R2\nG90 G0 X9 Y21";
    assert_eq!(turned(text, &quarter()).join("\n"), wanted);
}

#[test]
fn a_scale_is_applied_to_places_centres_and_radii_when_wanted() {
    let text = "G90 G0 X1 Y2\nG2 X3 Y4 R2\nG2 X5 Y6 I2 J0\nG81 X1 Y1 Z-1 R2";
    let wanted = [
        "G90 G0 X3 Y5",
        "G2 X7 Y9 R4",
        "G2 X11 Y13 I4 J0",
        "G81 X3 Y3 Z-1 R2",
    ];
    assert_eq!(turned(text, &doubled()), wanted);
}

#[test]
fn inches_stay_inches() {
    let fit = Fit::new(
        &pairs(&[([0.0, 0.0], [25.4, 0.0]), ([10.0, 0.0], [35.4, 0.0])]),
        false,
    )
    .unwrap();
    assert_eq!(turned("G20\nG0 X1 Y0.5", &fit), ["G20", "G0 X2 Y0.5"]);
}

#[test]
fn rounding_of_short_relative_ways_does_not_add_up() {
    let turn = 0.3_f64;
    let fit = Fit::new(
        &pairs(&[
            ([0.0, 0.0], [0.0, 0.0]),
            ([1.0, 0.0], [turn.cos(), turn.sin()]),
        ]),
        false,
    )
    .unwrap();
    let lines = turned(&("G91\n".to_owned() + &"G1 X0.01\n".repeat(10_000)), &fit);
    let value = |line: &String, letter| -> f64 {
        let mut words = line.split(' ').filter_map(|word| word.strip_prefix(letter));
        words.next().map_or(0.0, |number| number.parse().unwrap())
    };
    let end = ['X', 'Y'].map(|letter| lines.iter().map(|line| value(line, letter)).sum::<f64>());
    assert!((end[0] - 100.0 * turn.cos()).abs() < 2e-4, "{end:?}");
    assert!((end[1] - 100.0 * turn.sin()).abs() < 2e-4, "{end:?}");
}

#[test]
fn what_would_change_its_meaning_is_refused_with_its_place() {
    for (text, column, part) in [
        ("G0 X1", 4, "where Y is"),
        ("G0 X1 Y1\nG28\nG0 X2", 4, "where Y is"),
        ("G18", 1, "plane"),
        ("G0 X0 Y0\nG54\nG55", 1, "other work coordinates"),
        ("G21 G90\nG0 X1 Y1\nG0 Z5 G55", 7, "other work coordinates"),
        ("G90\nG0 X1 Y1 X2", 10, "twice"),
        ("G53 G0 Z0 Z1", 11, "twice"),
        ("G92 X0 Y0", 1, "not turned"),
        ("G52 X0 Y0", 1, "not turned"),
        ("G10 L20 P1 X0", 1, "not turned"),
        ("G90.1", 1, "G91.1"),
        ("$J=G91X1F100", 1, "jog"),
        ("G0 X--1", 5, ""),
    ] {
        let faults = job(text, &quarter()).unwrap_err().0;
        assert_eq!(faults.len(), 1, "{text}: {faults:?}");
        let fault = &faults[0];
        assert_eq!(
            (fault.line as usize, fault.column),
            (text.lines().count(), column),
            "{text}: {fault}"
        );
        assert!(fault.message.contains(part), "{text}: {fault}");
    }
    // Machine coordinates do not depend on the board.
    assert_eq!(
        turned("G53 G0 X-5 Y-5\nG92 Z0", &quarter()),
        ["G53 G0 X-5 Y-5", "G92 Z0"]
    );
}

#[test]
fn points_that_say_nothing_are_refused() {
    assert!(Fit::new(&pairs(&[([1.0, 1.0], [2.0, 2.0])]), false).is_err());
    assert!(Fit::new(
        &pairs(&[([1.0, 1.0], [2.0, 2.0]), ([1.0, 1.0], [3.0, 2.0])]),
        false
    )
    .is_err());
}

#[test]
fn a_mirrored_board_is_noticed_by_three_points_and_not_by_two() {
    let corners = [
        ([0.0, 0.0], [50.0, 0.0]),
        ([40.0, 0.0], [10.01, 0.0]),
        ([0.0, 30.0], [50.0, 30.02]),
    ];
    assert!(Fit::new(&pairs(&corners), false).unwrap().is_mirrored);
    assert!(!Fit::new(&pairs(&corners[..2]), false).unwrap().is_mirrored);
    let square = [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]];
    let over = square.map(|[x, y]| ([x, y], [9.0 - x, y]));
    let fit = Fit::new(&pairs(&over), false).unwrap();
    assert!(
        fit.is_mirrored && fit.misses.iter().all(|miss| miss.is_finite()),
        "{fit:?}"
    );
    let straight = corners.map(|(nominal, [x, y])| (nominal, [50.0 - x, y]));
    assert!(!Fit::new(&pairs(&straight), false).unwrap().is_mirrored);
}

/// The sum of the squared misses for a turn, scale and shift.
fn squares(pairs: &[Pair], turn: f64, scale: f64, shift: Place) -> f64 {
    let square = |pair: &Pair| {
        let [x, y] = pair.nominal;
        let to = [
            scale * (x * turn.cos() - y * turn.sin()) + shift[0],
            scale * (x * turn.sin() + y * turn.cos()) + shift[1],
        ];
        (to[0] - pair.measured[0]).powi(2) + (to[1] - pair.measured[1]).powi(2)
    };
    pairs.iter().map(square).sum()
}

proptest! {
    #[test]
    fn no_other_turn_or_shift_misses_by_less(
        turn in -3.0..3.0_f64,
        shift in (-50.0..50.0_f64, -50.0..50.0_f64),
        noise in proptest::collection::vec((-0.2..0.2_f64, -0.2..0.2_f64), 2..7),
        applies_scale in any::<bool>(),
    ) {
        let places = [[0.0, 0.0], [100.0, 5.0], [90.0, 70.0], [5.0, 80.0], [50.0, 40.0], [20.0, 60.0]];
        let pairs: Vec<Pair> = places.iter().zip(&noise).map(|([x, y], (u, v))| Pair {
            nominal: [*x, *y],
            measured: [
                1.002 * (x * turn.cos() - y * turn.sin()) + shift.0 + u,
                1.002 * (x * turn.sin() + y * turn.cos()) + shift.1 + v,
            ],
        }).collect();
        let fit = Fit::new(&pairs, applies_scale).unwrap();
        prop_assert!((fit.scale - 1.002).abs() < 0.01);
        prop_assert_eq!(fit.length() != 1.0, applies_scale);
        let scale = if applies_scale { fit.scale } else { 1.0 };
        let best = squares(&pairs, fit.angle, scale, fit.shift());
        let told: f64 = fit.misses.iter().map(|miss| miss * miss).sum();
        prop_assert!((best - told).abs() < 1e-6, "{} {}", best, told);
        let [x, y] = fit.shift();
        for step in [-1e-3, 1e-3] {
            prop_assert!(squares(&pairs, fit.angle + step / 50.0, scale, [x, y]) >= best);
            prop_assert!(squares(&pairs, fit.angle, scale, [x + step, y]) >= best);
            prop_assert!(squares(&pairs, fit.angle, scale, [x, y + step]) >= best);
            if applies_scale {
                prop_assert!(squares(&pairs, fit.angle, scale + step / 50.0, [x, y]) >= best);
            }
        }
    }
}

#[test]
fn a_job_may_name_its_work_coordinates_before_its_places() {
    let text = "G21 G90\nG0 Z5\nG55 G0 X3 Y4\nG55\nX5";
    let wanted = "G21 G90\nG0 Z5\nG55 G0 X6 Y23\nG55\nX6 Y25";
    assert_eq!(turned(text, &quarter()).join("\n"), wanted);
    let text = "G0 X3 Y4\nG54\nX5";
    assert_eq!(
        turned(text, &quarter()).join("\n"),
        "G0 X6 Y23\nG54\nX6 Y25"
    );
}
