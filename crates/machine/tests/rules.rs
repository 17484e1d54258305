//! Switch rules that Grbl has not, and that a build may ask for.

use crate::bench::{Contact, Memory, Session};
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::config::SwitchRules;
use leadscrew_planner::Cartesian;
use leadscrew_stepper::MotorMask;

const RULES: SwitchRules = SwitchRules {
    named: true,
    back_off_mm: 1.0,
    reported: true,
    drops_drivers: true,
    without_switch: 0,
    ..SwitchRules::GRBL
};

fn config(rules: SwitchRules) -> MachineConfig<3> {
    MachineConfig {
        rules,
        ..MachineConfig::grbl()
    }
}

/// Closes the limit switch of an axis; levels are active low.
fn close(session: &mut Session<'_, Cartesian>, axis: u8) {
    session.switch(|switches| switches.limits = MotorMask::from_bits(!(1 << axis)));
}

#[test]
fn a_limit_is_named_with_its_end_backs_off_keeps_the_position_and_unlocks() {
    for (way, end, sign, back) in [("-10", "low", "-", 250), ("10", "high", "+", -250)] {
        let mut memory = Memory::new();
        let mut session = Session::boot(&mut memory, config(RULES));
        session.line("$21=1");
        session.send(format!("G1X{way}F500\n"));
        session.wait_ms(500);
        session.lines();
        let at = session.pins.position[0];
        close(&mut session, 0);
        session.wait_ms(5);
        assert_eq!(session.lines(), [format!("[MSG:X {end}]")]);
        let report = session.status();
        assert!(report.contains(&format!("|Sw:X{sign}")), "{report}");
        session.wait_ms(2_000);
        let lines = session.lines();
        assert_eq!(lines, ["ALARM:1"]);
        let gone = session.pins.position[0] - at;
        assert!((gone - back).abs() <= 5, "{gone}");
        session.switch(|switches| switches.limits = MotorMask::from_bits(0xFF));
        assert!(session.line("$X").contains(&"ok".to_owned()));
        session.line("G1X0F500");
        session.until_quiet();
        assert_eq!(session.pins.position, [0; 3], "the position was kept");
        assert!(!session.status().contains("Sw:"));
    }
}

#[test]
fn z_never_backs_off() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, config(RULES));
    session.line("$21=1");
    session.send("G1Z-10F500\n");
    session.wait_ms(500);
    close(&mut session, 2);
    session.wait_ms(5);
    let at = session.pins.position;
    session.wait_ms(2_000);
    assert_eq!(session.pins.position, at);
    let lines = session.lines();
    assert!(lines.contains(&"[MSG:Z low]".to_owned()), "{lines:?}");
    assert!(lines.contains(&"ALARM:1".to_owned()), "{lines:?}");
}

#[test]
fn drivers_go_off_with_a_reset_in_motion_where_that_is_asked_for() {
    for (rules, enabled) in [(RULES, false), (SwitchRules::GRBL, true)] {
        let mut memory = Memory::new();
        let mut session = Session::boot(&mut memory, config(rules));
        session.line("$1=200");
        session.send("G1X10F500\n");
        session.wait_ms(500);
        assert!(session.pins.enabled);
        session.send([0x18]);
        session.wait_ms(5);
        assert_eq!(session.pins.enabled, enabled);
        assert!(session.lines().contains(&"ALARM:3".to_owned()));
        session.line("$X");
        session.send("G1X5F500\n");
        session.wait_ms(500);
        assert!(session.pins.enabled, "motion enables them again");
    }
}

#[test]
fn an_axis_without_a_switch_goes_to_its_zero_while_homing() {
    let rules = SwitchRules {
        without_switch: 0b111,
        ..SwitchRules::GRBL
    };
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, config(rules));
    session.line("G1X4Y-2F500");
    session.until_quiet();
    session.line("$22=1");
    session.lines();
    session.send("$H\n");
    session.until_quiet();
    let lines = session.lines();
    assert_eq!(lines.last().unwrap(), "ok", "{lines:?}");
    assert_eq!(session.pins.position, [0; 3]);
    assert!(session
        .status()
        .starts_with("<Idle|MPos:0.000,0.000,0.000|"));
}

