//! Faults that show while words are read, from left to right.

use super::{expect_at_power_up, Bench};
use crate::Status;

#[test]
fn what_is_no_letter_is_error_1() {
    for line in [
        "1", "-1", "1G0", "=", "*", "#1=2", "@", "\"", "[1]", "%", "G0X1.2.3", "G0X1-2", "G0X1,5",
        "G0\x7f", "G0_X0", "G0X0*12", "G0C)X0", ")",
    ] {
        expect_at_power_up(&[(line, if line == "G0C)X0" { 2 } else { 1 })]);
    }
}

#[test]
fn a_letter_without_a_number_is_error_2() {
    for line in [
        "G", "M", "X", "F", "N", "NX", "X[1]", "G0X#1", "G0X-", "G0X.", "G0X+", "G0X-.", "G0X--1",
        "G0X+-1", "GX", "G.", "G,0", "D", "Q",
    ] {
        expect_at_power_up(&[(line, 2)]);
    }
}

#[test]
fn letters_and_codes_that_do_not_exist_are_error_20() {
    for letter in "ABCDEHOQUVW".chars() {
        expect_at_power_up(&[(&std::format!("{letter}1"), 20)]);
    }
    for code in [
        "G5", "G10.2", "G28.2", "G30.3", "G38", "G38.1", "G38.6", "G41", "G42", "G43", "G43.2",
        "G61.1", "G64", "G90.1", "G91.2", "G92.2", "G92.3", "G95", "G96", "G99", "G255", "G300",
        "G-1", "M6", "M7", "M10", "M19", "M47", "M48", "M56", "M60", "M98", "M100", "M255",
    ] {
        let expected = if code == "G10.2" { 23 } else { 20 };
        expect_at_power_up(&[(code, expected)]);
    }
}

#[test]
fn a_code_with_a_fraction_that_means_nothing_is_error_23() {
    for code in [
        "G0.005", "G1.5", "G4.1", "G10.1", "G17.1", "G20.5", "G40.1", "G53.1", "G54.1", "G59.3",
        "G80.1", "G93.5", "G256", "G257", "M256", "M258", "M-3", "M3.1", "M3.5", "M5.01", "M30.1",
        "M0.5",
    ] {
        expect_at_power_up(&[(code, 23)]);
    }
}

#[test]
fn fractions_are_rounded_to_hundredths() {
    let mut bench = Bench::<3>::after(&["F100"]);
    bench.expect(&[
        ("G0.004", 0),
        ("G1.0049", 0),
        ("G38.204Z-1", 0),
        ("G38.196Z-2", 0),
        ("G-0", 0),
        ("G.0", 0),
        ("G+0", 0),
        ("G00", 0),
        ("G49.1", 0),
        ("G49.5", 0),
        ("M3.0", 0),
        ("M003", 0),
    ]);
    bench.run("G38.204Z-1");
    assert!(bench.modes().starts_with("G38.2 "));
}

#[test]
fn a_tool_number_over_255_is_error_38_before_anything_else_about_it() {
    expect_at_power_up(&[
        ("T0", 0),
        ("T255", 0),
        ("T1.9", 0),
        ("T255.9", 38),
        ("T256", 38),
        ("T99999", 38),
        ("T1T256", 38),
        ("T-1", 4),
    ]);
}

#[test]
fn a_repeated_word_is_error_25() {
    for line in [
        "X1X1", "G0X1Y1X2", "F1F2", "S1S1", "T1T2", "N1N2", "I1I1", "P1P1", "L2L2", "R1R1", "J1J2",
        "K1K1", "G4P0P0", "F1F-1", "G0X0X10",
    ] {
        expect_at_power_up(&[(line, 25)]);
    }
}

#[test]
fn negative_f_n_p_s_and_t_are_error_4() {
    for letter in "FNPST".chars() {
        expect_at_power_up(&[(&std::format!("{letter}-1"), 4)]);
        expect_at_power_up(&[(&std::format!("{letter}-0.1"), 4)]);
    }
    expect_at_power_up(&[("F-0", 0)]);
}

#[test]
fn two_words_of_one_modal_group_are_error_21() {
    for line in [
        "G17G18",
        "G20G21",
        "G90G91",
        "G93G94",
        "G54G55",
        "G61G61",
        "G40G40",
        "G91.1G91.1",
        "G28.1G30.1",
        "G92.1G92X0",
        "G4P0G53",
        "G28G4P1",
        "G80G0",
        "G0G80",
        "M3M4",
        "M3M5",
        "M0M2",
        "M0M1",
        "M2M30",
        "M8M9",
    ] {
        expect_at_power_up(&[(line, 21)]);
    }
    expect_at_power_up(&[("G90G91.1", 0)]);
}

