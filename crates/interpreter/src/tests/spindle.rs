//! Spindle, laser and coolant: when a line makes a command of its own for them, and when its
//! motion carries the power.

use super::Bench;

#[test]
fn the_spindle_waits_for_motion_only_when_it_changes() {
    let mut bench = Bench::<3>::new();
    assert!(bench.run("S100").is_empty());
    assert_eq!(bench.run("M3"), ["SPINDLE M3 S100"]);
    assert!(bench.run("M3S100").is_empty());
    assert_eq!(bench.run("S200"), ["SPINDLE M3 S200"]);
    assert_eq!(bench.run("M4S50"), ["SPINDLE M4 S50"]);
    assert_eq!(bench.run("M5"), ["SPINDLE M5 S50"]);
    assert!(bench.run("S1").is_empty());
}

#[test]
fn a_speed_on_a_line_with_motion_waits_without_laser_mode() {
    let mut bench = Bench::<3>::after(&["M3S500", "G1X1F500"]);
    assert_eq!(
        bench.run("X2S800"),
        [
            "SPINDLE M3 S800 cutting",
            "FEED X2 Y0 Z0 F500 M3 S800 cutting"
        ]
    );
}

#[test]
fn with_constant_laser_power_the_motion_carries_its_speed() {
    let mut bench = Bench::<3>::new();
    bench.laser_mode = true;
    assert_eq!(bench.run("M3S500"), ["SPINDLE M3 S500"]);
    assert_eq!(
        bench.run("G1X1F1000"),
        ["FEED X1 Y0 Z0 F1000 M3 S500 cutting"]
    );
    assert_eq!(bench.run("G0X2S100"), ["RAPID X2 Y0 Z0 M3 S100"]);
    assert_eq!(bench.run("S800"), ["SPINDLE M3 S800"]);
    assert_eq!(bench.run("G1"), ["SPINDLE M3 S800 cutting"]);
    assert_eq!(bench.run("X3S200"), ["FEED X3 Y0 Z0 F1000 M3 S200 cutting"]);
    assert_eq!(bench.run("S0"), ["SPINDLE M3 S0 cutting"]);
    assert_eq!(bench.run("G0"), ["SPINDLE M3 S0"]);
    assert_eq!(bench.run("M5"), ["SPINDLE M5 S0"]);
}

#[test]
fn with_dynamic_laser_power_only_switching_and_speed_alone_are_commands() {
    let mut bench = Bench::<3>::new();
    bench.laser_mode = true;
    assert_eq!(bench.run("G1F1000M4S500"), ["SPINDLE M4 S500 cutting"]);
    assert_eq!(bench.run("S300"), ["SPINDLE M4 S300 cutting"]);
    assert!(bench.run("S300").is_empty());
    assert!(bench.run("G0").is_empty());
    assert_eq!(bench.run("G1X1"), ["FEED X1 Y0 Z0 F1000 M4 S300 cutting"]);
    assert_eq!(bench.run("M3"), ["SPINDLE M3 S300 cutting"]);
}

#[test]
fn the_laser_is_off_while_g28_moves_and_while_probing() {
    let mut bench = Bench::<3>::new();
    bench.laser_mode = true;
    bench.run("G1F100M3S500");
    assert_eq!(bench.run("G28"), ["RAPID X0 Y0 Z0 M3 S500"]);
    assert_eq!(
        bench.run("G38.3Z-1"),
        ["PROBE G38.3 X0 Y0 Z-1 F100 M3 S500"]
    );
}

#[test]
fn coolant_words_add_up_until_m9() {
    let mut bench = Bench::<3>::new();
    bench.dialect.mist = true;
    assert_eq!(bench.run("M8"), ["COOLANT M8"]);
    assert!(bench.run("M8").is_empty());
    assert_eq!(bench.run("M7"), ["COOLANT M7 M8"]);
    assert_eq!(bench.run("M9"), ["COOLANT M9"]);
}

#[test]
fn m56_allows_and_forbids_parking() {
    let mut bench = Bench::<3>::new();
    bench.dialect.parking_override = true;
    assert!(bench.run("M56").is_empty());
    assert_eq!(bench.run("M56P0"), ["PARKING off"]);
    assert_eq!(bench.run("M56P1"), ["PARKING on"]);
}
