//! The step interrupt does not come: an alarm with words, within a fifth of a second, as often as
//! motion is asked for.

use crate::bench::{Memory, Session};
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::state::State;

const WORDS: &str = "[MSG:The step interrupt does not come: nothing moves]";

#[test]
fn motion_that_never_begins_ends_in_an_alarm_with_words_each_time() {
    for command in ["G1 X10 F600", "G0 X1", "$J=X5F100", "G1 X3 F1"] {
        let mut memory = Memory::new();
        let mut session = Session::boot(&mut memory, MachineConfig::grbl());
        session.pins.deaf = true;
        // A jog begins at rest only, and the machine never rests again.
        let rounds = if command.starts_with('$') { 1 } else { 3 };
        for round in 0..rounds {
            session.send(command);
            session.send("\n");
            if round == 0 {
                session.wait_ms(90);
                assert_eq!(session.pins.sent, b"ok\r\n", "{command}");
            }
            session.wait_ms(150);
            assert_eq!(session.lines(), ["ok", "ALARM:3", WORDS], "{command}");
            session.wait_ms(1_000);
            assert!(session.lines().is_empty(), "told once");
            assert!(matches!(session.machine.state(), State::Alarm(_)));
            session.send("$X\n");
            session.wait_ms(5);
            assert_eq!(session.lines(), ["[MSG:Caution: Unlocked]", "ok"]);
        }
        assert_eq!(session.pins.pulses, [0; 3]);
    }
}

#[test]
fn motion_whose_interrupt_dies_half_way_ends_in_the_alarm() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.send("G1 X10 F600\n");
    session.wait_ms(500);
    assert_eq!(session.lines(), ["ok"]);
    session.pins.deaf = true;
    session.wait_ms(150);
    assert_eq!(session.lines(), ["ALARM:3", WORDS]);
}

#[test]
fn homing_without_a_step_interrupt_fails_with_words() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.line("$22=1");
    session.pins.deaf = true;
    session.send("$H\n");
    session.wait_ms(200);
    let lines = session.lines();
    assert!(lines.contains(&WORDS.to_owned()), "{lines:?}");
    assert!(
        lines.iter().any(|line| line.starts_with("ALARM:")),
        "{lines:?}"
    );
}

/// A step takes up to a minute: parts of it are taken all the time.
#[test]
fn slow_motion_and_a_main_loop_that_stood_still_are_no_silence() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.line("$100=1");
    session.send("G1 X1 F2\n");
    session.wait_ms(20_000);
    assert_eq!(session.lines(), ["ok"]);
    assert_eq!(session.machine.state(), State::Run);
    session.stand_still_ms(900);
    session.wait_ms(15);
    assert_eq!(session.machine.state(), State::Run);
}

/// A main loop that sleeps until it is asked for again still sees that nothing comes.
#[test]
fn a_main_loop_that_sleeps_is_woken_to_look() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.pins.deaf = true;
    session.send("G1 X10 F600\n");
    session.sleep_ms(150);
    assert_eq!(session.lines(), ["ok", "ALARM:3", WORDS]);
}
