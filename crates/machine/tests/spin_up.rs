//! `$712`: after a hold in which 0x9E has stopped the spindle, motion waits until it turns again.

use crate::bench::{Memory, Session};
use leadscrew_machine::board::SpindleOutput;
use leadscrew_machine::config::MachineConfig;
use leadscrew_planner::Cartesian;
use leadscrew_stepper::Power;

type Desk<'m> = Session<'m, Cartesian>;

const STOP: u8 = 0x9E;
const DOOR: u8 = 0x84;

/// Held in a cut; a spindle takes two seconds.
fn held(memory: &mut Memory) -> Desk<'_> {
    let mut session = Session::boot(memory, MachineConfig::grbl());
    session.line("$712=2");
    session.send("M3S500\nG1X10F600\n");
    session.wait_ms(300);
    session.send("!");
    session.wait_ms(1_000);
    assert!(session.status().starts_with("<Hold:0|"));
    session
}

/// Milliseconds from now until the next step; at most 20 000.
fn until_motion(session: &mut Desk) -> u64 {
    let (begin, place) = (session.now_us(), session.pins.position);
    session
        .until(|session| session.pins.position != place || session.now_us() - begin > 20_000_000);
    (session.now_us() - begin) / 1_000
}

fn turns(session: &Desk) -> bool {
    session.pins.spindle == SpindleOutput::Clockwise && session.pins.power != Power::OFF
}

#[test]
fn motion_waits_for_a_spindle_that_was_stopped_and_for_no_other() {
    for (bytes, wait) in [
        (&[][..], 0),
        (&[STOP], 2_000),
        // The second byte has switched it on again just now.
        (&[STOP, STOP], 2_000),
        (&[STOP, STOP, STOP], 2_000),
    ] {
        let mut memory = Memory::new();
        let mut session = held(&mut memory);
        for byte in bytes {
            session.send([*byte]);
            session.wait_ms(10);
        }
        session.send("~");
        session.wait_ms(1);
        assert!(turns(&session), "{bytes:?}");
        let found = until_motion(&mut session);
        assert!(
            (wait..wait + 50).contains(&(found + 11)) || wait == 0 && found < 50,
            "{found}"
        );
        session.until_quiet();
        assert_eq!(session.pins.position[0], 10 * 250);
    }
}

#[test]
fn a_spindle_that_turns_for_long_enough_needs_no_wait() {
    let mut memory = Memory::new();
    let mut session = held(&mut memory);
    session.send([STOP, STOP]);
    session.wait_ms(2_500);
    session.send("~");
    assert!(until_motion(&mut session) < 50);
}

#[test]
fn while_it_waits_the_machine_is_held_and_obeys_as_in_a_hold() {
    let mut memory = Memory::new();
    let mut session = held(&mut memory);
    let place = session.pins.position;
    session.send([STOP]);
    session.wait_ms(10);
    session.send("~");
    session.wait_ms(1_000);
    assert!(session.status().starts_with("<Hold:0|"));
    // Another `~` changes nothing; `!` holds on, and the spindle turns.
    session.send("~");
    session.wait_ms(10);
    session.send("!");
    session.wait_ms(5_000);
    assert!(session.status().starts_with("<Hold:0|"));
    assert!(turns(&session));
    // 0x9E stops it again, and ends a wait.
    session.send([STOP]);
    session.wait_ms(10);
    session.send("~");
    session.wait_ms(100);
    session.send([STOP]);
    session.wait_ms(5_000);
    assert!(!turns(&session));
    assert_eq!(session.pins.position, place);
    // The door, and a reset.
    session.send("~");
    session.wait_ms(100);
    session.send([DOOR]);
    session.wait_ms(5_000);
    assert!(session.status().starts_with("<Door:0|"));
    session.send([0x18]);
    session.wait_ms(5_000);
    assert_eq!(session.pins.position, place);
    assert!(session.status().starts_with("<Idle|"));
}

#[test]
fn m0_with_a_stopped_spindle_waits_too() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.line("$712=2");
    session.send("M3S500\nM0\nG1X1F600\n");
    session.wait_ms(100);
    session.send([STOP]);
    session.wait_ms(10);
    session.send("~");
    assert!((1_950..2_100).contains(&until_motion(&mut session)));
}

#[test]
fn a_laser_waits_for_nothing_and_neither_does_stock_grbl() {
    for (setting, expected) in [("$32=1", "$712=2"), ("$32=0", "$712=0")] {
        let mut memory = Memory::new();
        let mut session = Session::boot(&mut memory, MachineConfig::grbl());
        assert_eq!(session.line("$712"), ["$712=0.000", "ok"]);
        session.line(setting);
        session.line(expected);
        session.send("M3S500\nG1X10F600\n");
        session.wait_ms(300);
        session.send("!");
        session.wait_ms(1_000);
        session.send([STOP]);
        session.wait_ms(10);
        session.send("~");
        assert!(until_motion(&mut session) < 50, "{setting}");
    }
}
