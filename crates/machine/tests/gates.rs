//! An extension that objects to moves and M codes, refuses words of its own before anything is
//! carried out, and has numbers of its own for errors and alarms.

use crate::bench::{Memory, Session};
use leadscrew_gcode::{Letter, Number};
use leadscrew_machine::board::Instant;
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::extension::{Asked, Call, Cx, Extension, Gate, MCode, OwnCode, Step};
use leadscrew_machine::protocol::alarm::Alarm;
use leadscrew_machine::protocol::status::Status;
use leadscrew_planner::{Cartesian, Coordinate};
use std::cell::Cell;

static TOO_FAR: OwnCode = OwnCode {
    number: 250,
    text: "X is kept below 10",
    explanation: "This machine keeps clear of its far end.",
};
static JAMMED: OwnCode = OwnCode {
    number: 251,
    text: "The chuck is jammed",
    explanation: "Free it by hand.",
};

/// A chuck: nothing moves while it is open, X stays below 10 mm, and M21 to M29 work it.
struct Chuck<'c> {
    closed: &'c Cell<bool>,
    jams: &'c Cell<bool>,
    /// The moment of each poll, µs.
    polls: &'c Cell<Vec<u64>>,
    wakes: Option<Instant>,
}

impl Extension<3> for Chuck<'_> {
    fn m_code(&self, number: u8) -> Option<MCode> {
        matches!(number, 21..=29).then_some(MCode::with(&[Letter::P]))
    }

    fn check(&self, call: &Call) -> Result<(), Status> {
        match call.words.get(Letter::P) {
            Some(pressure) if pressure > Number::from_int(6) => Err(Status::Own(250)),
            Some(_) | None => Ok(()),
        }
    }

    fn gate(&self, asked: &Asked<'_, 3>) -> Gate {
        match asked {
            Asked::Move {
                target: [x, ..], ..
            } if *x > Coordinate::from_mm(10.0).unwrap() => Gate::Refuse(Status::Own(250)),
            Asked::Move { jog: true, .. } => Gate::Open,
            Asked::Move { .. } if !self.closed.get() => Gate::Wait,
            Asked::Code(call) if call.code == 29 => Gate::Refuse(Status::Own(250)),
            _ => Gate::Open,
        }
    }

    fn perform(&mut self, _: &Call, _: &mut Cx<'_, 3>) -> Step<3> {
        Step::Done
    }

    fn errors(&self) -> impl Iterator<Item = &'static OwnCode> {
        [&TOO_FAR].into_iter()
    }

    fn alarms(&self) -> impl Iterator<Item = &'static OwnCode> {
        [&JAMMED].into_iter()
    }

    fn poll(&mut self, cx: &mut Cx<'_, 3>) -> Option<Instant> {
        let mut polls = self.polls.take();
        polls.push(cx.now.ticks());
        self.polls.set(polls);
        if self.jams.take() {
            cx.alarm(Alarm::Own(251));
        }
        self.wakes
    }
}

macro_rules! chuck {
    ($session:ident, $closed:ident, $jams:ident) => {
        let ($closed, $jams, polls) = (Cell::new(true), Cell::new(false), Cell::default());
        let mut memory = Memory::new();
        let chuck = Chuck {
            closed: &$closed,
            jams: &$jams,
            polls: &polls,
            wakes: None,
        };
        let mut $session = Session::extended(&mut memory, MachineConfig::grbl(), Cartesian, chuck);
    };
}

#[test]
fn a_move_waits_until_its_gate_opens_and_the_machine_shows_run() {
    chuck!(session, closed, _jams);
    session.send("G1X1F600\nX2\n");
    session.until_quiet();
    assert_eq!(session.lines(), ["ok", "ok"]);
    closed.set(false);
    session.send("X3\nX4\n");
    session.wait_ms(1_000);
    assert!(session.status().starts_with("<Run|"));
    assert_eq!(session.pins.position[0], 2 * 250);
    closed.set(true);
    session.until_quiet();
    assert_eq!(session.lines(), ["ok", "ok"]);
    assert_eq!(session.pins.position[0], 4 * 250);
    assert!(session.status().starts_with("<Idle|"));
}

