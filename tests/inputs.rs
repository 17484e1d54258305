//! Inputs that stay closed. The reset input locks the machine as long as it is held. A closed limit
//! switch lets the machine jog away from it.

use leadscrew_planner::Cartesian;
use leadscrew_sim::plant::{Pin, Side, Switch};
use leadscrew_sim::Memory;
use leadscrew_stepper::Power;
use leadscrew_tests::{setup, Session};

type Desk<'a> = Session<'a, Cartesian, 3>;

const HELD: &str = "[MSG:Reset input is active, release it to unlock]";
const LOCKED: &str = "[MSG:'$H'|'$X' to unlock]";
const UNLOCKED: &str = "[MSG:Caution: Unlocked]";
const LIMITS: &str = "[MSG:Check Limits]";
const BANNER: &str = "Grbl 1.1h ['$' for help]";

fn with_machine(settings: &str, test: impl FnOnce(&mut Desk<'_>)) {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream("$110=6000\n$111=6000\n$120=500\n$121=500\n$707=0\n");
    session.stream(settings);
    test(&mut session);
    session.finish();
}

fn position(session: &Desk<'_>) -> [f64; 3] {
    session
        .sim
        .machine()
        .position()
        .map(|axis| axis.to_mm().into())
}

/// The state, as a report spells it.
fn state(session: &mut Desk<'_>) -> String {
    let report = session.say("?").pop().unwrap();
    let end = report.find('|').unwrap();
    report[1..end].to_owned()
}

#[test]
fn the_reset_input_puts_out_a_laser_at_rest_in_the_interrupt() {
    with_machine("$32=1\nM3S800G1X1F600\n", |session| {
        assert!(session.sim.board().power() > Power::OFF);
        // No time passes, so the main loop does not run.
        session.sim.set_pin(Pin::Reset, false);
        assert_eq!(session.sim.board().power(), Power::OFF);
        session.until_quiet();
        assert_eq!(session.sim.board().power(), Power::OFF);
    });
}

#[test]
fn a_limit_puts_out_a_laser_at_rest_in_the_interrupt() {
    with_machine("$32=1\n$21=1\nM3S800G1X1F600\n", |session| {
        assert!(session.sim.board().power() > Power::OFF);
        session.sim.set_pin(Pin::Limit(1), false);
        assert_eq!(session.sim.board().power(), Power::OFF);
        session.until_quiet();
    });
}

#[test]
fn while_the_reset_input_is_held_nothing_unlocks_and_nothing_moves() {
    with_machine("$22=1\n", |session| {
        session.sim.set_pin(Pin::Reset, false);
        assert_eq!(session.say(""), [BANNER, HELD, LOCKED]);
        for (line, answer) in [
            ("$X\n", vec![HELD, "error:9"]),
            ("$H\n", vec![HELD, "error:9"]),
            ("G0X1\n", vec!["error:9"]),
            ("$J=X1F600\n", vec!["error:8"]),
            ("$C\n", vec!["error:8"]),
            ("\x18", vec![BANNER, HELD, LOCKED]),
            ("$X\n", vec![HELD, "error:9"]),
        ] {
            assert_eq!(session.say(line), answer, "{line}");
            assert_eq!(state(session), "Alarm", "{line}");
        }
        assert_eq!(position(session), [0.0; 3]);
    });
}

#[test]
fn a_reset_input_that_is_released_leaves_the_machine_locked_until_it_is_told() {
    with_machine("", |session| {
        session.sim.set_pin(Pin::Reset, false);
        session.until_quiet();
        session.sim.set_pin(Pin::Reset, true);
        session.until_quiet();
        session.heard(0);
        assert_eq!(state(session), "Alarm");
        assert_eq!(session.say("G0X1\n"), ["error:9"]);
        assert_eq!(session.say("$X\n"), [UNLOCKED, "ok"]);
        assert_eq!(session.say("G0X1\n"), ["ok"]);
        assert_eq!(position(session), [1.0, 0.0, 0.0]);
    });
}

#[test]
fn the_reset_input_in_motion_stops_and_locks() {
    with_machine("", |session| {
        session.send(0, "G1X20F600\n");
        session.wait_us(500_000);
        session.heard(0);
        session.sim.set_pin(Pin::Reset, false);
        let stopped = position(session);
        assert_eq!(session.say(""), ["ALARM:3", BANNER, HELD, LOCKED]);
        assert_eq!(position(session), stopped);
        session.sim.set_pin(Pin::Reset, true);
        assert_eq!(session.say("$X\n"), [UNLOCKED, "ok"]);
        assert_eq!(session.say("G0X0\n"), ["ok"]);
    });
}

#[test]
fn a_machine_can_be_stopped_and_unlocked_again_and_again() {
    with_machine("$32=1\n", |session| {
        for target in 1..20 {
            session.sim.set_pin(Pin::Reset, false);
            session.wait_us(target * 37);
            session.sim.set_pin(Pin::Reset, true);
            session.until_quiet();
            session.heard(0);
            assert_eq!(session.say("$X\n"), [UNLOCKED, "ok"]);
            assert_eq!(session.say(&format!("M3S500G1X{target}F600\n")), ["ok"]);
            assert!(session.sim.board().power() > Power::OFF);
        }
    });
}

/// Runs into a limit switch at X2 in the positive direction, resets and unlocks.
fn run_into_x2(session: &mut Desk<'_>, line: &str) {
    session.sim.add_switch(Switch {
        pin: Pin::Limit(0),
        motor: 0,
        side: Side::AtOrAbove,
        place: 500,
        level: false,
    });
    session.send(0, line);
    session.until_quiet();
    assert!(session.heard(0).contains(&"ALARM:1".to_owned()));
    let greeting = session.say("\x18");
    assert_eq!(greeting, [BANNER, LIMITS, LOCKED]);
    assert_eq!(session.say("$X\n"), [UNLOCKED, "ok"]);
    assert_eq!(position(session)[0], 2.0);
}

#[test]
fn in_a_limit_switch_programs_are_refused_and_jogs_lead_away_only() {
    for line in ["G1X5F600\n", "G1X5F2\n", "G1X5Y-3F3000\n", "$J=X5F6000\n"] {
        with_machine("$21=1\n", |session| {
            run_into_x2(session, line);
            let y = position(session)[1];
            assert_eq!(session.say("G0X0\n"), [LIMITS, "error:9"]);
            assert_eq!(session.say("M3\n"), [LIMITS, "error:9"]);
            assert_eq!(session.say("$J=G91X.1F6000\n"), [LIMITS, "error:15"]);
            assert_eq!(session.say("$J=G91Y1X.1F6000\n"), [LIMITS, "error:15"]);
            assert_eq!(position(session), [2.0, y, 0.0]);
            assert_eq!(session.say("$J=G91Y1F6000\n"), ["ok"], "another axis");
            assert_eq!(session.say("$J=G91X-1F6000\n"), ["ok"]);
            let [x, after, _] = position(session);
            assert!(x == 1.0 && (after - y - 1.0).abs() < 1e-5, "{x} {after}");
            assert_eq!(session.say("G0X0\n"), ["ok"]);
            assert_eq!(position(session)[0], 0.0);
        });
    }
}

/// Tenths of a second until the machine rests again after a line.
fn tenths(session: &mut Desk<'_>, line: &str) -> u32 {
    session.send(0, line);
    let mut tenths = 0;
    while tenths == 0 || !session.sim.machine().is_quiet() {
        session.wait_us(100_000);
        tenths += 1;
    }
    assert_eq!(session.heard(0), ["ok"], "{line}");
    tenths
}

#[test]
fn in_a_switch_that_closed_at_rest_jogs_are_slow_either_way() {
    with_machine("$25=120\n", |session| {
        session.sim.set_pin(Pin::Limit(0), false);
        session.stream("$21=1\n");
        assert_eq!(session.say("G0X1\n"), [LIMITS, "error:9"]);
        for way in ["X2", "X-2", "X2Y1"] {
            let slow = tenths(session, &format!("$J=G91{way}F6000\n"));
            assert!((10..15).contains(&slow), "{way}: {slow}");
        }
        let fast = tenths(session, "$J=G91Y2F6000\n");
        assert!(fast < 4, "another axis: {fast}");
        let slower = tenths(session, "$J=G91X1F30\n");
        assert!(slower >= 20, "slower than $25: {slower}");
    });
}

#[test]
fn a_switch_that_has_opened_and_closed_at_rest_is_on_no_known_side() {
    with_machine("$21=1\n$25=120\n", |session| {
        run_into_x2(session, "G1X5F600\n");
        // The carriage is pushed to the other end by hand.
        session.sim.remove_switches();
        session.sim.set_pin(Pin::Limit(0), true);
        session.until_quiet();
        session.sim.set_pin(Pin::Limit(0), false);
        session.until_quiet();
        session.say("\x18");
        session.say("$X\n");
        let slow = tenths(session, "$J=G91X2F6000\n");
        assert!(slow >= 10, "{slow}");
    });
}

#[test]
fn homing_works_out_of_a_limit_switch() {
    let setup = setup::<3>(1);
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream("$110=6000\n$120=500\n$21=1\n$22=1\n$25=1200\n$26=2\n");
    run_into_x2(&mut session, "G1X5F600\n");
    for motor in [1, 2] {
        session.sim.add_switch(Switch {
            pin: Pin::Limit(motor),
            motor,
            side: Side::AtOrAbove,
            place: 500,
            level: false,
        });
    }
    assert_eq!(session.say("$H\n"), ["ok"]);
    assert_eq!(session.say("G0X-3\n"), ["ok"]);
    assert_eq!(position(&session), [-3.0, -1.0, -1.0]);
}
