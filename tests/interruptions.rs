//! Interrupts a short job at every one of its steps: with a hold, a door, a reset or a jog cancel.
//! Afterwards nothing moves unasked, the position is exact, and a job that may go on reaches its
//! exact end.
//!
//! The job runs once undisturbed. Then it runs anew for each of its step events, with the byte sent
//! at the end of the microsecond before that event. The motion is compared with the undisturbed
//! run.

use leadscrew_planner::Cartesian;
use leadscrew_sim::plant::{Pin, Side, Switch};
use leadscrew_sim::{Cycle, Memory, StepEvent};
use leadscrew_tests::{setup, Session};

const SETTINGS: &str =
    "$100=40\n$101=40\n$102=40\n$110=3000\n$111=3000\n$120=300\n$121=300\n$32=1\n";

/// A line, a corner, an arc and a rapid back, with a laser whose power follows the speed.
const PROGRAM: &str = "M4S700\nG1X2Y1F2000\nY2.5\nG2X3Y3.5R1\nG0X2\n";

/// Two holes in pecks, and two bored in another plane: a line makes many moves. The job ends at a
/// place at which it was at no other time.
const HOLES: &str = "G91G99G83X0.5Y0.2Z-0.7R-0.3Q0.3L2F900\nG18G98G85X0.3Y-0.5R0.2L2\nG0X0.1\n";

const JOGS: &str = "$J=G91X2Y1F2000\n$J=G91Y2F2000\n";

/// Longer than any stop, and shorter than the rest of any job after its longest hold, µs.
const STOPPING: u64 = 300_000;

type Desk<'a> = Session<'a, Cartesian, 3>;

/// The motion of the carriages: signed steps, motor by motor.
///
/// Step events cannot be compared: the steps of two motors in ticks of different segments may fall
/// into one event or into two.
type Tracks = [Vec<i8>; 3];

fn tracks(steps: &[StepEvent]) -> Tracks {
    std::array::from_fn(|motor| {
        let own = steps.iter().filter(|event| event.motors.contains(motor));
        own.map(|event| 1 - 2 * i8::from(event.negative.contains(motor)))
            .collect()
    })
}

/// Positions after each step event of a run that began at the origin.
fn places(steps: &[StepEvent]) -> Vec<[i32; 3]> {
    let mut place = [0; 3];
    let after = |event: &StepEvent| {
        for (motor, at) in place.iter_mut().enumerate() {
            let sign = 1 - 2 * i32::from(event.negative.contains(motor));
            *at += sign * i32::from(event.motors.contains(motor));
        }
        place
    };
    let mut all = vec![[0; 3]];
    all.extend(steps.iter().map(after));
    all
}

fn begin<'a>(memory: &'a mut Memory<3, 3>, job: &str) -> Desk<'a> {
    let mut session = Session::new(memory, &setup::<3>(1), Cartesian);
    session.stream(SETTINGS);
    session.send(0, job);
    session
}

/// A job and the byte that interrupts it.
struct Case<'a> {
    job: &'a str,
    byte: u8,
    /// The undisturbed run.
    steps: Vec<StepEvent>,
}

impl<'a> Case<'a> {
    fn new(job: &'a str, byte: u8) -> Self {
        let mut memory = Memory::new(&setup::<3>(1));
        let mut session = begin(&mut memory, job);
        session.until_quiet();
        let steps = session.finish().steps;
        assert!((150..600).contains(&steps.len()), "{}", steps.len());
        Self { job, byte, steps }
    }

    /// The job begun anew, with the byte sent at the end of the microsecond before `event`.
    fn interrupted<'m>(&self, memory: &'m mut Memory<3, 3>, event: &StepEvent) -> Desk<'m> {
        let mut session = begin(memory, self.job);
        session.wait_us((event.cycle - session.sim.now()) / 168);
        session.send(0, [self.byte]);
        session
    }

    /// Interrupts the job at every step event. Calls `then` with the session at rest and whether
    /// all steps were made. `then` answers whether the whole job is made in the end, or only the
    /// steps up to the interruption.
    fn at_every_step(&self, then: impl Fn(&mut Desk<'_>, bool) -> bool) {
        let (whole, places) = (tracks(&self.steps), places(&self.steps));
        for (index, event) in self.steps.iter().enumerate() {
            let mut memory = Memory::new(&setup::<3>(1));
            let mut session = self.interrupted(&mut memory, event);
            session.wait_us(STOPPING);
            let at = session.sim.board().plant.position();
            assert_eq!(session.sim.counted_position(), at, "{index}");
            assert!(
                places.iter().any(|place| is_near(place, &at)),
                "{index}: {at:?}"
            );
            session.wait_us(1_000_000);
            assert_eq!(session.sim.board().plant.position(), at, "{index}: moves");
            assert_eq!(
                reported(&mut session),
                at.map(f64::from).map(|steps| steps / 40.0),
                "{index}"
            );
            let all_made = at == places[places.len() - 1];
            let goes_on = then(&mut session, all_made);
            let run = session.finish();
            let made = tracks(&run.steps);
            for (made, whole) in made.iter().zip(&whole) {
                assert!(whole.starts_with(made), "{index}: {made:?}");
            }
            assert_eq!(made == whole, goes_on || all_made, "{index}");
        }
    }
}

