//! The time at which the machine answers a line: not before the answer is useful, and never so late
//! that motion slows down.
//!
//! The sender counts characters and looks at its line every millisecond, unless it stalls.

use leadscrew_planner::Cartesian;
use leadscrew_sim::{Memory, Rate};
use leadscrew_tests::{setup, Run, Session};
use std::collections::VecDeque;
use std::fmt::Write;
use std::num::NonZeroU32;
use std::ops::Range;

type Desk<'a> = Session<'a, Cartesian, 3>;

/// The most bytes of lines that the sender may have under way unanswered.
const WINDOW: usize = 1000;

/// 100 mm/s and 500 mm/s2: motion stops in 0.2 s.
const SETTINGS: &str = "$0=5\n$110=6000\n$111=6000\n$112=500\n$120=500\n$121=500\n$122=500\n";
const BRAKING: f64 = 0.2;

/// The bytes that the sender receives within some milliseconds.
struct Sight {
    /// The number of lines that were answered.
    answered: usize,
    /// The X carriage's place, steps.
    x: i32,
}

/// Streams a job with more settings before it. During the milliseconds of `stall` the sender
/// neither reads nor writes.
fn stream(rate: Rate, more_settings: &str, job: &str, stall: Range<u64>) -> (Run<3>, Vec<Sight>) {
    let mut setup = setup::<3>(1);
    setup.lines = vec![rate];
    let mut memory = Memory::new(&setup);
    let mut session: Desk<'_> = Session::new(&mut memory, &setup, Cartesian);
    session.stream(&format!("{SETTINGS}{more_settings}"));
    session.heard(0);
    let mut waiting: VecDeque<&str> = job.lines().collect();
    let mut unanswered: VecDeque<usize> = VecDeque::new();
    let (mut answered, mut sights) = (0, Vec::new());
    for millis in 0.. {
        session.wait_us(1_000);
        if !stall.contains(&millis) {
            for line in session.heard(0) {
                assert_eq!(line, "ok");
                unanswered.pop_front().expect("a line");
                answered += 1;
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
        let [x, ..] = session.sim.counted_position();
        sights.push(Sight { answered, x });
        if waiting.is_empty() && unanswered.is_empty() {
            break;
        }
    }
    session.until_quiet();
    (session.finish(), sights)
}

/// From the first step to the last, s.
fn duration(run: &Run<3>) -> f64 {
    let (first, last) = (run.steps.first().unwrap(), run.steps.last().unwrap());
    (last.cycle - first.cycle) as f64 / 168e6
}

const NO_STALL: Range<u64> = 0..0;

/// Lines along X, `mm` millimetres each.
fn along_x(lines: usize, mm: f64, feed: u32) -> String {
    let mut job = format!("G91G1F{feed}\n");
    for _ in 0..lines {
        writeln!(job, "X{mm}").unwrap();
    }
    job
}

/// The number of answered lines that have not begun. A line is 2 mm, which is 500 steps and takes
/// 40 ms.
fn ahead(sight: &Sight) -> f64 {
    let moves = sight.answered.saturating_sub(1) as f64;
    moves - f64::from(sight.x) / 500.0
}

#[test]
fn a_line_is_answered_no_more_than_braking_and_the_reserve_before_it_moves() {
    for (setting, reserve) in [("", 1.0), ("$710=0.3\n", 0.3), ("$710=3\n", 3.0)] {
        let job = along_x(300, 2.0, 3000);
        let (_, sights) = stream(Rate::NeverWaits, setting, &job, NO_STALL);
        let moves = (BRAKING + reserve) / 0.04;
        for (millis, sight) in sights.iter().enumerate() {
            let ahead = ahead(sight);
            assert!(
                ahead <= moves.max(15.0) + 2.5,
                "{setting}{millis} ms: {ahead}"
            );
            let all = sight.answered > 300;
            let filled = millis > 100;
            assert!(
                ahead >= moves - 1.5 || all || !filled,
                "{setting}{millis} ms: {ahead}"
            );
        }
    }
}

#[test]
fn fifteen_moves_are_taken_however_long_they_last() {
    let job = along_x(40, 40.0, 600);
    let (_, sights) = stream(Rate::NeverWaits, "", &job, NO_STALL);
    // Each line takes 4 s, so the moves that wait are more than enough. The first line sets modes.
    assert_eq!(sights[1_000].answered, 16);
}

#[test]
fn without_a_reserve_as_many_lines_are_answered_as_fit() {
    let job = along_x(300, 2.0, 3000);
    let (_, sights) = stream(Rate::NeverWaits, "$710=0\n", &job, NO_STALL);
    assert!(
        sights.len() < 100,
        "all are answered after {} ms",
        sights.len()
    );
}

/// Short moves round corners, at the speed that their corners and feed allow.
fn contour(lines: usize, mm: f64) -> String {
    let mut job = "G91G1F5000\n".to_owned();
    for k in 0..lines {
        let angle = (k as f64 * 0.05).sin() * 1.2;
        writeln!(job, "X{:.3}Y{:.3}", mm * angle.cos(), mm * angle.sin()).unwrap();
    }
    job
}

/// The same job with blanks behind each line, so that a window of the sender holds few lines and
/// the machine has not yet heard the whole job.
fn long(job: &str) -> String {
    job.lines().map(|line| format!("{line:100}\n")).collect()
}

#[test]
fn a_sender_that_stalls_for_less_than_the_reserve_loses_no_time() {
    for job in [long(&along_x(400, 2.0, 6000)), contour(2500, 0.4)] {
        let (smooth, _) = stream(Rate::NeverWaits, "", &job, NO_STALL);
        let (stalled, _) = stream(Rate::NeverWaits, "", &job, 2_000..2_900);
        let (smooth, stalled) = (duration(&smooth), duration(&stalled));
        assert!((stalled - smooth).abs() < 1e-3, "{smooth} {stalled}");
    }
}

#[test]
fn at_twice_the_speed_a_stall_costs_no_time_either() {
    let job = "\u{91}".repeat(10) + &long(&along_x(400, 2.0, 3000));
    let (smooth, _) = stream(Rate::NeverWaits, "", &job, NO_STALL);
    let (stalled, _) = stream(Rate::NeverWaits, "", &job, 2_000..2_900);
    let (smooth, stalled) = (duration(&smooth), duration(&stalled));
    assert!((8.0..8.5).contains(&smooth), "{smooth}");
    assert!((stalled - smooth).abs() < 1e-3, "{smooth} {stalled}");
}

#[test]
fn nothing_is_slower_for_it() {
    let baud = Rate::Baud(NonZeroU32::new(115_200).unwrap());
    for rate in [Rate::NeverWaits, baud] {
        for job in [
            along_x(500, 1.0, 6000),
            contour(1500, 0.4),
            contour(300, 5.0),
        ] {
            let (all, _) = stream(rate, "$710=0\n", &job, NO_STALL);
            let (reserve, _) = stream(rate, "", &job, NO_STALL);
            let (all, reserve) = (duration(&all), duration(&reserve));
            assert!(reserve <= all * 1.001, "{all} {reserve}");
        }
    }
}

/// All lines come in one burst. Moves that have not begun keep the settings that were valid before
/// them.
#[test]
fn a_setting_behind_a_move_in_one_burst_acts_after_it() {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session: Desk<'_> = Session::new(&mut memory, &setup, Cartesian);
    session.stream(SETTINGS);
    session.heard(0);
    assert_eq!(session.say("G1X4F3000\n$110=300\nG91X2\n"), ["ok"; 3]);
    let run = session.finish();
    assert_eq!(run.net_steps()[0], 1500);
    // 4 mm at 50 mm/s take less than 0.2 s, and 2 mm at 5 mm/s take 0.4 s.
    let cycles: Vec<u64> = run.steps.iter().map(|step| step.cycle.0).collect();
    let span = |range: Range<usize>| (cycles[range.end - 1] - cycles[range.start]) as f64 / 168e6;
    assert!(span(0..1000) < 0.2 && span(1000..1500) > 0.39);
}

/// A sender that has had the `ok` for a move must not be told Idle before the move is made.
#[test]
fn a_report_after_the_answer_to_a_move_is_never_idle() {
    for pause in [0, 50, 100, 150, 300, 1_000] {
        let setup = setup::<3>(1);
        let mut memory = Memory::new(&setup);
        let mut session: Desk<'_> = Session::new(&mut memory, &setup, Cartesian);
        session.stream(SETTINGS);
        session.heard(0);
        session.send(0, "G1X4F3000\n");
        while session.heard(0).is_empty() {
            session.wait_us(10);
        }
        session.wait_us(pause);
        session.send(0, "?");
        session.wait_us(2_000);
        let heard = session.heard(0);
        assert!(heard[0].starts_with("<Run|"), "{pause}: {heard:?}");
        session.until_quiet();
        session.finish();
    }
}
