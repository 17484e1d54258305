//! Switch rules that Grbl has not, and that a build may ask for.

use crate::bench::{Memory, Session};
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::rules::SwitchRules;
use leadscrew_planner::Cartesian;
use leadscrew_stepper::MotorMask;

const RULES: SwitchRules = SwitchRules {
    named: true,
    back_off_mm: 1.0,
    reported: true,
    drops_drivers: true,
    without_switch: 0,
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
