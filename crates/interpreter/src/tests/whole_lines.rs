//! Faults that only the whole line shows, in their order.

use super::{expect_at_power_up, Bench};

#[test]
fn a_line_number_over_ten_million_is_error_27_before_all_others() {
    expect_at_power_up(&[
        ("N0", 0),
        ("N1.5", 0),
        ("N10000000", 0),
        ("N10000001", 27),
        ("N99999999", 27),
        ("N10000001G1", 27),
        ("N10000001G4", 27),
    ]);
}

#[test]
fn feed_motion_without_a_feed_is_error_22_even_without_axis_words() {
    expect_at_power_up(&[
        ("G1", 22),
        ("G2", 22),
        ("G3", 22),
        ("G38.2", 22),
        ("G38.3Z-1", 22),
        ("G1X1F0", 22),
        ("G1X1F0.001", 0),
        ("G0", 0),
        ("G0X1", 0),
        ("G4P0G1", 22),
    ]);
    Bench::<3>::after(&["F100"]).expect(&[("G1", 0), ("F0", 0), ("X1", 22)]);
}

#[test]
fn in_g93_every_feed_motion_needs_its_own_feed() {
    let mut bench = Bench::<3>::after(&["G93"]);
    bench.expect(&[
        ("G1X1", 22),
        ("G1X1F60", 0),
        ("X2", 22),
        ("X2F60", 0),
        ("G0X0", 0),
        ("F5", 0),
        ("G1", 22),
        ("G1F60", 0),
        ("G2X1I0.5F60", 0),
        ("G38.2Z-1", 22),
    ]);
}

#[test]
fn a_feed_in_g93_ends_with_its_line_and_g94_begins_without_one() {
    let mut bench = Bench::<3>::after(&["G93", "F5"]);
    assert!(bench.modes().ends_with("G93 M5 M9 T0 F5 S0"));
    bench.run("M8");
    assert!(bench.modes().ends_with("G93 M5 M8 T0 F0 S0"));
    bench.run("F7");
    bench.run("G94");
    assert!(bench.modes().ends_with("G94 M5 M8 T0 F0 S0"));
    bench.expect(&[("G1X0", 22), ("G1X0F100", 0)]);
}

#[test]
fn a_dwell_without_time_is_error_28() {
    expect_at_power_up(&[
        ("G4", 28),
        ("G4X1", 28),
        ("G4P0", 0),
        ("G4P1X1", 0),
        ("G4P0L1", 36),
        ("G4G43.1X1", 28),
    ]);
}

#[test]
fn g43_1_takes_z_and_nothing_else_or_is_error_37() {
    expect_at_power_up(&[
        ("G43.1Z1", 0),
        ("G43.1", 37),
        ("G43.1X1", 37),
        ("G43.1X1Z1", 37),
        ("G49", 0),
        ("G49Z1", 0),
    ]);
}

#[test]
fn g10_wants_axis_words_then_p_or_l_then_a_system_then_l() {
    expect_at_power_up(&[
        ("G10", 26),
        ("G10L2P1", 26),
        ("G10X1", 28),
        ("G10P1X1", 20),
        ("G10L2X1", 0),
        ("G10L20X1", 0),
        ("G10P7X1", 29),
        ("G10L2P7X1", 29),
        ("G10L2P6.9X1", 0),
        ("G10L2P1.9X1", 0),
        ("G10L20.5P1X1", 0),
        ("G10L3P1X1", 20),
        ("G10L-2P1X1", 20),
        ("G10L2P1R1X1", 20),
        ("G10L20P1R1X1", 36),
        ("G10L2P1X1I1", 36),
    ]);
}

#[test]
fn g92_wants_axis_words() {
    expect_at_power_up(&[("G92", 26), ("G92X0", 0), ("G92.1", 0), ("G92.1X0", 0)]);
}

#[test]
fn g53_needs_g0_or_g1_or_is_error_30() {
    Bench::<3>::after(&["F100"]).expect(&[
        ("G53", 0),
        ("G53X0", 0),
        ("G53G1X1", 0),
        ("G53G2X0R1", 30),
        ("G80", 0),
        ("G53", 0),
        ("G53X0", 30),
    ]);
}

#[test]
fn arcs_have_their_errors_in_order() {
    Bench::<3>::after(&["F100"]).expect(&[
        ("G2", 26),
        ("G2R1", 26),
        ("G2I1", 26),
        ("G2Z1R1", 32),
        ("G2Z1I1", 32),
        ("G2X0Y0R5", 33),
        ("G2X2R0.9999", 34),
        ("G2X2R0", 34),
        ("G2X1", 35),
        ("G2X1K1", 35),
        ("G2X1I1J1K1", 33),
        ("G2X1R1J1", 36),
        ("G18G2X1J1", 35),
        ("G18G2Y1K1", 32),
        ("G19G2X1J1", 32),
        ("G17G2X1R0.5P1", 36),
        ("G2X2I1P1", 36),
    ]);
}

#[test]
fn probing_wants_somewhere_to_go() {
    let mut bench = Bench::<3>::new();
    bench.expect(&[
        ("G38.2F100", 26),
        ("G38.2Z0F100", 33),
        ("G38.2X0Y0Z0F100", 33),
        ("G38.2Z-1F100P1", 36),
        ("G91G38.2Z0F100", 33),
        ("G38.2Z-1F100", 0),
    ]);
}

#[test]
fn words_that_nobody_takes_are_error_36() {
    for word in ["I1", "J1", "K1", "L1", "P1", "R1"] {
        for rest in ["", "G0X0", "G17", "M3", "G21", "G54", "G28.1"] {
            let line = std::format!("{rest}{word}");
            expect_at_power_up(&[(&line, 36)]);
        }
    }
    for line in ["F1", "S1", "T1", "N1", "X0"] {
        expect_at_power_up(&[(line, 0)]);
    }
}

#[test]
fn m56_takes_p_and_shares_it_with_a_dwell() {
    let mut bench = Bench::<3>::new();
    bench.dialect.parking_override = true;
    bench.expect(&[("M56P0", 0), ("M56P1", 0), ("M56P0G4", 0), ("P1", 36)]);
}

#[test]
fn a_target_beyond_what_steps_can_count_is_refused() {
    let mut bench = Bench::<3>::new();
    bench.expect(&[
        ("G0X1000000", 0),
        ("G0X1000000.001", 52),
        ("G0Y-1000001", 52),
        ("G91X1", 52),
        ("G91X-1", 0),
        ("G90G10L2P1X1000000000", 0),
        ("G10L2P1X1000000000.1", 52),
        ("G0X1", 52),
        ("G20G0X9000000000", 52),
        ("G20F9000000000", 0),
        ("G92X1000000000", 52),
    ]);
}

#[test]
fn a_fault_of_the_whole_line_points_at_a_word_of_it() {
    let cases = [
        ("G0X1I2", 4),
        ("G90G4X1", 3),
        ("G1X1F0", 4),
        ("G1X1", 0),
        ("F9G2X2R0.5", 6),
        ("G0Y9999999", 2),
    ];
    for (line, column) in cases {
        let fault = Bench::<3>::new().send(line.as_bytes()).unwrap_err();
        assert_eq!(fault.column, column, "{line}: {fault}");
    }
}
