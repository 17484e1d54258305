//! Realtime bytes act within 1 ms of simulated time, and `?` is answered within 5 ms, in every
//! state and whatever the machine is busy with. A sender that ignores flow control is told what was
//! lost.

mod situation;

use leadscrew_machine::state::{Door, Hold, Jog, State};
use leadscrew_planner::Cartesian;
use leadscrew_sim::trouble::LateReason;
use leadscrew_sim::{Cycle, Memory, Rate};
use leadscrew_stepper::Power;
use leadscrew_tests::{setup, Session};
use situation::{baud, byte_time, in_situation, state, Desk, SITUATIONS};

/// The time within which a realtime byte must act, µs.
const ACTS: u64 = 1_000;

/// The time within which a report must be answered, µs.
const ANSWERS: u64 = 5_000;

/// The state that must follow a byte; `None` if the state stays.
fn becomes(state: State, byte: u8) -> Option<fn(State) -> bool> {
    let hold: fn(State) -> bool = |state| matches!(state, State::Hold(_));
    let door: fn(State) -> bool = |state| matches!(state, State::Door(_));
    let cancelled: fn(State) -> bool = |state| {
        matches!(
            state,
            State::Jog(Jog::Cancelling { .. }) | State::Idle | State::Door(_)
        )
    };
    let going: fn(State) -> bool = |state| matches!(state, State::Run | State::Idle);
    let restoring: fn(State) -> bool = |state| {
        matches!(
            state,
            State::Door(Door::Restoring) | State::Run | State::Idle
        )
    };
    let alarm: fn(State) -> bool = |state| matches!(state, State::Alarm(_));
    match (state, byte) {
        (State::Idle | State::Run, b'!') => Some(hold),
        (State::Jog(_), b'!' | 0x85 | 0x84) => Some(cancelled),
        (State::Hold(_), b'~') => Some(going),
        (State::Door(Door::Parked), b'~') => Some(restoring),
        (State::Idle | State::Run | State::Hold(_), 0x84) => Some(door),
        (State::Home, 0x84) => Some(alarm),
        _ => None,
    }
}

#[test]
fn commands_of_the_operator_change_the_state_within_a_millisecond_in_every_situation() {
    for situation in &SITUATIONS {
        for byte in [b'!', b'~', 0x84, 0x85] {
            in_situation(situation, Rate::NeverWaits, |session| {
                let before = state(session);
                session.send(0, [byte]);
                session.wait_us(ACTS);
                let after = state(session);
                let name = situation.name;
                match becomes(before, byte) {
                    Some(expected) => assert!(expected(after), "{name} {byte:#x}: {after:?}"),
                    // A motion that was under way may have ended.
                    None => assert!(
                        before == after || is_end(before, after),
                        "{name} {byte:#x}: {before:?}, {after:?}"
                    ),
                }
            });
        }
    }
}

/// Returns true if `after` is the state at the end of the deceleration of `before`.
fn is_end(before: State, after: State) -> bool {
    before
        .stopped()
        .is_some_and(|end| std::mem::discriminant(&end) == std::mem::discriminant(&after))
}

/// The overrides of feed, rapids and spindle, per cent.
fn overrides(session: &Desk<'_>) -> (u8, u8, u8) {
    let overrides = session.sim.machine().overrides();
    (overrides.feed, overrides.rapid, overrides.spindle)
}

#[test]
fn overrides_change_within_a_millisecond_in_every_situation() {
    for situation in &SITUATIONS {
        for (byte, expected) in [
            (0x91, (110, 100, 100)),
            (0x92, (90, 100, 100)),
            (0x93, (101, 100, 100)),
            (0x94, (99, 100, 100)),
            (0x96, (100, 50, 100)),
            (0x97, (100, 25, 100)),
            (0x9A, (100, 100, 110)),
            (0x9B, (100, 100, 90)),
            (0x9C, (100, 100, 101)),
            (0x9D, (100, 100, 99)),
        ] {
            in_situation(situation, Rate::NeverWaits, |session| {
                session.send(0, [byte]);
                session.wait_us(ACTS);
                assert_eq!(overrides(session), expected, "{} {byte:#x}", situation.name);
            });
        }
    }
}

#[test]
fn overrides_are_back_at_100_percent_within_a_millisecond_in_every_situation() {
    for situation in &SITUATIONS {
        for (byte, expected) in [
            (0x90, (100, 25, 110)),
            (0x95, (110, 100, 110)),
            (0x99, (110, 25, 100)),
        ] {
            in_situation(situation, Rate::NeverWaits, |session| {
                session.send(0, [0x91, 0x97, 0x9A]);
                session.wait_us(ACTS);
                session.send(0, [byte]);
                session.wait_us(ACTS);
                assert_eq!(overrides(session), expected, "{} {byte:#x}", situation.name);
            });
        }
    }
}

