//! Lines that come in bursts, as from a sender on a busy computer. Motion stops for want of lines
//! between them, but segments never run out.

use leadscrew_planner::Cartesian;
use leadscrew_sim::Memory;
use leadscrew_tests::{setup, Session};
use proptest::prelude::*;
use std::collections::VecDeque;

type Desk<'a> = Session<'a, Cartesian, 3>;

/// The most bytes of unanswered lines that the sender keeps under way: Grbl's receive buffer.
const WINDOW: usize = 128;

const QUICK: &str = "$110=6000\n$111=6000\n$112=3000\n$120=800\n$121=800\n$122=800\n$10=255\n";

/// The sender's next action.
#[derive(Clone, Copy, Debug)]
enum Turn {
    /// It waits for this time, µs, reads everything and sends the lines that fit.
    Lines(u64),
    /// It waits for this time, µs, and asks for a report.
    Report(u64),
    /// It waits for this time, µs, and sends an override.
    Override(u64, u8),
}

fn turn() -> impl Strategy<Value = Turn> {
    prop_oneof![
        6 => (1u64..60_000).prop_map(Turn::Lines),
        3 => (1u64..3_000).prop_map(Turn::Lines),
        2 => (1u64..40_000).prop_map(Turn::Report),
        1 => (1u64..10_000, prop::sample::select(&b"\x90\x91\x92\x93\x94\x95\x97"[..]))
            .prop_map(|(pause, byte)| Turn::Override(pause, byte)),
    ]
}

/// Streams a job by character counting. The sender takes its `turns` one after the other, and
/// starts again after the last one.
fn stream(session: &mut Desk<'_>, job: &str, turns: &[Turn]) {
    let mut waiting: VecDeque<&str> = job.lines().collect();
    let mut unanswered: VecDeque<usize> = VecDeque::new();
    for turn in turns.iter().cycle() {
        match *turn {
            Turn::Lines(pause) => {
                session.wait_us(pause);
                for line in session.heard(0) {
                    match line.as_str() {
                        "ok" => assert!(unanswered.pop_front().is_some(), "an ok too many"),
                        other => assert!(other.starts_with(['<', '[']), "{other}"),
                    }
                }
                while let Some(line) = waiting.front() {
                    if unanswered.iter().sum::<usize>() + line.len() + 1 > WINDOW {
                        break;
                    }
                    session.send(0, format!("{line}\n"));
                    unanswered.push_back(line.len() + 1);
                    waiting.pop_front();
                }
            }
            Turn::Report(pause) => {
                session.wait_us(pause);
                session.send(0, "?");
            }
            Turn::Override(pause, byte) => {
                session.wait_us(pause);
                session.send(0, [byte]);
            }
        }
        if waiting.is_empty() && unanswered.is_empty() {
            return;
        }
    }
}

/// The first lines of an example, and the place that they end at.
fn job(name: &str, lines: usize) -> String {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let text = std::fs::read_to_string(folder.join(name)).unwrap();
    text.lines()
        .take(lines)
        .map(|line| format!("{line}\n"))
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases / 10))]

    #[test]
    fn lumps_of_lines_never_let_segments_run_out(
        name in prop::sample::select(vec!["heart.nc", "pocket.nc", "spiral.nc", "raster.nc", "laser_delay.nc"]),
        laser in any::<bool>(),
        turns in prop::collection::vec(turn(), 10..60),
    ) {
        let setup = setup::<3>(1);
        let mut memory = Memory::new(&setup);
        let mut session = Session::new(&mut memory, &setup, Cartesian);
        session.stream(QUICK);
        session.stream(if laser { "$32=1\n$703=300\n" } else { "$32=0\n" });
        if !turns.iter().any(|turn| matches!(turn, Turn::Lines(_))) {
            return Ok(());
        }
        stream(&mut session, &job(name, 300), &turns);
        session.until_quiet();
        session.finish();
    }
}
