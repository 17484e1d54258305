//! A laser is dark unless a program or a jog has it burn, whatever interrupts them.
//!
//! [`endure`] plays scripts and checks the rule at every turn of the main loop. The other tests
//! check the power that is put out.

use leadscrew_planner::Cartesian;
use leadscrew_sim::plant::{Pin, Side, Switch};
use leadscrew_sim::Memory;
use leadscrew_stepper::Power;
use leadscrew_tests::abuse::endure;
use leadscrew_tests::{setup, Session};

/// Runs `test` on a machine with a laser, after the words of `program`.
fn with_laser(program: &str, test: impl FnOnce(&mut Session<'_, Cartesian, 3>)) {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream("$32=1\n$707=0\n$110=6000\n$120=500\n");
    session.stream(program);
    test(&mut session);
    session.finish();
}

fn is_lit(session: &Session<'_, Cartesian, 3>) -> bool {
    session.sim.board().power() > Power::OFF
}

#[test]
fn after_a_door_a_laser_is_dark_until_motion_goes_on() {
    // The coolant has to flow for a second before the laser is lit.
    endure(b"\0$32=1\nM8\nM3S500G1X-5F600\n\xF7\xF6\x84\xF7~\xF7\xF7");
}

#[test]
fn a_laser_is_lit_again_after_a_door_once_its_move_goes_on() {
    with_laser("M8\nM3S800G1F600\n", |session| {
        session.send(0, "X9\n");
        session.wait_us(300_000);
        assert!(is_lit(session));
        session.send(0, b"\x84");
        session.wait_us(300_000);
        assert!(!is_lit(session));
        session.send(0, "~");
        session.wait_us(990_000);
        assert!(!is_lit(session), "the coolant flows first");
        session.wait_us(30_000);
        assert!(is_lit(session));
        session.until_quiet();
    });
}

#[test]
fn a_laser_is_dark_in_check_mode_where_no_line_could_switch_it_off() {
    endure(b"\x01M3S500G1F100\n\xF0$C\n\xF0M5\n\xF0");
}

#[test]
fn an_override_while_homing_lights_nothing_up() {
    endure(b"\x05M3S500G1F100\n\xF3$H\n\xF7\x9A\xF4\xE2\xF3\xF7");
}

#[test]
fn after_homing_a_laser_stays_dark_until_the_program_burns() {
    with_laser("$22=1\n$25=1200\n$26=2\nM3S800G1F600\n", |session| {
        assert!(is_lit(session));
        for (motor, pin) in [Pin::Limit(0), Pin::Limit(1), Pin::Limit(2)]
            .into_iter()
            .enumerate()
        {
            session.sim.add_switch(Switch {
                pin,
                motor,
                side: Side::AtOrAbove,
                // The switch is at the position that the machine counts as home.
                place: 0,
                level: false,
            });
        }
        assert_eq!(session.say("$H\n"), ["ok"]);
        assert!(!is_lit(session));
        session.stream("X-5\n");
        assert!(is_lit(session));
    });
}

#[test]
fn a_laser_that_is_called_a_spindle_does_not_burn_at_rest() {
    with_laser("M4S800\nG1X1F600\n", |session| {
        assert_eq!(session.say("$32=0\n"), ["ok"]);
        assert!(!is_lit(session));
        assert!(session.say("$G\n")[0].contains(" M5 "));
    });
}

#[test]
fn after_an_alarm_a_laser_is_off_in_the_modes_too() {
    with_laser("M3S800G1F600\n", |session| {
        assert!(is_lit(session));
        session.say("G38.2Z-1F600\n");
        session.say("$X\n");
        assert!(session.say("$G\n")[0].contains(" M5 "));
        session.say("G1X1\n");
        assert!(!is_lit(session));
    });
}

#[test]
fn after_a_jog_that_is_cancelled_a_laser_stays_dark_until_the_program_burns() {
    with_laser("M3S800G1F600\n", |session| {
        session.send(0, "$J=X20F600\n");
        session.wait_us(500_000);
        assert!(is_lit(session), "as in Grbl");
        session.send(0, b"\x9A\x85");
        session.until_quiet();
        assert!(!is_lit(session));
        session.stream("X5\n");
        assert!(is_lit(session));
    });
}

#[test]
fn moves_that_wait_for_more_lines_light_nothing_up() {
    with_laser("$701=500\nM3S0G1F600\n", |session| {
        session.send(0, "X1S800\n");
        session.wait_us(100_000);
        session.send(0, b"\x9A");
        session.wait_us(100_000);
        assert!(!is_lit(session));
        session.until_quiet();
        assert!(is_lit(session));
    });
}

#[test]
fn a_laser_that_a_line_switches_on_goes_off_with_the_alarm_of_its_move() {
    // Laser mode and soft limits: the first move leaves the allowed travel, and starts from rest.
    endure(b"\x4DM3S50G1X5Y2F3000\n3S0\n0");
}

#[test]
fn a_laser_under_m3_goes_off_with_the_alarm_of_a_probe() {
    // Found by random streams: the probe has contact before it moves.
    endure(b"\x2BG91G1Z-2F1000\nM3S500\n\xE3G38.2Z-5F500\n");
}

#[test]
fn a_held_laser_is_not_lit_by_the_toggle_of_the_spindle() {
    // Found by random streams.
    endure(b"\0$32=1\nM30\nM3S500\nM0\n\xF0\x9E\xF0");
}

#[test]
fn a_spindle_that_turns_does_not_become_a_laser_that_burns() {
    // Found by random streams: the machine is locked after the alarm of a probe.
    endure(b"\0\xE3M30\nM3S500\nG38.2Z-5F500\n$32=1\n\xF0");
}

#[test]
fn a_door_that_opens_while_a_probe_moves_finds_the_laser_dark() {
    // Found by random streams.
    endure(b"\x2DM4S1000\nG91G1Z-2F1000\n\xF5\xF7G38.2Z-5F500\n\xF6\xF7\xF7\xF6\xE7");
}