#[test]
fn two_commands_for_the_axis_words_are_error_24_even_of_one_group() {
    for line in [
        "G0G1",
        "G1G2",
        "G0G1.5",
        "G0G38.9",
        "G28G30",
        "G1G28X1F1",
        "G28G1X1F1",
        "G0G10L2P1X1",
        "G10L2P1G0X1",
        "G0G92X1",
        "G92G0X1",
        "G43.1Z1G0X1",
        "G0G43.1Z1",
        "G38.2G92X1F1",
        "G10L2P1X0G92",
        "G92X0G10L2P1",
        "G43.1Z1G49",
    ] {
        expect_at_power_up(&[(line, 24)]);
    }
    expect_at_power_up(&[("G4P0G0X0", 0), ("G53G0X0", 0), ("G28.1G0X0", 0)]);
}

#[test]
fn of_two_faults_the_left_one_is_answered() {
    expect_at_power_up(&[
        ("G0X1Q1X1", 20),
        ("G0X1X1Q1", 25),
        ("G99X", 20),
        ("XG99", 2),
        ("M6T1", 20),
        ("T12M6", 20),
        ("G0X1E2", 20),
        ("F-1G99", 4),
    ]);
}

#[test]
fn the_column_is_that_of_the_word_or_byte_that_is_wrong() {
    let cases = [
        ("G0X1.2.3", 6),
        ("G0X", 3),
        ("G90G91", 3),
        ("G0X1X2", 4),
        ("G1X1Q3", 4),
        ("F10S-1", 3),
    ];
    for (line, column) in cases {
        let fault = Bench::<3>::new().send(line.as_bytes()).unwrap_err();
        assert_eq!(fault.column, column, "{line}");
    }
}

#[test]
fn m7_and_m56_exist_where_the_machine_has_them() {
    let mut bench = Bench::<3>::new();
    bench.dialect.mist = true;
    bench.dialect.parking_override = true;
    bench.expect(&[
        ("M7", 0),
        ("M7M8", 21),
        ("M56", 0),
        ("M56P0", 0),
        ("M56P0M56", 21),
    ]);
}

#[test]
fn axis_letters_exist_as_far_as_the_machine_has_axes() {
    let mut bench = Bench::<5>::new();
    bench.expect(&[("G0A1B2", 0), ("G0C1", 20)]);
    assert_eq!(bench.position(), [0.0, 0.0, 0.0, 1.0, 2.0]);
}

#[test]
fn a_number_beyond_all_numbers_gets_the_answer_of_its_letter() {
    Bench::<3>::new().expect(&[
        ("X1P99999999999", 36),
        ("G10L2P1X99999999999", 52),
        ("G92Y-99999999999", 52),
        ("G43.1Z99999999999", 52),
        ("F99999999999", 0),
        ("G20F99999999999", 0),
        ("S99999999999", 0),
        ("G4P99999999999", 0),
        ("T99999999999", 38),
        ("N99999999999", 27),
        ("P-99999999999", 4),
        ("G10L2P99999999999X1", 29),
        ("G10L99999999999P1X1", 20),
        ("M99999999999", 23),
        ("D99999999999", 20),
    ]);
}

#[test]
fn motion_to_a_number_beyond_all_numbers_is_refused_wherever_it_begins() {
    let offsets = "G10L2P1X-1000000000Y-1000000000Z-1000000000";
    for line in [
        "G0X99999999999",
        "G0X-99999999999",
        "G91G0X99999999999",
        "G53G0X99999999999",
        "G20G0X99999999999",
        "G28X99999999999",
        "G1F100Y99999999999",
        "G2X99999999999I1F100",
        "G2X1I99999999999F100",
        "G2X1R99999999999F100",
        "G38.2Z99999999999F100",
    ] {
        for before in ["", offsets, "G92X1000000000Y1000000000Z1000000000"] {
            let mut bench = Bench::<3>::after(&[before]);
            let start = bench.position();
            let fault = bench.send(line.as_bytes()).unwrap_err();
            assert_eq!(fault.status, Status::OutOfRange, "{before} {line}");
            assert_eq!(bench.position(), start);
        }
        assert!(Bench::<3>::new().jog("X99999999999F100").is_err());
    }
}

/// As in Grbl, a target may be as far away as it likes: the alarm is the answer.
#[test]
fn with_soft_limits_a_target_beyond_reach_is_taken_and_lies_outside_every_travel() {
    for (line, sign) in [
        ("G0X99999999999", 1),
        ("G0X-99999999999", -1),
        ("G91G0X99999999999", 1),
        ("G53G0X-99999999999", -1),
        ("G92X-1000000000\nX0", 1),
        ("G38.2X-99999999999F100", -1),
    ] {
        let mut bench = Bench::<3>::new();
        bench.soft_limits = true;
        for line in line.lines() {
            bench.send(line.as_bytes()).unwrap();
        }
        let target = bench.interpreter.position()[0];
        let outside = (bench.reach[0].nanos() + 1) * sign;
        assert_eq!(target.nanos(), outside, "{line}");
    }
    let mut bench = Bench::<3>::new();
    bench.soft_limits = true;
    let jog = bench.jog("X99999999999F100").unwrap().unwrap();
    assert!(jog.travel.target[0] > bench.reach[0]);
}
