//! The order within a line, the end of a program, and the state after a refused line.

use super::Bench;

#[test]
fn a_line_is_carried_out_in_order_whatever_the_order_of_its_words() {
    let mut bench = Bench::<3>::after(&["G10L2P2Y1"]);
    assert_eq!(
        bench.run("M0X1G4P0.2G55M8S500F500M3G1"),
        [
            "SPINDLE M3 S500 cutting",
            "COOLANT M8",
            "DWELL 0.2 s",
            "WORK OFFSET X0 Y1 Z0",
            "FEED X1 Y0 Z0 F500 M3 S500 cutting",
            "PAUSE"
        ]
    );
}

/// The recorded conversation `m2_m30`.
#[test]
fn the_end_of_a_program_resets_modes_after_the_motion_of_its_line() {
    let mut bench = Bench::<3>::after(&[
        "G10L2P2Y3",
        "G20G91G18G93G55G1X0.1F5",
        "M3S100",
        "M8",
        "G92X1",
        "G43.1Z1",
    ]);
    assert_eq!(bench.modes(), "G1 G55 G18 G20 G91 G93 M3 M8 T0 F0 S100");
    assert_eq!(
        bench.run("M2"),
        ["PROGRAM END", "WORK OFFSET X-22.86 Y0 Z25.4"]
    );
    assert_eq!(bench.modes(), "G1 G54 G17 G20 G90 G94 M5 M9 T0 F0 S100");
    bench.expect(&[("M2X1", 22), ("G80", 0), ("M30", 0)]);
    assert!(bench.modes().starts_with("G1 "));
    assert_eq!(bench.run("M30G0X1"), ["RAPID X2.54 Y0 Z0", "PROGRAM END"]);
    assert!(bench.modes().starts_with("G1 "));
}

#[test]
fn m1_does_nothing() {
    assert!(Bench::<3>::new().run("M1").is_empty());
}

#[test]
fn a_tool_number_lasts_one_line() {
    let mut bench = Bench::<3>::after(&["T5"]);
    assert!(bench.modes().contains(" T5 "));
    bench.run("F0");
    assert!(bench.modes().contains(" T0 "));
}

/// The recorded conversation `modal_one_line`.
#[test]
fn one_line_may_set_every_mode() {
    let mut bench = Bench::<3>::after(&["G0G17G21G90G94G54M5M9F100S50T1"]);
    assert_eq!(bench.modes(), "G0 G54 G17 G21 G90 G94 M5 M9 T1 F100 S50");
    bench.run("G1G18G20G91G93G55M3M8F1S1000T2");
    assert_eq!(bench.modes(), "G1 G55 G18 G20 G91 G93 M3 M8 T2 F1 S1000");
    bench.run("G00G90G94");
    assert_eq!(bench.modes(), "G0 G55 G18 G20 G90 G94 M3 M8 T0 F0 S1000");
}

#[test]
fn a_refused_line_changes_nothing() {
    let mut bench = Bench::<3>::after(&["F100"]);
    let before = bench.interpreter.clone();
    bench.expect(&[
        ("G91G20F5S7T3Q1", 20),
        ("G2X1R0.1S5", 34),
        ("M3G1X", 2),
        ("G55G1F0X1", 22),
        ("G92X5I1", 36),
        ("G43.1Z1R1", 36),
        ("G10L2P1X1K1", 36),
    ]);
    assert_eq!(bench.interpreter, before);
}

#[test]
fn an_empty_line_is_fine() {
    assert!(Bench::<3>::new().run("").is_empty());
}