/// Returns true if two places are at most one step apart on each axis.
fn is_near(place: &[i32; 3], at: &[i32; 3]) -> bool {
    place.iter().zip(at).all(|(a, b)| (a - b).abs() <= 1)
}

/// The number of the last alarm.
fn alarm(session: &Desk<'_>) -> Option<u8> {
    let last = session.sim.machine().last_alarm();
    last.map(|alarm| alarm.number())
}

fn report(session: &mut Desk<'_>) -> String {
    session.send(0, "?");
    session.wait_us(5_000);
    let mut heard = session.heard(0).into_iter();
    heard.rfind(|line| line.starts_with('<')).expect("a report")
}

/// The machine position of a report, mm. Its three decimals are exact, since a step is 1/40 mm.
fn reported(session: &mut Desk<'_>) -> [f64; 3] {
    let report = report(session);
    let fields = report
        .split('|')
        .find_map(|field| field.strip_prefix("MPos:"));
    let mut numbers = fields
        .expect("MPos")
        .split(',')
        .map(|text| text.parse().unwrap());
    [(); 3].map(|()| numbers.next().unwrap())
}

/// Settings for two cycles: homing of Z, then of X and Y together, with switches half a millimetre
/// away; and probing down to a plate at −1 mm.
const CYCLE_SETTINGS: &str =
    "$22=1\n$24=300\n$25=1200\n$26=2\n$27=0.5\n$130=2\n$131=2\n$132=2\n$112=3000\n$122=300\n";

/// Begins a cycle with its switches in place. Sends the byte of `interruption`, if any, at the end
/// of the microsecond before its cycle.
fn cycle<'m>(
    memory: &'m mut Memory<3, 3>,
    line: &str,
    interruption: Option<(u8, Cycle)>,
) -> Desk<'m> {
    let mut session = Session::new(memory, &setup::<3>(1), Cartesian);
    session.stream(SETTINGS);
    session.stream(CYCLE_SETTINGS);
    let switch = |pin, motor, side, place| Switch {
        pin,
        motor,
        side,
        place,
        level: false,
    };
    for switch in [
        switch(Pin::Limit(0), 0, Side::AtOrAbove, 12),
        switch(Pin::Limit(1), 1, Side::AtOrAbove, 20),
        switch(Pin::Limit(2), 2, Side::AtOrAbove, 16),
        switch(Pin::Probe, 2, Side::AtOrBelow, -40),
    ] {
        session.sim.add_switch(switch);
    }
    session.send(0, line);
    if let Some((byte, at)) = interruption {
        session.wait_us((at - session.sim.now()) / 168);
        session.send(0, [byte]);
    }
    session
}

/// The difference between each axis's count and its carriage's place.
fn shifts(session: &Desk<'_>) -> [i32; 3] {
    let (counted, plant) = (
        session.sim.counted_position(),
        session.sim.board().plant.position(),
    );
    std::array::from_fn(|axis| counted[axis] - plant[axis])
}

