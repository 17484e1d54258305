//! Realtime bytes act within 1 ms of simulated time, and `?` is answered within 5 ms, in every
//! state and whatever the machine is busy with; and a sender that ignores flow control is told what
//! it has lost.

use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::settings::flash::{Area, SettingsStore};
use leadscrew_machine::state::{Door, Hold, Jog, State};
use leadscrew_planner::Cartesian;
use leadscrew_sim::trouble::LateReason;
use leadscrew_sim::{Cycle, Memory, Rate};
use leadscrew_stepper::Power;
use leadscrew_tests::{setup, Session};
use std::convert::Infallible;
use std::num::NonZeroU32;

type Desk<'a> = Session<'a, Cartesian, 3>;

/// Within this a realtime byte has acted, µs.
const ACTS: u64 = 1_000;

/// Within this a report has been answered, µs.
const ANSWERS: u64 = 5_000;

const SETTINGS: &str =
    "$100=80\n$101=80\n$102=80\n$110=9000\n$111=9000\n$112=9000\n$120=300\n$121=300\n$122=300\n\
                        $22=1\n$25=3000\n$24=500\n";

/// A situation: the lines that bring the machine there, and how it is recognised.
struct Situation {
    name: &'static str,
    bytes: &'static [u8],
    /// How long it takes, µs.
    wait: u64,
    is_there: fn(&Desk<'_>) -> bool,
}

fn state(session: &Desk<'_>) -> State {
    session.sim.machine().state()
}

/// Moves that take long, more than are planned ahead.
const MANY: &[u8] = &{
    let mut lines = [0; 40 * 30];
    let line = b"G1X9Y9F6000\nG1X0Y0\nG1X9Y0Z3\nG1\n";
    let mut at = 0;
    while at < lines.len() {
        lines[at] = line[at % line.len()];
        at += 1;
    }
    lines[lines.len() - 1] = b'\n';
    lines
};

const SITUATIONS: [Situation; 18] = [
    Situation {
        name: "Idle",
        bytes: b"",
        wait: 1,
        is_there: |session| state(session) == State::Idle,
    },
    Situation {
        name: "Run",
        bytes: b"G1X50Y20F6000\n",
        wait: 300_000,
        is_there: |session| state(session) == State::Run,
    },
    Situation {
        name: "Run, planner and receive buffer full",
        bytes: MANY,
        wait: 300_000,
        is_there: |session| state(session) == State::Run && !session.sim.machine().is_quiet(),
    },
    Situation {
        name: "Hold, slowing down",
        bytes: b"G1X50Y20F6000\n",
        wait: 0,
        is_there: |session| matches!(state(session), State::Hold(Hold::Stopping { .. })),
    },
    Situation {
        name: "Hold",
        bytes: b"G1X50Y20F6000\n",
        wait: 0,
        is_there: |session| matches!(state(session), State::Hold(Hold::Complete { .. })),
    },
    Situation {
        name: "Jog",
        bytes: b"$J=X50F6000\n",
        wait: 300_000,
        is_there: |session| state(session) == State::Jog(Jog::Moving),
    },
    Situation {
        name: "Jog, cancelled",
        bytes: b"$J=X50F6000\n",
        wait: 0,
        is_there: |session| matches!(state(session), State::Jog(Jog::Cancelling { .. })),
    },
    Situation {
        name: "Home",
        bytes: b"$H\n",
        wait: 300_000,
        is_there: |session| state(session) == State::Home,
    },
    Situation {
        name: "Door, slowing down",
        bytes: b"G1X50Y20F6000\n",
        wait: 0,
        is_there: |session| state(session) == State::Door(Door::Stopping),
    },
    Situation {
        name: "Door",
        bytes: b"G1X5Y2F6000\n\x84",
        wait: 500_000,
        is_there: |session| state(session) == State::Door(Door::Parked),
    },
    Situation {
        name: "Alarm",
        bytes: b"G1X50Y20F6000\n",
        wait: 0,
        is_there: |session| matches!(state(session), State::Alarm(_)),
    },
    Situation {
        name: "Check",
        bytes: b"$C\nG1X5F100\n",
        wait: 10_000,
        is_there: |session| state(session) == State::Check,
    },
    Situation {
        name: "Sleep",
        bytes: b"$SLP\n",
        wait: 10_000,
        is_there: |session| state(session) == State::Sleep,
    },
    Situation {
        name: "in a list",
        bytes: b"$$\n",
        wait: 0,
        is_there: |session| !session.sim.machine().is_quiet(),
    },
    Situation {
        name: "in a dwell",
        bytes: b"G4P2\n",
        wait: 100_000,
        is_there: |session| !session.sim.machine().is_quiet(),
    },
    Situation {
        name: "in a line",
        bytes: b"G1X5",
        wait: 1_000,
        is_there: |session| state(session) == State::Idle,
    },
    Situation {
        name: "in a comment",
        bytes: b"G1X5(a comment; ",
        wait: 1_000,
        is_there: |session| state(session) == State::Idle,
    },
    Situation {
        name: "while a setting is written",
        bytes: b"$110=6000\n",
        wait: 5_000,
        is_there: |session| !session.sim.machine().is_quiet(),
    },
];

/// Memory in which nothing was ever stored; nobody writes to it.
struct Blank;

impl SettingsStore for Blank {
    type Error = Infallible;
    fn size(&self) -> usize {
        1024
    }
    fn read(&mut self, _: Area, _: usize, bytes: &mut [u8]) -> Result<(), Infallible> {
        bytes.fill(0xFF);
        Ok(())
    }
    fn write(&mut self, _: Area, _: usize, _: &[u8]) -> Result<(), Infallible> {
        Ok(())
    }
    fn erase(&mut self, _: Area) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Brings a machine into a situation, and lets `then` look at it there.
fn in_situation(situation: &Situation, rate: Rate, then: impl FnOnce(&mut Desk<'_>)) {
    let mut setup = setup::<3>(1);
    setup.machine = MachineConfig::grbl();
    setup.machine.options.mist = true;
    setup.lines = vec![rate];
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream(SETTINGS);
    session.stream("M3S500");
    if situation.name == "while a setting is written" {
        let Ok(_) = session.sim.machine_mut().load(&mut Blank);
    }
    session.send(0, situation.bytes);
    match situation.name {
        "Hold, slowing down" | "Hold" => interrupt(&mut session, b"!", situation),
        "Jog, cancelled" => interrupt(&mut session, b"\x85", situation),
        "Door, slowing down" => interrupt(&mut session, b"\x84", situation),
        "Alarm" => interrupt(&mut session, b"\x18", situation),
        "in a list" => wait_for(&mut session, situation, 1),
        _ => session.wait_us(situation.wait),
    }
    assert!(
        (situation.is_there)(&session),
        "{}: {:?}",
        situation.name,
        state(&session)
    );
    then(&mut session);
}

/// Sends a byte in motion and waits until the machine is where the situation wants it: longer than
/// one burst of bytes, in which a hold keeps what comes after it from resuming.
fn interrupt(session: &mut Desk<'_>, byte: &[u8], situation: &Situation) {
    session.wait_us(500_000);
    session.heard(0);
    session.send(0, byte);
    session.wait_us(3_000);
    wait_for(session, situation, 50);
}

/// Waits until the machine is where the situation wants it, `step` microseconds at a time.
fn wait_for(session: &mut Desk<'_>, situation: &Situation, step: u64) {
    for _ in 0..20_000 {
        if (situation.is_there)(session) {
            return;
        }
        session.wait_us(step);
    }
}

fn baud(baud: u32) -> Rate {
    Rate::Baud(NonZeroU32::new(baud).unwrap())
}

/// The time of a byte on its line, µs, rounded up.
fn byte_time(rate: Rate) -> u64 {
    rate.byte_time().map_or(0, |cycles| cycles.div_ceil(168))
}

/// The state after a byte, whatever else it does; `None` where the state stays.
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
                    // Motion that goes on by itself may have come to its end.
                    None => assert!(
                        before == after || is_end(before, after),
                        "{name} {byte:#x}: {before:?}, {after:?}"
                    ),
                }
            });
        }
    }
}

