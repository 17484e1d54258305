//! G10, G43.1, G54 to G59, G92.

use super::{to_mm, Bench};
use crate::{OffsetId, WorkSystem};

fn origin(bench: &Bench<3>, system: WorkSystem) -> [f64; 3] {
    let id = OffsetId::Work(system);
    bench.interpreter.offsets().get(id).map(to_mm)
}

fn g92(bench: &Bench<3>) -> [f64; 3] {
    bench.interpreter.offsets().g92().map(to_mm)
}

fn work_offset(bench: &Bench<3>) -> [f64; 3] {
    bench.interpreter.work_offset().map(to_mm)
}

/// The recorded conversation `g10_l20`.
#[test]
fn g10_l20_makes_the_position_read_as_its_words() {
    let mut bench = Bench::<3>::after(&["G0X10Y5"]);
    assert_eq!(
        bench.run("G10L20P1X0Y0"),
        ["STORE G54 X10 Y5 Z0", "WORK OFFSET X10 Y5 Z0"]
    );
    assert_eq!(bench.run("G10L20P2X1"), ["STORE G55 X9 Y0 Z0"]);
    bench.run("G92X3");
    bench.run("G10L20P1X0");
    assert_eq!(origin(&bench, WorkSystem::G54), [13.0, 5.0, 0.0]);
    assert_eq!(g92(&bench), [-3.0, 0.0, 0.0]);
    bench.run("G43.1Z2");
    bench.run("G10L20P1Z0");
    assert_eq!(origin(&bench, WorkSystem::G54), [13.0, 5.0, -2.0]);
    bench.run("G91");
    bench.run("G10L20P0X1");
    assert_eq!(origin(&bench, WorkSystem::G54), [12.0, 5.0, -2.0]);
    bench.run("G20");
    bench.run("G10L20P1X1Y1Z1");
    assert_eq!(origin(&bench, WorkSystem::G54), [-12.4, -20.4, -27.4]);
}

#[test]
fn g10_l2_sets_an_origin_whatever_the_distance_mode() {
    let mut bench = Bench::<3>::after(&["G91", "G0X7"]);
    bench.run("G10L2P3X1Y-2");
    bench.run("G10L2P3Z0.5");
    assert_eq!(origin(&bench, WorkSystem::G56), [1.0, -2.0, 0.5]);
}

#[test]
fn g10_without_p_or_with_p0_means_the_system_that_its_line_selects() {
    let mut bench = Bench::<3>::new();
    assert_eq!(
        bench.run("G57G10L2X1"),
        ["STORE G57 X1 Y0 Z0", "WORK OFFSET X1 Y0 Z0"]
    );
    bench.run("G10L2P0Y2");
    assert_eq!(origin(&bench, WorkSystem::G57), [1.0, 2.0, 0.0]);
}

/// The recorded conversation `g92`.
#[test]
fn g92_makes_the_position_read_as_its_words_and_g92_1_forgets_it() {
    let mut bench = Bench::<3>::after(&["G0X5"]);
    assert_eq!(bench.run("G92X0"), ["WORK OFFSET X5 Y0 Z0"]);
    bench.run("G92Y1Z1");
    assert_eq!(g92(&bench), [5.0, -1.0, -1.0]);
    assert_eq!(bench.run("G92.1"), ["WORK OFFSET X0 Y0 Z0"]);
    bench.run("G0X9");
    bench.run("G10L2P1X2");
    bench.run("G92X0");
    assert_eq!(g92(&bench), [7.0, 0.0, 0.0]);
    bench.run("G43.1Z3");
    bench.run("G92Z0");
    assert_eq!(g92(&bench), [7.0, 0.0, -3.0]);
    bench.run("M2");
    assert_eq!(g92(&bench), [7.0, 0.0, -3.0]);
    bench.run("G91G92X1");
    assert_eq!(g92(&bench), [6.0, 0.0, -3.0]);
}

#[test]
fn a_system_applies_to_the_words_of_its_own_line() {
    let mut bench = Bench::<3>::after(&["G10L2P2X10"]);
    assert_eq!(
        bench.run("X1G55"),
        ["WORK OFFSET X10 Y0 Z0", "RAPID X11 Y0 Z0"]
    );
    assert!(bench.run("G55").is_empty());
}

#[test]
fn the_tool_length_shifts_z_and_g49_takes_it_back() {
    let mut bench = Bench::<3>::new();
    assert_eq!(bench.run("G20G43.1Z1"), ["WORK OFFSET X0 Y0 Z25.4"]);
    assert_eq!(bench.run("G0Z0"), ["RAPID X0 Y0 Z25.4"]);
    assert_eq!(bench.run("G49"), ["WORK OFFSET X0 Y0 Z0"]);
    assert!(bench.run("G49").is_empty());
}

#[test]
fn a_reset_forgets_g92_and_the_tool_length_alone() {
    let mut bench = Bench::<3>::after(&["G0X1", "G10L2P1X5", "G28.1", "G92X0", "G43.1Z3", "G20"]);
    bench.interpreter.reset();
    assert_eq!(work_offset(&bench), [5.0, 0.0, 0.0]);
    assert_eq!(bench.position(), [1.0, 0.0, 0.0]);
    assert_eq!(bench.modes(), "G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0");
    let stored = bench.interpreter.offsets().get(OffsetId::G28).map(to_mm);
    assert_eq!(stored, [1.0, 0.0, 0.0]);
}

#[test]
fn an_offset_from_the_store_applies_at_once() {
    let mut bench = Bench::<3>::new();
    let id = OffsetId::Work(WorkSystem::G54);
    bench.interpreter.load_offset(id, [super::mm(3.0); 3]);
    assert_eq!(bench.run("G0X1Y1Z1"), ["RAPID X4 Y4 Z4"]);
}

/// Grbl stores 2147483.648, or what the sum wraps to.
#[test]
fn an_offset_that_does_not_fit_is_refused_and_nothing_of_it_is_stored() {
    let far = "99999999999999";
    for line in [
        "G10L2P1X",
        "G10L2P1X-",
        "G10L20P1X",
        "G92X",
        "G92X-",
        "G43.1Z",
        "G43.1Z-",
    ] {
        for word in [far, "1000000000.001", "9223372036.854775807"] {
            let mut bench = Bench::<3>::after(&["G10L2P1Y2"]);
            let before = bench.interpreter.clone();
            assert_eq!(
                bench.answer(&std::format!("{line}{word}")),
                52,
                "{line}{word}"
            );
            assert!(bench.interpreter == before, "{line}{word}");
        }
    }
    // The sum of position, other offsets and word counts, not the word alone.
    let mut bench = Bench::<3>::after(&["G10L2P1X600000000", "G92X-300000000"]);
    assert_eq!(bench.answer("G92X-400000000"), 0);
    assert_eq!(bench.answer("G92X-900000000"), 0);
    bench.run("G10L2P1X-900000000");
    assert_eq!(bench.answer("G92X-200000000"), 52);
    assert_eq!(bench.answer("G10L2P1X1000000000"), 0);
}
