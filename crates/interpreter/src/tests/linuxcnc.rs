//! LinuxCNC's words that Grbl does not have. LinuxCNC's G-code reference defines them.

use super::{expect_at_power_up, Bench};
use crate::{AxisKind, Dialect};
use std::vec::Vec;

/// A bench that knows the words, and has carried out these lines.
fn after(lines: &[&str]) -> Bench<3> {
    let mut bench = Bench::new();
    bench.dialect = Dialect {
        linuxcnc: true,
        ..Dialect::GRBL
    };
    for line in lines {
        bench.run(line);
    }
    bench
}

/// Lines of CAM programs, and Grbl's answers to them.
const LINES: &[(&str, u8)] = &[
    ("%", 1),
    ("G64", 20),
    ("G64P0.05", 20),
    ("G64P0.05Q0.02", 20),
    ("G61.1", 20),
    ("G17G21G40G49G64P0.01G80G90G94", 20),
    ("G59.1", 23),
    ("G59.3G0X1", 23),
    ("G10L2P7X1", 29),
    ("G10L20P9X1", 29),
    ("G52X1", 20),
    ("G92.2", 20),
    ("G92.3", 20),
    ("G2I4.5F100", 26),
    ("G3Z-1I4.5F100", 32),
    ("G2X1I0.5P2F100", 36),
    ("M48", 20),
    ("M49", 20),
    ("M50P0", 20),
    ("M51", 20),
    ("M70", 20),
    ("M71", 20),
    ("M73", 20),
];

#[test]
fn each_word_is_taken_and_without_the_dialect_it_is_refused_as_in_grbl() {
    expect_at_power_up(LINES);
    for (line, _) in LINES {
        after(&[]).expect(&[(line, 0)]);
    }
}

/// Lines of programs, Grbl's answer to each line, and our answer. The first seven of Grbl's answers
/// are recorded.
const OF_PROGRAMS: &[(&str, u8, u8)] = &[
    ("#1=2", 1, 206),
    ("[1]", 1, 206),
    ("X[1]", 2, 206),
    ("G0X#1", 2, 206),
    ("O1", 20, 205),
    ("M98", 20, 205),
    ("M99", 20, 205),
    ("G0X-#<way>", 2, 206),
    ("G0X[1+2]Y2", 2, 206),
    ("G0XSIN[30]", 2, 206),
    ("N30#5=[2*3]", 1, 206),
    ("O100IF[#1GT2]", 20, 205),
    ("O100SUB", 20, 205),
    ("N7O100SUB", 20, 205),
    ("O<NAME>CALL[1]", 2, 205),
    ("O#1CALL", 2, 205),
    ("O[1+2]CALL", 2, 205),
    ("OX", 2, 205),
    ("G65P100A1", 20, 205),
    ("M98P#1", 20, 205),
    ("M098P100L2", 20, 205),
    // Lines that are wrong in a program, too.
    ("G999X#1", 20, 20),
    ("M98.5", 23, 23),
    ("G1X", 2, 2),
    ("G1X1.2.3", 1, 1),
    ("W[1]", 2, 206),
    ("W1", 20, 20),
    ("M097", 20, 20),
];

#[test]
fn a_line_of_a_program_is_told_as_such_and_without_the_dialect_as_in_grbl() {
    for (line, grbl, ours) in OF_PROGRAMS {
        expect_at_power_up(&[(line, *grbl)]);
        after(&[]).expect(&[(line, *ours)]);
    }
}

#[test]
fn words_that_grbl_takes_too_stay_as_they_are() {
    for lines in [["G0G49", "G49G0X1"], ["G61", "G0X1"], ["M3S10", "G1X1F10"]] {
        let mut grbl = Bench::<3>::new();
        let mut ours = after(&[]);
        for line in lines {
            assert_eq!(grbl.run(line), ours.run(line), "{line}");
        }
    }
}

#[test]
fn a_percent_sign_stands_alone() {
    after(&[]).expect(&[("%X1", 1), ("G0X1%", 1), ("%%", 1)]);
    assert_eq!(after(&["%"]).modes(), after(&[]).modes());
}