/// Whether `after` is how a deceleration ends.
fn is_end(before: State, after: State) -> bool {
    before
        .stopped()
        .is_some_and(|end| std::mem::discriminant(&end) == std::mem::discriminant(&after))
}

/// Of feed, rapids and spindle, per cent.
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

/// As Grbl has it: the valves in Idle, Run and Hold, the spindle in a hold that is complete.
#[test]
fn coolant_and_spindle_are_switched_within_a_millisecond_where_grbl_switches_them() {
    for situation in &SITUATIONS {
        for byte in [0x9E, 0xA0, 0xA1] {
            in_situation(situation, Rate::NeverWaits, |session| {
                let before = outputs(session);
                let may = matches!(
                    (state(session), byte),
                    (State::Hold(Hold::Complete { .. }), _)
                        | (State::Idle | State::Run | State::Hold(_), 0xA0 | 0xA1)
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

/// Whether spindle, flood and mist are on.
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
                // Bytes still on their way to the machine go first.
                while session.is_sending(0) {
                    session.wait_us(1_000);
                }
                session.heard(0);
                session.send(0, "?");
                // The line's own time, there and back, comes on top: a report has 80 characters at
                // most here.
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

/// When the report that was asked for at `asked` has begun, µs later, and all that was heard from
/// then on.
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

/// What is asked for while answers go out, at any instant of it: never inside a line, and after one
/// line at most.
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
            // A row that has begun goes on to its end, and what the board has got before it.
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
