//! Canned cycles: refusals one by one, words that stay in force, levels. Whole programs against
//! LinuxCNC stand in `tests/cycles`.

use super::*;
use crate::Strokes;

/// A machine with cycles whose spindle turns, above its work at X0 Y0 Z5.
fn bench() -> Bench<3> {
    let mut bench = Bench::new();
    bench.dialect.cycles = true;
    bench.expect(&[("M3S1000", 0), ("G0Z5", 0)]);
    bench
}

/// The same, with a fourth axis.
fn four_axes() -> Bench<4> {
    let mut bench = Bench::new();
    bench.dialect.cycles = true;
    bench.expect(&[("M3S1000", 0), ("G0Z5", 0)]);
    bench
}

/// The strokes of a line's cycle, in words; `clearance` in mm.
fn strokes(bench: &mut Bench<3>, line: &str, clearance: f64) -> Vec<String> {
    let start = *bench.interpreter.position();
    let commands = bench.send(line.as_bytes()).unwrap();
    let Some(Command::Cycle { travel, cycle }) = commands.last() else {
        panic!("{line}: {commands:?}");
    };
    Strokes::new(&start, travel, cycle, mm(clearance))
        .map(|stroke| stroke.to_string().replace(" M3 S1000", ""))
        .collect()
}

#[test]
fn a_word_that_the_first_line_needs_is_missed() {
    for (line, answer) in [
        ("G81X1Z-1R1F100", 0),
        ("G81X1Z-1R1", 22),
        ("G81F100", 26),
        ("G81", 26),
        ("G81R1Z-1F0", 22),
        ("G81X1Z-1F100", 28),
        ("G81X1R1F100", 28),
        ("G82X1Z-1R1F100", 28),
        ("G82X1Z-1R1P0F100", 0),
        ("G86X1Z-1R1F100", 28),
        ("G89X1Z-1R1F100", 28),
        ("G73X1Z-1R1F100", 28),
        ("G83X1Z-1R1F100", 28),
        ("G83X1Z-1R1Q1F100", 0),
        ("G18G81X1Z-1R1F100", 28),
        ("G18G81X1Y-1R1F100", 0),
        ("G19G81X-1Y1R1F100", 0),
    ] {
        bench().expect(&[(line, answer)]);
    }
}

#[test]
fn words_that_make_no_sense_are_refused() {
    for (line, answer) in [
        ("G81X1Z2R1F100", 200),
        ("G81X1Z1R1F100", 0),
        ("G91G81X1Z1R1F100", 200),
        ("G91G81X1Z-1R-1F100", 0),
        ("G81X1Z-1R1L0F100", 52),
        ("G81X1Z-1R1L-1F100", 52),
        ("G81X1Z-1R1L10001F100", 52),
        ("G81X1Z-1R1L2.5F100", 23),
        ("G81X1Z-1R1L10000F100", 0),
        ("G83X1Z-1R1Q0F100", 52),
        ("G83X1Z-1R1Q-1F100", 52),
        ("G83X1Z-1R1Q0.0001F100", 52),
        ("G82X1Z-1R1P-1F100", 4),
        ("G81X1Z-1R1Q1F100", 36),
        ("G81X1Z-1R1P1F100", 36),
        ("G81X1Z-1R1I1F100", 36),
        ("G83X1Z-1R1Q1P1F100", 36),
        ("G93G81X1Z-1R1F100", 201),
        ("G93G81X1Z-1R1", 22),
        ("M5G86X1Z-1R1P0F100", 202),
        ("S0G86X1Z-1R1P0F100", 202),
        ("G53G81X1Z-1R1F100", 30),
        ("G28G81X1Z-1R1F100", 24),
        ("G80G81X1Z-1R1F100", 21),
        ("G98G99", 21),
        ("G81X2000000Z-1R1F100", 52),
        ("G81X1Z-1R2000000F100", 52),
        ("G81X1Z-2000000R1F100", 52),
        ("G91G81X900000Z-1R1L2F100", 52),
        ("G81.1X1Z-1R1F100", 23),
        ("G84X1Z-1R1F100", 20),
        ("G88X1Z-1R1P0F100", 20),
    ] {
        bench().expect(&[(line, answer)]);
    }
}

#[test]
fn a_refused_line_changes_nothing() {
    let mut bench = bench();
    bench.expect(&[("G81X1Z-1R1F100", 0)]);
    let before = bench.interpreter.clone();
    bench.expect(&[
        ("G83X2Z-2R2", 28),
        ("X2L0", 52),
        ("X2Z3", 200),
        ("G99X2Q1", 36),
    ]);
    assert_eq!(bench.interpreter, before);
}

#[test]
fn other_axes_take_no_part() {
    four_axes().expect(&[("G81X1Z-1R1F100", 0), ("X1A1", 36)]);
}

#[test]
fn words_stay_while_cycle_plane_and_distance_mode_do() {
    bench().expect(&[
        ("G82X1Z-1R1P0.1F100", 0),
        ("X2", 0),
        ("Z-2", 0),
        ("G82Y1", 0),
        ("G54", 0),
        ("M5", 0),
        ("X3", 0),
        ("R2", 36),
        ("L2", 36),
        ("G81X4", 28),
        ("G4P1X4", 0),
        ("G20X4", 0),
        ("G91X1", 28),
        ("G18X1", 28),
        ("G0X1", 0),
        ("G82X1", 28),
        ("G82X1Z-1R1P0", 0),
        ("G80", 0),
        ("X1", 31),
        ("G82X1", 28),
        ("G82X1Z-1R1P0", 0),
        ("M2", 0),
        ("G82X1", 28),
    ]);
}

