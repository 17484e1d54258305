//! Whose the axis words of a line are: each code beside axis words, in each motion mode.

use super::{to_mm, Bench};
use crate::Coordinate;
use std::string::String;
use std::vec::Vec;

/// A line for each motion mode that leaves the machine at its origin, and the word of the mode.
const MODES: [(&str, &str); 9] = [
    ("G0", "G0"),
    ("G1", "G1"),
    ("G2X0Y0I1", "G2"),
    ("G3X0Y0I1", "G3"),
    ("G38.3Z-1F9", "G38.3"),
    ("G38.5Z-1F9", "G38.5"),
    ("G81X0Y0Z0R0", "G81"),
    ("G83X0Y0Z0R0Q1", "G83"),
    ("G80", "G80"),
];

/// Codes that take the axis words of their line, with the words they need.
const TAKERS: [&str; 13] = [
    "G28X1",
    "G28Z0",
    "G28X1Y1Z1",
    "G91G28Z0",
    "G30X1",
    "G10L2P1X1",
    "G10L20P1X1Z2",
    "G10L2P0Y1",
    "G10L1P1Z2",
    "G92X1",
    "G92X1Y1Z1",
    "G43.1Z1",
    "G55G43.1Z1",
];

/// Codes that take no axis words.
const OTHERS: [&str; 16] = [
    "G4P0", "G17", "G18", "G20", "G90", "G91", "G91.1", "G94", "G40", "G55", "G61", "G98", "G92.1",
    "G28.1", "M8", "G43H2",
];

/// A machine with cycles and tools, at its origin, in this motion mode.
fn in_mode(line: &str) -> Bench<3> {
    let mut bench = Bench::<3>::new();
    (bench.dialect.cycles, bench.dialect.tools) = (true, true);
    for line in ["G28.1", "F100", line] {
        bench.run(line);
    }
    bench.interpreter.set_position([Coordinate::ZERO; 3]);
    bench
}

/// All that a line does: its answer, its commands and the origins afterwards.
fn done(mut bench: Bench<3>, line: &str) -> (u8, Vec<String>, [f64; 3]) {
    let status = bench.clone().answer(line);
    let commands = if status == 0 {
        bench.run(line)
    } else {
        Vec::new()
    };
    let origin = bench.interpreter.work_offset().map(to_mm);
    (status, commands, origin)
}

#[test]
fn every_mode_of_the_table_is_in_force() {
    for (line, word) in MODES {
        assert!(in_mode(line).modes().starts_with(word), "{line}");
    }
}

#[test]
fn axis_words_of_a_code_that_takes_them_mean_the_same_in_each_motion_mode() {
    for taker in TAKERS {
        let wanted = done(in_mode("G0"), taker);
        assert_eq!(wanted.0, 0, "{taker}");
        for (line, word) in MODES {
            assert_eq!(done(in_mode(line), taker), wanted, "{taker} in {word}");
        }
        let beside = std::format!("{taker}G80");
        assert_eq!(done(in_mode("G0"), &beside), wanted, "{beside}");
    }
}

#[test]
fn two_codes_that_take_axis_words_are_error_24() {
    for taker in TAKERS {
        for motion in ["G0", "G1", "G2", "G38.2", "G81"] {
            for line in [
                std::format!("{taker}{motion}"),
                std::format!("{motion}{taker}"),
            ] {
                assert_eq!(in_mode("G80").answer(&line), 24, "{line}");
            }
        }
    }
    for line in [
        "G43.1Z1G49",
        "G49G43.1Z1",
        "G49G49",
        "G43.1Z1G28X1",
        "G92X1G43.1Z1",
    ] {
        assert_eq!(in_mode("G0").answer(line), 24, "{line}");
    }
}

#[test]
fn axis_words_that_no_code_takes_are_error_31_in_g80() {
    for other in OTHERS {
        let line = std::format!("{other}X1");
        assert_eq!(in_mode("G0").answer(&line), 0, "{line}");
        assert_eq!(in_mode("G80").answer(&line), 31, "{line}");
        assert_eq!(
            in_mode("G0").answer(&std::format!("G80{line}")),
            31,
            "{line}"
        );
        assert_eq!(in_mode("G80").answer(other), 0, "{other}");
    }
    for line in ["X1", "G49X1", "G43H1Z1"] {
        assert_eq!(in_mode("G80").answer(line), 31, "{line}");
    }
}

#[test]
fn g53_takes_the_words_for_g0_and_g1_and_has_nothing_to_do_without_words() {
    for (line, word) in MODES {
        let straight = matches!(word, "G0" | "G1");
        let with_words = in_mode(line).answer("G53X1");
        assert_eq!(with_words, if straight { 0 } else { 30 }, "G53X1 in {word}");
    }
    for line in ["G53", "G80G53", "G53G80", "G53G49"] {
        assert_eq!(in_mode("G80").answer(line), 0, "{line}");
    }
}

/// As LinuxCNC documents G49: it has no axis words. Grbl ignores words beside it; that stays if
/// no other word of the line says what they are for.
#[test]
fn g49_leaves_the_axis_words_to_whoever_takes_them() {
    let with_length = |line: &str| {
        let mut bench = in_mode("G0");
        bench.run("G43.1Z3");
        bench.run(line)
    };
    let off = "WORK OFFSET X0 Y0 Z0";
    assert_eq!(with_length("G49G0Z1"), [off, "RAPID X0 Y0 Z1"]);
    assert_eq!(with_length("G1Z1G49"), [off, "FEED X0 Y0 Z1 F100"]);
    assert_eq!(with_length("G49G53Z1"), [off, "RAPID X0 Y0 Z1"]);
    assert_eq!(with_length("G53G0G49Z1"), [off, "RAPID X0 Y0 Z1"]);
    assert_eq!(
        with_length("G28Z2G49"),
        [off, "RAPID X0 Y0 Z2", "RAPID X0 Y0 Z0"]
    );
    assert_eq!(with_length("G49Z1"), [off]);
}

/// The tool's length changes first: words of G10 L20 and G92 then say where the axis is with it.
#[test]
fn an_offset_that_is_set_beside_a_tool_length_counts_with_this_length() {
    for (line, z) in [
        ("G49G92Z1", -1.0),
        ("G92Z1G49", -1.0),
        ("G43H2G92Z1", -6.0),
        ("G49G10L20P1Z1", -1.0),
        ("G43H2G10L20P1Z1", -6.0),
    ] {
        let mut bench = in_mode("G0");
        bench.run("G43.1Z3");
        bench.run(line);
        let work = bench.interpreter.work_offset().map(to_mm);
        assert_eq!(work, [0.0, 0.0, -1.0], "{line}: Z reads 1");
        bench.run("G49");
        let origin = bench.interpreter.work_offset().map(to_mm);
        assert_eq!(origin, [0.0, 0.0, z], "{line}");
    }
}