/// The switch of X at its high end, 5 mm from power-up; no other one closes.
const X_HIGH: Contact = Contact::Limits([1250, i32::MAX, i32::MAX]);

#[test]
fn a_program_leaves_a_switch_that_stops_only_motion_towards_it() {
    let rules = SwitchRules {
        towards_high: 0b001,
        ..SwitchRules::GRBL
    };
    for (rules, leaves) in [(rules, true), (SwitchRules::GRBL, false)] {
        let mut memory = Memory::new();
        let mut session = Session::boot(&mut memory, config(rules));
        session.contact = Some(X_HIGH);
        session.line("$21=1");
        session.send("G1X10F500\n");
        session.wait_ms(2_000);
        assert_eq!(session.pins.position, [1250, 0, 0]);
        session.send([0x18]);
        session.wait_ms(10);
        assert!(session.lines().contains(&"ALARM:1".to_owned()));
        session.line("$X");
        let lines = session.line("G91G1X-3F500");
        session.until_quiet();
        assert_eq!(lines.contains(&"ok".to_owned()), leaves, "{lines:?}");
        assert_eq!(lines.contains(&"error:9".to_owned()), !leaves, "{lines:?}");
        assert_eq!(session.pins.position[0] == 500, leaves);
    }
}

#[test]
fn a_switch_that_closes_while_its_axis_leaves_stops_nothing() {
    let rules = SwitchRules {
        towards_low: 0b001,
        named: true,
        ..SwitchRules::GRBL
    };
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, config(rules));
    session.line("$21=1");
    session.send("G1X10F500\n");
    session.wait_ms(500);
    close(&mut session, 0);
    session.until_quiet();
    assert_eq!(session.lines(), ["ok"]);
    assert_eq!(session.pins.position, [2500, 0, 0]);
    session.switch(|switches| switches.limits = MotorMask::from_bits(0xFF));
    session.send("G1X0F500\n");
    session.wait_ms(500);
    close(&mut session, 0);
    let at = session.pins.position;
    session.wait_ms(100);
    assert_eq!(session.pins.position, at, "at its very step");
    let lines = session.lines();
    assert_eq!(lines, ["ok", "[MSG:X low]", "ALARM:1"]);
}

#[test]
fn motion_into_a_closed_switch_ends_at_its_first_steps() {
    let rules = SwitchRules {
        towards_low: 0b010,
        ..SwitchRules::GRBL
    };
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, config(rules));
    session.line("$21=1");
    close(&mut session, 1);
    assert_eq!(session.line("G1X1F500"), ["ok"], "another axis");
    session.until_quiet();
    session.send("G1Y-5F500\n");
    session.wait_ms(500);
    assert!(session.lines().contains(&"ALARM:1".to_owned()));
    assert!(
        (-3..0).contains(&session.pins.position[1]),
        "{:?}",
        session.pins.position
    );
    session.send([0x18]);
    session.wait_ms(10);
    session.line("$X");
    let jog = session.line("$J=G91Y-1F500");
    assert!(jog.contains(&"error:15".to_owned()), "{jog:?}");
    assert!(session.line("$J=G91Y1F500").contains(&"ok".to_owned()));
}

#[test]
fn a_switch_for_homing_alone_stops_nothing_else() {
    let rules = SwitchRules {
        homing_only: 0b111,
        ..SwitchRules::GRBL
    };
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, config(rules));
    session.contact = Some(X_HIGH);
    session.line("$21=1");
    assert_eq!(session.line("G1X10F500"), ["ok"]);
    session.until_quiet();
    assert_eq!(session.line("G1X7F500"), ["ok"]);
    session.until_quiet();
    assert_eq!(session.pins.position, [1750, 0, 0]);
    session.contact = Some(Contact::Limits([2500, 1250, 1250]));
    for setting in ["$22=1", "$25=500", "$120=100", "$121=100", "$122=100"] {
        session.line(setting);
    }
    session.send("$H\n");
    session.until_quiet();
    assert_eq!(session.lines().last().unwrap(), "ok");
}