/// As in Grbl, coolant is toggled in Idle, Run, Jog and Hold. The spindle is toggled in a hold that is
/// complete.
#[test]
fn coolant_and_spindle_are_switched_within_a_millisecond_where_grbl_switches_them() {
    for situation in &SITUATIONS {
        for byte in [0x9E, 0xA0, 0xA1] {
            in_situation(situation, Rate::NeverWaits, |session| {
                let before = outputs(session);
                let may = matches!(
                    (state(session), byte),
                    (State::Hold(Hold::Complete { .. }), _)
                        | (
                            State::Idle | State::Run | State::Jog(_) | State::Hold(_),
                            0xA0 | 0xA1
                        )
                );
                session.send(0, [byte]);
                session.wait_us(ACTS);
                let (spindle, flood, mist) = before;
                let after = match byte {
                    _ if !may => before,
                    0x9E => (false, flood, mist),
                    0xA0 => (spindle, !flood, mist),
                    _ => (spindle, flood, !mist),
                };
                let name = situation.name;
                assert_eq!(outputs(session), after, "{name} {byte:#x}");
                session.send(0, [byte]);
                session.wait_us(ACTS);
                assert_eq!(outputs(session), before, "{name} {byte:#x} again");
            });
        }
    }
}

/// Returns whether spindle, flood and mist are on.
fn outputs(session: &Desk<'_>) -> (bool, bool, bool) {
    let board = session.sim.board();
    let coolant = board.coolant();
    (board.power() != Power::OFF, coolant.flood, coolant.mist)
}

#[test]
fn a_reset_is_greeted_within_a_millisecond_in_every_situation() {
    for situation in &SITUATIONS {
        in_situation(situation, Rate::NeverWaits, |session| {
            session.heard(0);
            session.send(0, "\x18");
            session.wait_us(ACTS);
            let heard = session.heard(0);
            let banner = heard.iter().any(|line| line.starts_with("Grbl 1.1h"));
            assert!(banner, "{}: {heard:?}", situation.name);
        });
    }
}

#[test]
fn a_report_is_answered_within_five_milliseconds_in_every_situation() {
    for rate in [baud(115_200), baud(3_000_000), Rate::NeverWaits] {
        for situation in &SITUATIONS {
            in_situation(situation, rate, |session| {
                // Wait for the bytes still on their way to the machine.
                while session.is_sending(0) {
                    session.wait_us(1_000);
                }
                session.heard(0);
                session.send(0, "?");
                // The transmission of `?` and of the report comes on top. A report has 80
                // characters at most here.
                session.wait_us(ANSWERS + 81 * byte_time(rate));
                let heard = session.heard(0);
                let report = heard
                    .iter()
                    .any(|line| line.starts_with('<') && line.ends_with('>'));
                assert!(report, "{} at {rate:?}: {heard:?}", situation.name);
            });
        }
    }
}

/// Waits for the report that was asked for at `asked`. Returns how many µs later it began, and all
/// lines heard from then on.
fn report_begins(session: &mut Desk<'_>, asked: Cycle, byte_time: u64) -> (u64, Vec<String>) {
    let mut heard = Vec::new();
    loop {
        session.wait_us(20);
        heard.extend(session.heard(0));
        if let Some(report) = heard.iter().find(|line| line.starts_with('<')) {
            let ended = (session.sim.now() - asked) / 168;
            let began = ended.saturating_sub((report.len() as u64 + 2) * byte_time);
            return (began, heard);
        }
        assert!(session.sim.now() - asked < Cycle::from_micros(100_000).0);
    }
}

/// `?` comes at many instants while answers go out. The report comes between two lines, and after
/// one line at most.
#[test]
fn a_report_begins_within_five_milliseconds_or_a_row_while_answers_go_out() {
    let many = "\n".repeat(60);
    let asked = ["$$\n", "$#\n", "$N\n", "$I\n", "$\n", "$G\n", &many];
    for rate in [baud(115_200), baud(230_400), baud(3_000_000)] {
        let byte_time = byte_time(rate);
        for text in asked {
            let mut setup = setup::<3>(1);
            setup.lines = vec![rate];
            let mut memory = Memory::new(&setup);
            let mut session = Session::new(&mut memory, &setup, Cartesian);
            session.stream("G10L2P1X-123.456Y-234.567Z-345.678\n$N0=G0G54G17G21G90G94\n");
            let whole = session.say(text);
            let longest = whole.iter().map(String::len).max().unwrap() as u64 + 2;
            // A line that has begun goes on to its end, after the bytes that the board already
            // holds.
            let within = ANSWERS.max((longest + 9) * byte_time);
            let mut worst = 0;
            for bytes in (0..600).step_by(11) {
                session.send(0, text);
                session.wait_us((text.len() as u64 + bytes) * byte_time);
                session.send(0, "?");
                session.wait_us(byte_time);
                let now = session.sim.now();
                let mut heard = session.heard(0);
                let (began, more) = report_begins(&mut session, now, byte_time);
                heard.extend(more);
                session.until_quiet();
                heard.extend(session.heard(0));
                heard.retain(|line| !line.starts_with('<'));
                assert_eq!(heard, whole);
                assert!(began <= within, "{text:?} at {rate:?}: {began} us");
                worst = worst.max(began);
            }
            println!("{text:?} at {rate:?}: a report begins within {worst} us");
        }
    }
}

#[test]
fn a_sender_that_ignores_flow_control_loses_bytes_and_the_simulator_says_so() {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.send(0, "G4P1\n");
    session.wait_us(1_000);
    session.send(0, "G21\n".repeat(300));
    session.until_quiet();
    let run = session.finish_late();
    let late = &run.outcome.late;
    assert!(late.count() > 100, "{}", late.count());
    assert!(late
        .first()
        .iter()
        .all(|late| late.reason == LateReason::ByteLost));
    let text = late.first()[0].to_string();
    assert!(text.contains("a byte was lost"), "{text}");
}
