//! The targets of lines: units, distance modes, machine coordinates, arcs, probes.

use super::Bench;
use crate::{AxisKind, Feed};
use leadscrew_gcode::Number;

#[test]
fn the_motion_mode_stays_and_axis_words_alone_move() {
    let mut bench = Bench::<3>::new();
    assert_eq!(bench.run("G1X1F500"), ["FEED X1 Y0 Z0 F500"]);
    assert_eq!(bench.run("Y2"), ["FEED X1 Y2 Z0 F500"]);
    assert_eq!(bench.run("G0Z-3"), ["RAPID X1 Y2 Z-3"]);
    assert_eq!(bench.run("X0"), ["RAPID X0 Y2 Z-3"]);
    assert!(bench.run("G1").is_empty());
}

#[test]
fn incremental_words_count_from_where_the_axis_is_and_nothing_drifts() {
    let mut bench = Bench::<3>::after(&["G91"]);
    for _ in 0..1000 {
        bench.run("G0X0.1Y-0.000000001");
    }
    assert_eq!(bench.position(), [100.0, -0.000001, 0.0]);
}

#[test]
fn inches_are_exact_and_feed_stays_in_mm_per_minute() {
    let mut bench = Bench::<3>::after(&["G20"]);
    assert_eq!(bench.run("G1X0.5Y0.25F20"), ["FEED X12.7 Y6.35 Z0 F508"]);
    bench.run("G21");
    assert!(bench.modes().contains("G21") && bench.modes().contains("F508"));
    assert_eq!(bench.run("X1"), ["FEED X1 Y6.35 Z0 F508"]);
}

#[test]
fn an_arc_by_radius_that_moves_only_across_its_plane_is_a_straight_line() {
    let mut bench = Bench::<3>::after(&["F100"]);
    assert_eq!(bench.run("G2X0Y0Z5R5"), ["FEED X0 Y0 Z5 F100"]);
    assert_eq!(bench.run("G18G3X0Y-2Z5R1"), ["FEED X0 Y-2 Z5 F100"]);
}

#[test]
fn units_apply_to_all_words_of_their_line_wherever_they_stand() {
    let mut bench = Bench::<3>::new();
    assert_eq!(bench.run("X1G20"), ["RAPID X25.4 Y0 Z0"]);
}

#[test]
fn an_inverse_time_feed_has_no_unit() {
    let mut bench = Bench::<3>::after(&["G20G93"]);
    assert_eq!(bench.run("G1X1F30"), ["FEED X25.4 Y0 Z0 G93 F30"]);
}

#[test]
fn rotary_axes_are_never_in_inches() {
    let mut bench = Bench::<4>::new();
    bench.axes[3] = AxisKind::Rotary;
    assert_eq!(bench.run("G20G0X1A90"), ["RAPID X25.4 Y0 Z0 A90"]);
}

#[test]
fn g53_ignores_offsets_and_g91_and_obeys_g20() {
    let mut bench = Bench::<3>::after(&["G10L2P1X10", "G91", "G0X5"]);
    assert_eq!(bench.run("G53X2"), ["RAPID X2 Y0 Z0"]);
    assert_eq!(bench.run("G53G20X1"), ["RAPID X25.4 Y0 Z0"]);
    assert_eq!(bench.run("G90X0"), ["RAPID X10 Y0 Z0"]);
}

#[test]
fn g28_moves_by_way_of_the_target_and_then_the_named_axes_alone() {
    let mut bench = Bench::<3>::after(&["G0X5Y6Z7", "G28.1", "G0X0Y0Z0"]);
    assert_eq!(bench.run("G28"), ["RAPID X5 Y6 Z7"]);
    bench.run("G0X1Y1Z1");
    assert_eq!(bench.run("G91G28Z2"), ["RAPID X1 Y1 Z3", "RAPID X1 Y1 Z7"]);
    assert_eq!(bench.position(), [1.0, 1.0, 7.0]);
    assert_eq!(bench.run("G30"), ["RAPID X0 Y0 Z0"]);
}

#[test]
fn g28_1_stores_where_the_line_begins_and_moves_with_axis_words() {
    let mut bench = Bench::<3>::after(&["G0X5"]);
    assert_eq!(
        bench.run("G28.1X1"),
        ["STORE G28 X5 Y0 Z0", "RAPID X1 Y0 Z0"]
    );
    assert_eq!(
        bench.run("G30.1Y2"),
        ["STORE G30 X1 Y0 Z0", "RAPID X1 Y2 Z0"]
    );
}

#[test]
fn other_axis_words_beside_a_dwell_or_g92_1_are_motion() {
    let mut bench = Bench::<3>::after(&["G0X5", "G92X1"]);
    assert_eq!(bench.run("G4P1Y1"), ["DWELL 1 s", "RAPID X5 Y1 Z0"]);
    assert_eq!(
        bench.run("G92.1X5"),
        ["WORK OFFSET X0 Y0 Z0", "RAPID X9 Y1 Z0"]
    );
}