#[test]
fn without_the_option_grbl_answers() {
    expect_at_power_up(&[
        ("G81X1Z-1R1F100", 20),
        ("G0G81", 20),
        ("G10G81", 20),
        ("G81.1", 20),
        ("G98", 20),
        ("G99", 20),
        ("G1Q1", 20),
    ]);
}

#[test]
fn with_the_option_a_jog_is_still_a_jog() {
    let bench = bench();
    assert_eq!(bench.jog("G81X1F100").unwrap_err().status.number(), 28);
    assert_eq!(bench.jog("G99X1F100").unwrap_err().status.number(), 16);
    assert_eq!(bench.jog("X1Q1F100").unwrap_err().status.number(), 36);
    let mut bench = self::bench();
    bench.expect(&[("G81X1Z-1R1F100", 0)]);
    assert!(bench.jog("X1F100").unwrap().is_some());
}

#[test]
fn modes_show_the_cycle_and_g99_alone() {
    let mut bench = bench();
    bench.expect(&[("G98G83X1Z-1R1Q1F100", 0)]);
    assert_eq!(bench.modes(), "G83 G54 G17 G21 G90 G94 M3 M9 T0 F100 S1000");
    bench.expect(&[("G99", 0)]);
    assert_eq!(
        bench.modes(),
        "G83 G54 G17 G21 G90 G94 G99 M3 M9 T0 F100 S1000"
    );
    bench.expect(&[("M30", 0)]);
    assert_eq!(bench.modes(), "G1 G54 G17 G21 G90 G94 M5 M9 T0 F100 S1000");
}

#[test]
fn a_peck_s_way_back_ends_at_the_r_level() {
    let mut bench = bench();
    assert_eq!(
        strokes(&mut bench, "G73Z0.2R1Q0.4F100", 0.5),
        [
            "RAPID X0 Y0 Z5",
            "RAPID X0 Y0 Z1",
            "FEED X0 Y0 Z0.6 F100",
            "RAPID X0 Y0 Z1",
            "FEED X0 Y0 Z0.2 F100",
            "RAPID X0 Y0 Z5",
        ]
    );
    assert_eq!(
        strokes(&mut bench, "G83Z0R1Q0.5", 0.25),
        [
            "RAPID X0 Y0 Z5",
            "RAPID X0 Y0 Z1",
            "FEED X0 Y0 Z0.5 F100",
            "RAPID X0 Y0 Z1",
            "RAPID X0 Y0 Z0.75",
            "FEED X0 Y0 Z0 F100",
            "RAPID X0 Y0 Z5",
        ]
    );
}

#[test]
fn the_level_of_g98_is_that_before_the_series() {
    let mut bench = bench();
    bench.expect(&[("G99G81X1Z-1R1F100", 0), ("G98G82X2Z-1R2P0", 0)]);
    assert_eq!(bench.position(), [2.0, 0.0, 5.0]);
    bench.expect(&[("G99X3", 0), ("G0X4", 0), ("G98G81X5Z-1R1", 0)]);
    assert_eq!(bench.position(), [5.0, 0.0, 2.0]);
    bench.expect(&[("G92Z0", 0), ("X6Z-3R-1", 0)]);
    assert_eq!(
        bench.position(),
        [6.0, 0.0, 2.0],
        "an offset moves no level"
    );
}

#[test]
fn levels_follow_the_offsets_and_units_of_their_line() {
    let mut bench = bench();
    bench.expect(&[("G10L2P2Z-10", 0), ("G55G20G99G81X1Z-0.1R0.1F10", 0)]);
    assert_eq!(bench.position(), [25.4, 0.0, -10.0 + 2.54]);
    bench.expect(&[("G54X2", 0)]);
    assert_eq!(bench.position(), [50.8, 0.0, 2.54]);
}

#[test]
fn repeats_go_on_by_the_same_way() {
    let mut bench = bench();
    bench.expect(&[("G91G81X1Y-2Z-1R-4L3F100", 0)]);
    assert_eq!(bench.position(), [3.0, -6.0, 5.0]);
    bench.expect(&[("G90G81X10Z-1R1L3", 0)]);
    assert_eq!(bench.position(), [10.0, -6.0, 5.0]);
}

#[test]
fn the_spindle_stands_only_on_the_way_back() {
    let mut bench = bench();
    let start = *bench.interpreter.position();
    let commands = bench.send(b"G86X1Z-1R1P0.5F100").unwrap();
    let Some(Command::Cycle { travel, cycle }) = commands.last() else {
        panic!("{commands:?}");
    };
    let strokes: Vec<String> = Strokes::new(&start, travel, cycle, mm(0.1))
        .map(|stroke| stroke.to_string())
        .collect();
    assert_eq!(
        strokes,
        [
            "RAPID X1 Y0 Z5 M3 S1000",
            "RAPID X1 Y0 Z1 M3 S1000",
            "FEED X1 Y0 Z-1 F100 M3 S1000",
            "DWELL 0.5 s",
            "SPINDLE M5 S1000",
            "RAPID X1 Y0 Z5",
            "SPINDLE M3 S1000",
        ]
    );
}
