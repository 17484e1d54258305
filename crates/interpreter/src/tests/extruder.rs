//! E, M82 and M83: on a machine with an extruder, and on others, which refuse them.

use super::Bench;
use crate::AxisKind;

/// X, Y, Z and E.
fn printer() -> Bench<4> {
    let mut bench = Bench::<4>::new();
    bench.axes[3] = AxisKind::Extruder;
    bench
}

fn printer_after(lines: &[&str]) -> Bench<4> {
    let mut bench = printer();
    for line in lines {
        bench.run(line);
    }
    bench
}

#[test]
fn e_is_a_place_at_first_and_a_way_after_m83() {
    let mut bench = printer();
    assert_eq!(bench.run("G1X10E1.5F1800"), ["FEED X10 Y0 Z0 A1.5 F1800"]);
    assert_eq!(bench.run("X20E2"), ["FEED X20 Y0 Z0 A2 F1800"]);
    bench.run("M83");
    assert_eq!(bench.run("X30E2"), ["FEED X30 Y0 Z0 A4 F1800"]);
    assert_eq!(bench.run("E-0.8"), ["FEED X30 Y0 Z0 A3.2 F1800"]);
    bench.run("M82");
    assert_eq!(bench.run("X0E4"), ["FEED X0 Y0 Z0 A4 F1800"]);
}

#[test]
fn g90_and_g91_say_how_e_counts_and_m82_or_m83_has_the_last_word_on_its_line() {
    let mut bench = printer_after(&["G1F100", "G91", "E1"]);
    assert_eq!(bench.run("X1E1"), ["FEED X1 Y0 Z0 A2 F100"]);
    bench.run("M82");
    assert_eq!(bench.run("X1E1"), ["FEED X2 Y0 Z0 A1 F100"]);
    bench.run("G91");
    assert_eq!(bench.run("X1E1"), ["FEED X3 Y0 Z0 A2 F100"]);
    for line in ["M83G90", "G90M83"] {
        let mut bench = printer_after(&["G91", "G1X5E5F100", line]);
        assert_eq!(bench.run("X1E1"), ["FEED X1 Y0 Z0 A6 F100"], "{line}");
    }
}

#[test]
fn a_thousand_short_ways_of_e_add_up_exactly() {
    let mut bench = printer_after(&["M83", "G1F100"]);
    for _ in 0..1000 {
        bench.run("E.00333");
    }
    assert_eq!(bench.position(), [0.0, 0.0, 0.0, 3.33]);
}

#[test]
fn g92_counts_e_anew_and_places_follow() {
    let mut bench = printer_after(&["G1X10E7F100"]);
    assert_eq!(bench.run("G92E0"), ["WORK OFFSET X0 Y0 Z0 A7"]);
    assert_eq!(bench.run("X20E1"), ["FEED X20 Y0 Z0 A8 F100"]);
    bench.run("M83");
    assert_eq!(bench.run("X30E1"), ["FEED X30 Y0 Z0 A9 F100"]);
    bench.run("M82");
    assert_eq!(bench.run("X40E1"), ["FEED X40 Y0 Z0 A8 F100"]);
}

#[test]
fn e_is_in_inches_too_and_g53_counts_from_the_machines_zero() {
    let mut bench = printer_after(&["G1E3F100", "G92E0", "G91"]);
    assert_eq!(bench.run("G20E1"), ["FEED X0 Y0 Z0 A28.4 F100"]);
    assert_eq!(bench.run("G21G53E1"), ["FEED X0 Y0 Z0 A1 F100"]);
}

#[test]
fn g28_and_g30_leave_the_filament_where_it_is() {
    let mut bench = printer_after(&["G1X5E9F100"]);
    assert_eq!(bench.run("G28"), ["RAPID X0 Y0 Z0 A9"]);
    bench.run("G1X5");
    let commands = bench.run("G30X2E10");
    assert_eq!(commands.last().unwrap(), "RAPID X0 Y0 Z0 A10");
}

#[test]
fn the_modes_have_m82_or_m83_where_one_was_given() {
    let mut bench = printer_after(&["M83"]);
    assert!(bench.modes().contains("M9 M83"), "{}", bench.modes());
    bench.run("M82");
    assert!(bench.modes().contains("M9 M82"), "{}", bench.modes());
    bench.run("G91");
    assert!(!bench.modes().contains("M8"), "{}", bench.modes());
    bench.run("M83");
    bench.run("M2");
    assert!(!bench.modes().contains("M8"), "{}", bench.modes());
}

#[test]
fn a_printer_has_no_a_and_other_machines_no_e() {
    printer().expect(&[("A1", 20), ("E1", 0), ("E1E2", 25), ("M82M83", 21)]);
    let mut with_cycles = printer();
    with_cycles.dialect.cycles = true;
    with_cycles.expect(&[("G1E1", 22), ("G81X1E1R1Z-1F100", 36)]);
    let mut others = Bench::<4>::new();
    others.expect(&[("E1", 20), ("M82", 20), ("M83", 20), ("A1", 0)]);
    Bench::<3>::new().expect(&[("E1", 20), ("M82", 20), ("M83", 20), ("A1", 20)]);
}

#[test]
fn a_jog_moves_e_by_its_own_mode_and_has_no_m_word() {
    let bench = printer_after(&["G1X1E2F100", "M83"]);
    let target = |line: &str| {
        let jog = bench.jog(line).unwrap().unwrap();
        jog.travel.target.map(super::to_mm)
    };
    assert_eq!(target("X5E1F100"), [5.0, 0.0, 0.0, 3.0]);
    assert_eq!(target("G90E1F100"), [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(bench.jog("M82E1F100").unwrap_err().status.number(), 16);
}

#[test]
fn a_word_beyond_all_reach_is_found() {
    let mut bench = printer();
    bench.reach[3] = super::mm(100.0);
    let fault = bench.send(b"G0X1E200").unwrap_err();
    assert_eq!((fault.status.number(), fault.column), (52, 4));
}