#[test]
fn path_control_changes_no_motion() {
    let exact = after(&["G1X1F100"]).run("Y1");
    for word in ["G61", "G61.1", "G64", "G64P0.5"] {
        assert_eq!(after(&[word, "G1X1F100"]).run("Y1"), exact, "{word}");
    }
    after(&[]).expect(&[("G61G64", 21), ("G64R1", 36), ("G64P-1", 4), ("G61P1", 36)]);
    // I and Q of one line would share a place.
    after(&["F100"]).expect(&[("G64Q1G2X1I0.5", 36)]);
}

#[test]
fn a_circle_needs_no_axis_words_and_a_helix_none_in_its_plane() {
    let mut bench = after(&["G0X1Y2", "F100"]);
    let commands = bench.run("G2I4.5");
    assert_eq!(commands, ["ARC G2 G17 I4.5 J0 X1 Y2 Z0 F100"]);
    assert_eq!(bench.position(), [1.0, 2.0, 0.0]);
    let commands = bench.run("G3Z-3J1P3");
    assert_eq!(commands, ["ARC G3 G17 I0 J1 P3 X1 Y2 Z-3 F100"]);
    // No centre; a centre that is none of the plane's; a radius; no G2 on the line.
    bench.expect(&[("G2", 26), ("G2K1", 35), ("G2R1", 26), ("I4.5", 36)]);
}

#[test]
fn the_turns_of_an_arc_are_whole_and_at_most_a_hundred() {
    let mut bench = after(&["F100"]);
    bench.expect(&[
        ("G2X1I0.5P1", 0),
        ("G2X2I0.5P100", 0),
        ("G2X3I0.5P0", 52),
        ("G2X3I0.5P1.5", 52),
        ("G2X3I0.5P101", 52),
        ("G2X3I0.5P99999999999", 52),
        ("G2X3I0.5P-1", 4),
        ("G1X3P2", 36),
    ]);
    assert_eq!(bench.position()[0], 2.0);
}

#[test]
fn nine_systems_have_origins_of_their_own() {
    let mut bench = after(&["G10L2P7X10", "G10L2P9X30Y5", "G59.3", "G0X1"]);
    assert_eq!(bench.position(), [31.0, 0.0, 0.0]);
    assert!(bench.modes().contains(" G59.3 "), "{}", bench.modes());
    bench.run("G10L20P0X0");
    let stored = bench.run("G59.1G0X0");
    assert_eq!(stored[0], "WORK OFFSET X10 Y0 Z0");
    assert_eq!(bench.run("G59.3X0").len(), 2);
    assert_eq!(bench.position(), [31.0, 0.0, 0.0]);
    bench.expect(&[("G10L2P10X1", 29), ("G59.4", 23), ("G59.1G54", 21)]);
}

#[test]
fn g92_2_puts_the_offset_aside_and_g92_3_puts_it_in_force_again() {
    let mut bench = after(&["G0X5", "G92X1"]);
    assert_eq!(bench.run("G92.2"), ["WORK OFFSET X0 Y0 Z0"]);
    bench.run("G0X7");
    assert_eq!(bench.position()[0], 7.0);
    assert_eq!(bench.run("G92.3"), ["WORK OFFSET X4 Y0 Z0"]);
    bench.run("G92.1");
    assert_eq!(bench.run("G92.3"), ["WORK OFFSET X0 Y0 Z0"]);
    let mut bench = after(&["G92X1", "G92.2"]);
    bench.interpreter.reset();
    assert_eq!(bench.run("G92.3"), ["WORK OFFSET X0 Y0 Z0"]);
}

#[test]
fn g52_is_the_offset_that_its_words_name() {
    let mut bench = after(&["G10L2P1X100", "G0X3"]);
    assert_eq!(bench.run("G52X10Y-1"), ["WORK OFFSET X110 Y-1 Z0"]);
    assert_eq!(bench.run("G52X0"), ["WORK OFFSET X100 Y-1 Z0"]);
    bench.expect(&[
        ("G52", 26),
        ("G52X1G92X1", 24),
        ("G52X1G4P1", 21),
        ("G52.1X1", 23),
    ]);
}