#[test]
fn an_arc_and_a_probe_wait_too_and_a_jog_does_not() {
    chuck!(session, closed, _jams);
    session.line("F600");
    for line in ["G2X2I1", "G38.3Z-1"] {
        closed.set(false);
        let before = session.pins.pulses;
        session.send(format!("{line}\n"));
        session.wait_ms(500);
        assert_eq!(session.pins.pulses, before, "{line}");
        closed.set(true);
        session.until_quiet();
        assert!(session.lines().contains(&"ok".to_owned()), "{line}");
        assert_ne!(session.pins.pulses, before, "{line}");
    }
    closed.set(false);
    assert_eq!(session.line("$J=G91X1F600"), ["ok"]);
    assert_eq!(session.pins.position[0], 3 * 250);
}

#[test]
fn a_reset_ends_the_wait() {
    chuck!(session, closed, _jams);
    closed.set(false);
    session.send("G1X3F600\n");
    session.wait_ms(100);
    session.send([0x18]);
    session.wait_ms(100);
    closed.set(true);
    session.until_quiet();
    assert_eq!(session.pins.position[0], 0);
    assert!(session.status().starts_with("<Idle|"));
}

#[test]
fn a_refused_move_is_answered_with_a_number_of_its_own_and_the_next_begins_where_it_would_have() {
    chuck!(session, _closed, _jams);
    session.line("G1X5F600");
    assert_eq!(session.line("X11").last().unwrap(), "error:250");
    assert_eq!(session.line("$J=X11F600").last().unwrap(), "error:250");
    assert_eq!(session.line("G91X1"), ["ok"]);
    assert_eq!(session.pins.position[0], 6 * 250);
}

#[test]
fn a_gate_is_asked_about_m_codes_and_a_check_comes_before_anything_else() {
    chuck!(session, _closed, _jams);
    assert_eq!(session.line("M29").last().unwrap(), "error:250");
    assert_eq!(
        session.line("G20G1X2F600M21P7").last().unwrap(),
        "error:250"
    );
    assert!(session.line("$G")[0].contains("G21"));
    assert_eq!(session.pins.position, [0; 3]);
    session.line("$C");
    assert_eq!(session.line("M21P7").last().unwrap(), "error:250");
    assert_eq!(session.line("M29"), ["ok"], "a gate depends on the moment");
}

#[test]
fn its_alarm_has_its_number_and_its_words() {
    chuck!(session, _closed, jams);
    session.send("G1X5F600\n");
    session.wait_ms(100);
    jams.set(true);
    session.wait_ms(100);
    let lines = session.lines();
    assert!(lines.contains(&"ALARM:251".to_owned()), "{lines:?}");
    assert!(session.status().starts_with("<Alarm|"));
    session.line("$X");
    let listed = session.line("$EA");
    assert_eq!(
        listed.iter().rev().nth(1).unwrap(),
        "[ALARMCODE:251||The chuck is jammed]"
    );
    let listed = session.line("$EE");
    assert_eq!(
        listed.iter().rev().nth(1).unwrap(),
        "[ERRORCODE:250||X is kept below 10]"
    );
}

#[test]
fn its_words_come_with_a_number_that_no_sender_knows() {
    chuck!(session, _closed, _jams);
    let said = session.line("G0X20");
    assert_eq!(said, ["[MSG:X is kept below 10]", "error:250"]);
}

#[test]
fn it_is_polled_at_the_instant_that_it_asks_for_even_if_nothing_else_happens() {
    let (closed, jams, polls) = (Cell::new(true), Cell::new(false), Cell::default());
    let mut memory = Memory::new();
    let chuck = Chuck {
        closed: &closed,
        jams: &jams,
        polls: &polls,
        wakes: Some(Instant::from_ticks(123_456)),
    };
    let mut session = Session::extended(&mut memory, MachineConfig::grbl(), Cartesian, chuck);
    let at = Instant::from_ticks(session.now_us());
    let next = session.machine.poll(&mut session.pins, at);
    assert!(!next.busy);
    assert_eq!(next.when, Some(Instant::from_ticks(123_456)));
    // An instant in the past makes the caller look again a little later, not run in a circle.
    let late = Instant::from_ticks(200_000);
    let next = session.machine.poll(&mut session.pins, late);
    assert!(next.when > Some(late), "{next:?}");
    assert_eq!(polls.take().last(), Some(&200_000));
}