#[test]
fn arcs_carry_their_centre_from_the_start_in_their_plane() {
    let cases = [
        ("G17", "G2X2Y0I1", "ARC G2 G17 I1 J0 X2 Y0 Z0 F500"),
        ("G17", "G3X0Y0J2", "ARC G3 G17 I0 J2 X0 Y0 Z0 F500"),
        ("G17", "G2X0Y0I1Z1", "ARC G2 G17 I1 J0 X0 Y0 Z1 F500"),
        ("G17", "G2X1I0.5K3", "ARC G2 G17 I0.5 J0 X1 Y0 Z0 F500"),
        ("G18", "G2X2Z0I1", "ARC G2 G18 K0 I1 X2 Y0 Z0 F500"),
        ("G19", "G2Y2Z0J1", "ARC G2 G19 J1 K0 X0 Y2 Z0 F500"),
        ("G17", "G3X1Y1R1", "ARC G3 G17 I0 J1 X1 Y1 Z0 F500"),
        ("G17", "G3X1Y1R-1", "ARC G3 G17 I1 J0 X1 Y1 Z0 F500"),
        ("G18", "G2X1Z1R1", "ARC G2 G18 K1 I0 X1 Y0 Z1 F500"),
        ("G20", "G2X2I1", "ARC G2 G17 I25.4 J0 X50.8 Y0 Z0 F12700"),
    ];
    for (plane, line, expected) in cases {
        let mut bench = Bench::<3>::after(&[plane, "F500"]);
        assert_eq!(bench.run(line), [expected], "{plane} {line}");
    }
}

#[test]
fn an_inverse_time_arc_takes_its_time_as_a_whole() {
    let mut bench = Bench::<3>::after(&["G93"]);
    assert_eq!(
        bench.run("G2X2Y0I1F30"),
        ["ARC G2 G17 I1 J0 X2 Y0 Z0 G93 F30"]
    );
}

#[test]
fn probes_say_what_they_wait_for() {
    let mut bench = Bench::<3>::after(&["F100"]);
    for kind in ["G38.2", "G38.3", "G38.4", "G38.5"] {
        let expected = std::format!("PROBE {kind} X0 Y0 Z-1 F100");
        assert_eq!(bench.run(&std::format!("{kind}Z-1")), [expected]);
        assert!(bench.modes().starts_with(kind));
        bench.run("G0Z0");
    }
}

#[test]
fn a_motion_that_leads_nowhere_is_a_command_all_the_same() {
    let mut bench = Bench::<3>::new();
    assert_eq!(bench.run("G1X0F100"), ["FEED X0 Y0 Z0 F100"]);
}

#[test]
fn a_line_number_goes_with_its_motion() {
    let mut bench = Bench::<3>::new();
    assert_eq!(bench.run("N120G0X1"), ["RAPID X1 Y0 Z0 N120"]);
    assert_eq!(bench.run("X2"), ["RAPID X2 Y0 Z0"]);
}

#[test]
fn the_machine_says_where_a_probe_or_a_reset_ended() {
    let mut bench = Bench::<3>::after(&["G91"]);
    bench.interpreter.set_position([super::mm(1.5); 3]);
    assert_eq!(bench.run("G0X1"), ["RAPID X2.5 Y1.5 Z1.5"]);
}

/// NIST RS274/NGC, 2.1.2.5: F counts degrees if only axes move that turn, and degrees have no
/// inches.
#[test]
fn the_feed_of_rotary_axes_alone_is_in_degrees() {
    let mut bench = Bench::<4>::new();
    bench.axes[3] = AxisKind::Rotary;
    assert_eq!(bench.run("G20G1A36F600"), ["FEED X0 Y0 Z0 A36 F600"]);
    assert_eq!(bench.run("X1A72"), ["FEED X25.4 Y0 Z0 A72 F15240"]);
    assert_eq!(bench.run("X1A36"), ["FEED X25.4 Y0 Z0 A36 F600"]);
    assert_eq!(bench.run("G21A0"), ["FEED X25.4 Y0 Z0 A0 F15240"]);
    let jog = bench.jog("G20G91A9F600").unwrap().unwrap();
    assert_eq!(jog.travel.feed, Feed::PerMinute(Number::from_int(600)));
    let jog = bench.jog("G20G91X1A9F600").unwrap().unwrap();
    assert_eq!(jog.travel.feed, Feed::PerMinute(Number::from_int(15_240)));
    bench.axes[3] = AxisKind::Linear;
    assert_eq!(bench.run("G20G1A1F1"), ["FEED X25.4 Y0 Z0 A25.4 F25.4"]);
}
