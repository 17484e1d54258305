//! Properties of every line.

use super::Bench;
use crate::{Command, Commands, Coordinate, Strokes};
use proptest::prelude::*;
use std::string::String;
use std::vec::Vec;

/// Words that exist, and values on which something depends.
fn any_word() -> impl Strategy<Value = String> {
    let codes = prop::sample::select(std::vec![
        "G0", "G1", "G2", "G3", "G4", "G10", "G17", "G18", "G19", "G20", "G21", "G28", "G28.1",
        "G30", "G30.1", "G38.2", "G38.5", "G40", "G43.1", "G49", "G53", "G54", "G55", "G59", "G61",
        "G73", "G80", "G81", "G82", "G83", "G85", "G86", "G89", "G98", "G99", "G90", "G91",
        "G91.1", "G92", "G92.1", "G93", "G94", "M0", "M1", "M2", "M3", "M4", "M5", "M7", "M8",
        "M9", "M30", "M56",
    ])
    .prop_map(String::from);
    let values = prop::sample::select(std::vec![
        "0",
        "1",
        "2",
        "20",
        "-1",
        "0.5",
        "-0.0001",
        "100",
        "1000000",
        "9000000000",
        ".1234567891",
    ]);
    let letters = prop::sample::select("XYZABCFIJKLNPQRST".chars().collect::<Vec<_>>());
    let valued = (letters, values).prop_map(|(letter, value)| std::format!("{letter}{value}"));
    prop_oneof![1 => codes, 1 => valued]
}

/// A cycle's line that may be right, in any plane.
fn any_cycle() -> impl Strategy<Value = String> {
    let kinds = prop::sample::select(std::vec![
        "G73Q0.3", "G81", "G82P1", "G83Q0.7", "G85", "G86P0", "G89P1", "", "G0",
    ]);
    let modes = prop::sample::select(std::vec![
        "", "G18", "G19", "G91", "G90", "G98", "G99", "G20"
    ]);
    let letters = prop::sample::subsequence("XYZR".chars().collect::<Vec<_>>(), 2..=4);
    let words = letters.prop_flat_map(|letters| {
        let count = letters.len();
        (Just(letters), prop::collection::vec(-5..5i32, count))
    });
    (kinds, modes, words, 0..4u8).prop_map(|(kind, mode, (letters, values), repeats)| {
        let words = letters.iter().zip(values);
        let words: String = words
            .map(|(letter, value)| std::format!("{letter}{value}"))
            .collect();
        let repeats = match repeats {
            0 => String::new(),
            repeats => std::format!("L{repeats}"),
        };
        std::format!("M3S1{mode}{kind}{words}{repeats}F100")
    })
}

fn any_line() -> impl Strategy<Value = Vec<u8>> {
    let words = prop::collection::vec(any_word(), 0..8).prop_map(|words| words.concat());
    prop_oneof![
        6 => words.prop_map(String::into_bytes),
        1 => prop::collection::vec(any::<u8>(), 0..40),
        1 => "[A-Z0-9.-]{0,30}".prop_map(String::into_bytes),
    ]
}

fn bench(laser_mode: bool) -> Bench<4> {
    let mut bench = Bench::new();
    bench.laser_mode = laser_mode;
    bench.dialect.mist = true;
    bench.dialect.parking_override = true;
    bench.dialect.cycles = true;
    bench.axes[3] = crate::AxisKind::Rotary;
    bench
}

fn check(bench: &Bench<4>, line: &[u8]) -> Result<(), super::Fault> {
    bench.interpreter.check(line, &bench.context())
}

/// A number of cases, and as many times more as `PROPTEST_CASES` is more than proptest's own 256.
fn times(cases: u32) -> ProptestConfig {
    let times = ProptestConfig::default().cases / 256;
    ProptestConfig::with_cases(cases * times.max(1))
}

proptest! {
    #![proptest_config(times(2000))]

    /// Any lines, one after the other: no panic, no half-done line, a check that tells the truth,
    /// and never more commands than there is room for.
    #[test]
    fn lines_are_carried_out_wholly_or_not_at_all(
        laser_mode: bool,
        lines in prop::collection::vec(any_line(), 1..20),
    ) {
        let mut bench = bench(laser_mode);
        for line in lines {
            let before = bench.interpreter.clone();
            let expected = check(&bench, &line);
            let answer = bench.send(&line);
            prop_assert_eq!(expected, answer.clone().map(|_| ()));
            if let Err(fault) = answer {
                prop_assert_eq!(&bench.interpreter, &before);
                prop_assert!(fault.column <= line.len());
            }
        }
    }

    /// The offset that every line uses is the sum of its parts, whatever the lines before.
    #[test]
    fn the_work_offset_is_always_that_of_the_system_in_force(
        lines in prop::collection::vec(any_line(), 1..20),
    ) {
        let mut bench = bench(false);
        for line in lines {
            let _ = bench.send(&line);
            let system = bench.interpreter.modal().system;
            let sum = bench.interpreter.offsets().work_offset(system);
            prop_assert_eq!(bench.interpreter.work_offset(), &sum);
        }
    }

    /// A cycle ends where its line does, and stays between its corners once it is over its first
    /// hole.
    #[test]
    fn a_cycle_keeps_to_its_corners(lines in prop::collection::vec(any_cycle(), 1..8)) {
        let mut bench = bench(false);
        for line in lines {
            let start = *bench.interpreter.position();
            let Ok(commands) = bench.send(line.as_bytes()) else { continue };
            let Some(Command::Cycle { travel, cycle }) = commands.last() else { continue };
            let clearance = Coordinate::from_nanos(254_000_000);
            let corners = cycle.corners(&travel.target);
            let mut at = start;
            for stroke in Strokes::new(&start, travel, cycle, clearance) {
                let Command::Line(travel) = stroke else { continue };
                at = travel.target;
                for (axis, at) in at.iter().enumerate() {
                    let [one, other] = corners.map(|corner| corner[axis]);
                    let highest = one.max(other).max(start[axis]);
                    prop_assert!((one.min(other).min(start[axis])..=highest).contains(at));
                }
            }
            prop_assert_eq!(at, travel.target);
            prop_assert_eq!(&at, bench.interpreter.position());
        }
    }

    /// Jogs change nothing, and end within reach.
    #[test]
    fn a_jog_ends_within_reach(lines in prop::collection::vec(any_line(), 1..20)) {
        let mut bench = bench(false);
        for line in lines {
            let _ = bench.send(&line);
            let text = String::from_utf8_lossy(&line).into_owned();
            if let Ok(Some(jog)) = bench.jog(&text) {
                for (target, reach) in jog.travel.target.iter().zip(&bench.reach) {
                    prop_assert!(target.nanos().abs() <= reach.nanos());
                }
            }
        }
    }
}

#[test]
fn refused_lines_leave_no_commands() {
    let bench = bench(false);
    let mut interpreter = bench.interpreter.clone();
    let mut commands = Commands::new();
    let taken = interpreter.interpret(b"G0X1", &bench.context(), &mut commands);
    assert!(taken.is_ok() && !commands.is_empty());
    let refused = interpreter.interpret(b"G0X1Q", &bench.context(), &mut commands);
    assert!(refused.is_err() && commands.is_empty());
}