#[test]
fn a_tool_s_length_is_found_from_where_it_stands() {
    let mut bench = after(&[
        "G10L2P1Z-20",
        "G10L2P9Z-50",
        "G92Z20",
        "G43.1Z7",
        "G53G0Z-12",
    ]);
    bench.dialect.tools = true;
    // With the length 12 - 20 - 3 the tool stands at Z3 in G54 with G92.
    assert_eq!(bench.run("G10L10P2Z3"), ["STORE T2 5"]);
    assert_eq!(bench.run("G10L11P2Z3"), ["STORE T2 35"]);
    bench.expect(&[("G10L10P9Z3", 203), ("G10L10P2X3", 37), ("G10L11Z3", 203)]);
}

#[test]
fn overrides_are_let_act_one_by_one_or_both() {
    let mut bench = after(&[]);
    assert_eq!(bench.run("M48"), [""; 0]);
    assert_eq!(bench.run("M49"), ["OVERRIDES feed off spindle off"]);
    assert_eq!(bench.run("M50"), ["OVERRIDES feed on spindle off"]);
    assert_eq!(bench.run("M51P1"), ["OVERRIDES feed on spindle on"]);
    assert_eq!(bench.run("M50P0"), ["OVERRIDES feed off spindle on"]);
    assert_eq!(bench.run("M49M3S5").len(), 2);
    bench.expect(&[
        ("M48M49", 21),
        ("M50M51", 21),
        ("M48P1", 36),
        ("M52P1", 20),
        ("M53P0", 20),
    ]);
    bench.run("M2");
    assert_eq!(bench.run("M48"), [""; 0]);
}

#[test]
fn modes_that_m70_keeps_are_in_force_again_after_m72() {
    let mut bench = after(&["G55G18G20G91F10S300M3M8", "M70"]);
    let kept = bench.modes();
    for line in ["G54G17G21G90F500S0M5M9", "G1X1", "M49"] {
        bench.run(line);
    }
    let commands: Vec<_> = bench.run("M72");
    assert_eq!(
        commands,
        [
            "SPINDLE M3 S300",
            "COOLANT M8",
            "OVERRIDES feed on spindle on",
            "WORK OFFSET X0 Y0 Z0",
        ]
    );
    assert_eq!(bench.modes(), kept);
    bench.expect(&[("M72", 204), ("M70", 0), ("M71", 0), ("M72", 204)]);
    bench.expect(&[
        ("M70G54", 21),
        ("M70X1", 36),
        ("M73N5", 0),
        ("N7M72", 0),
        ("M70M72", 21),
    ]);
    bench.run("M70");
    bench.interpreter.reset();
    bench.expect(&[("M72", 204)]);
}

#[test]
fn a_jog_has_none_of_these_words() {
    let bench = after(&[]);
    for line in [
        "G64X1F10",
        "G59.1X1F10",
        "G52X1F10",
        "M70X1F10",
        "M48X1F10",
        "G92.2X1F10",
    ] {
        let fault = bench.jog(line).unwrap_err();
        assert!(
            [16, 36, 21].contains(&fault.status.number()),
            "{line}: {fault}"
        );
    }
}

#[test]
fn turning_axes_keep_their_origins_in_nine_systems_too() {
    let mut bench = Bench::<4>::new();
    bench.dialect.linuxcnc = true;
    bench.axes[3] = AxisKind::Rotary;
    bench.run("G20G10L2P8A90");
    bench.run("G59.2G0A1");
    assert_eq!(bench.position()[3], 91.0);
}

#[test]
fn a_line_controls_parking_or_the_other_overrides() {
    let mut bench = after(&[]);
    bench.dialect.parking_override = true;
    bench.expect(&[("M56M48", 21), ("M49M56P0", 21), ("M56", 0), ("M48", 0)]);
}