/// Interrupts a cycle at every step event. Checks that the motors make the beginning of the
/// undisturbed motion, and that nothing moves afterwards unasked. Each axis keeps its count, or is
/// counted from home if it has been homed. `then` is told whether the cycle had come to its end.
fn cycle_at_every_step(line: &str, byte: u8, then: impl Fn(&mut Desk<'_>, bool)) {
    let mut memory = Memory::new(&setup::<3>(1));
    let mut session = cycle(&mut memory, line, None);
    session.until_quiet();
    let end = session.sim.board().plant.position();
    let homed = shifts(&session);
    let steps = session.into_steps();
    assert!(steps.len() > 40, "{}", steps.len());
    let whole = tracks(&steps);
    for (index, event) in steps.iter().enumerate() {
        let mut memory = Memory::new(&setup::<3>(1));
        let mut session = cycle(&mut memory, line, Some((byte, event.cycle)));
        session.wait_us(STOPPING);
        let at = session.sim.board().plant.position();
        session.wait_us(1_000_000);
        assert_eq!(session.sim.board().plant.position(), at, "{index}: moves");
        let found = shifts(&session);
        // Z homes first, then X and Y together.
        let one_by_one = [[0; 3], [0, 0, homed[2]], homed];
        assert!(one_by_one.contains(&found), "{index}: {found:?}");
        then(&mut session, at == end);
        session.until_quiet();
        let outcome = session.sim.outcome();
        assert!(
            outcome.violations.is_empty(),
            "{index}: {:?}",
            outcome.violations
        );
        assert!(outcome.late.is_empty(), "{index}: {:?}", outcome.late);
        let made = tracks(&session.into_steps());
        for (made, whole) in made.iter().zip(&whole) {
            assert!(whole.starts_with(made), "{index}: {made:?}");
        }
    }
}

#[test]
fn homing_ends_with_its_alarm_at_any_step_of_a_reset_or_a_door() {
    for (byte, number) in [(0x18, 6), (0x84, 7)] {
        cycle_at_every_step("$H\n", byte, |session, _| {
            assert_eq!(alarm(session), Some(number));
            let counted = session.sim.counted_position().map(f64::from);
            assert_eq!(reported(session), counted.map(|steps| steps / 40.0));
            assert!(report(session).starts_with("<Alarm|"));
            let heard = session.say("~\nG0X1\n");
            assert_eq!(heard.last().map(String::as_str), Some("error:9"));
        });
    }
}

#[test]
fn a_probe_is_aborted_with_alarm_3_at_any_step_of_a_reset() {
    cycle_at_every_step("G38.2Z-2F400\n", 0x18, |session, all_made| {
        // The reset may have come after the last step: then all positions are known.
        let expected = match alarm(session) {
            None if all_made => "<Idle|",
            found => {
                assert_eq!(found, Some(3));
                "<Alarm|"
            }
        };
        assert!(report(session).starts_with(expected));
    });
}

#[test]
fn a_probe_that_is_held_at_any_step_goes_on_to_the_same_contact() {
    for (byte, state) in [(b'!', "<Hold:0|"), (0x84, "<Door:0|")] {
        cycle_at_every_step("G38.2Z-2F400\n", byte, |session, _| {
            let before = report(session);
            assert!(before.starts_with(state), "{before}");
            session.send(0, "~");
            session.until_quiet();
            let heard = session.heard(0);
            let contact = "[PRB:0.000,0.000,-1.000:1]";
            assert!(heard.iter().any(|line| line == contact), "{heard:?}");
            assert_eq!(alarm(session), None);
        });
    }
}

#[test]
fn a_hold_at_any_step_stops_on_the_path_and_a_resume_ends_at_the_target() {
    for program in [PROGRAM, HOLES] {
        Case::new(program, b'!').at_every_step(|session, _| {
            assert!(report(session).starts_with("<Hold:0|"));
            session.send(0, "~");
            session.until_quiet();
            assert!(report(session).starts_with("<Idle|"));
            true
        });
    }
}

#[test]
fn a_door_at_any_step_stops_on_the_path_and_a_resume_ends_at_the_target() {
    for program in [PROGRAM, HOLES] {
        Case::new(program, 0x84).at_every_step(|session, _| {
            assert!(report(session).starts_with("<Door:0|"));
            session.send(0, "~");
            session.until_quiet();
            assert!(report(session).starts_with("<Idle|"));
            true
        });
    }
}

#[test]
fn a_reset_at_any_step_is_alarm_3_and_nothing_moves_until_it_is_unlocked() {
    for program in [PROGRAM, HOLES] {
        Case::new(program, 0x18).at_every_step(|session, all_made| {
            // The reset may have come after the last step: then all positions are known.
            if all_made && alarm(session).is_none() {
                assert!(report(session).starts_with("<Idle|"));
                return false;
            }
            assert_eq!(alarm(session), Some(3));
            assert!(report(session).starts_with("<Alarm|"));
            assert_eq!(session.say("~\nG0X1\n"), ["ok", "error:9"]);
            assert_eq!(session.say("$X\n"), ["[MSG:Caution: Unlocked]", "ok"]);
            false
        });
    }
}

#[test]
fn a_jog_is_cancelled_at_any_step_without_an_alarm() {
    for byte in [0x85, b'!'] {
        Case::new(JOGS, byte).at_every_step(|session, _| {
            assert_eq!(alarm(session), None);
            assert!(report(session).starts_with("<Idle|"));
            session.send(0, "~");
            session.until_quiet();
            false
        });
    }
}

#[test]
fn a_door_ends_a_jog_for_good_at_any_step() {
    Case::new(JOGS, 0x84).at_every_step(|session, _| {
        assert_eq!(alarm(session), None);
        assert!(report(session).starts_with("<Door:0|"));
        session.send(0, "~");
        session.until_quiet();
        assert!(report(session).starts_with("<Idle|"));
        false
    });
}

#[test]
fn a_reset_in_a_jog_is_alarm_3_at_any_step() {
    Case::new(JOGS, 0x18).at_every_step(|session, all_made| {
        // The reset may have come after the last step: then nothing was left to abort.
        let found = alarm(session);
        assert!(found == Some(3) || all_made && found.is_none());
        false
    });
}

#[test]
fn a_jog_cancel_is_nothing_to_a_program() {
    let case = Case::new(PROGRAM, 0x85);
    for event in &case.steps {
        let mut memory = Memory::new(&setup::<3>(1));
        let mut session = case.interrupted(&mut memory, event);
        session.until_quiet();
        assert_eq!(tracks(&session.finish().steps), tracks(&case.steps));
    }
}
