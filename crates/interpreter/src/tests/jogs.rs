//! `$J=`.

use super::Bench;
use std::string::ToString;

#[track_caller]
fn expect(bench: &Bench<3>, answers: &[(&str, u8)]) {
    for (line, expected) in answers {
        let answer = bench
            .jog(line)
            .map_or_else(|fault| fault.status.number(), |_| 0);
        assert_eq!(answer, *expected, "$J={line}");
    }
}

/// The recorded conversation `jog_errors`.
#[test]
fn a_jog_takes_axis_words_a_feed_units_distance_mode_and_g53() {
    expect(
        &Bench::new(),
        &[
            ("", 22),
            ("X1", 22),
            ("F100", 0),
            ("X1F0", 22),
            ("X1F-1", 4),
            ("G0X1F100", 16),
            ("G1X1F100", 16),
            ("G2X1R1F100", 16),
            ("G28X0F100", 16),
            ("G92X0F100", 16),
            ("G54X0F100", 16),
            ("G17X0F100", 16),
            ("G93X0F100", 16),
            ("G94X0F100", 16),
            ("M3X0F100", 16),
            ("M8X0F100", 16),
            ("S100X0F100", 36),
            ("T1X0F100", 36),
            ("P1X0F100", 36),
            ("I1X0F100", 36),
            ("G4P1X0F100", 16),
            ("X0X1F100", 25),
            ("A1F100", 20),
            ("X0F100G90G91", 21),
            ("N5X0F100", 0),
            ("G53F100", 0),
            ("G90F100", 0),
            ("G43.1Z1F100", 16),
            ("G49F100", 16),
            ("G80X1F100", 31),
            ("G40X0F100", 16),
            ("G61X0F100", 16),
            ("G91.1X0F100", 16),
            ("G38.2X1F100", 16),
            ("G10L2P1X0F1", 16),
            ("X1.5.5F100", 1),
        ],
    );
}

#[test]
fn the_fault_of_a_jog_points_at_the_word_that_does_not_belong() {
    let bench = Bench::<3>::new();
    for (line, column) in [("G91M3X1F100", 3), ("G91X1G17F1", 5), ("X1F1S5", 4)] {
        assert_eq!(bench.jog(line).unwrap_err().column, column, "{line}");
    }
}

#[test]
fn a_jog_inherits_units_and_distance_mode_and_may_choose_its_own() {
    let cases = [
        (["G21", "G90"], "X1F300", "X1 Y0 Z0 F300"),
        (["G20", "G91"], "X0.1F20", "X12.54 Y0 Z0 F508"),
        (["G20", "G91"], "G21X1F20", "X11 Y0 Z0 F20"),
        (["G21", "G90"], "G91X-1F300", "X9 Y0 Z0 F300"),
        (["G21", "G91"], "G53X0F300", "X0 Y0 Z0 F300"),
        (["G80", "G93"], "N7X1F300", "X1 Y0 Z0 F300 N7"),
    ];
    for (modes, line, expected) in cases {
        let bench = Bench::<3>::after(&["G0X10", modes[0], modes[1]]);
        let jog = bench.jog(line).unwrap().unwrap();
        assert_eq!(jog.travel.to_string().trim(), expected, "{line}");
    }
}

#[test]
fn a_jog_without_axis_words_moves_nothing() {
    assert_eq!(Bench::<3>::new().jog("G91F100"), Ok(None));
}

#[test]
fn a_jog_lights_the_laser_as_g1_does_whatever_the_motion_mode() {
    let mut bench = Bench::<3>::new();
    bench.laser_mode = true;
    bench.run("G1F1000M3S500");
    let cutting = |bench: &Bench<3>| bench.jog("X1F1").unwrap().unwrap().travel.spindle.cutting;
    assert!(cutting(&bench));
    bench.run("G0");
    assert!(cutting(&bench));
}
