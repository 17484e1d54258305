//! F if an axis turns, by NIST RS274/NGC 2.1.2.5: degrees a minute if only such axes move,
//! and otherwise the speed of the lengths.

use crate::bench::{Memory, Session};
use leadscrew_machine::config::{AxisKind, MachineConfig};
use leadscrew_planner::Cartesian;
use leadscrew_stepper::Power;

type Desk<'m> = Session<'m, Cartesian>;

/// Y turns: 10 steps a degree. Accelerations are so high that ramps take a few ms.
fn boot(memory: &mut Memory) -> Desk<'_> {
    let mut config = MachineConfig::grbl();
    config.axes[1] = AxisKind::Rotary;
    let mut session = Session::boot(memory, config);
    for line in [
        "$100=100",
        "$101=10",
        "$102=100",
        "$110=6000",
        "$111=60000",
        "$112=6000",
        "$120=5000",
        "$121=50000",
        "$122=5000",
    ] {
        assert_eq!(session.line(line), ["ok"]);
    }
    session
}

/// The seconds from the first step of these lines to their end.
fn seconds(session: &mut Desk, lines: &str) -> f64 {
    let before = session.pins.pulses;
    session.send(format!("{lines}\n"));
    session.until(|session| session.pins.pulses != before);
    let begin = session.now_us();
    session.until_quiet();
    for line in session.lines() {
        assert!(!line.starts_with("error"), "{lines}: {line}");
    }
    (session.now_us() - begin) as f64 / 1e6
}

#[test]
fn f_counts_degrees_where_only_rotary_axes_move_and_lengths_otherwise() {
    for (lines, wanted) in [
        ("G20G1Y36F600", 3.6),
        ("G21G1Y36F600", 3.6),
        ("G20F600\nG1Y36", 3.6),
        ("G91G1Y-36F600", 3.6),
        ("G1X0Y36Z0F600", 3.6),
        ("G21G1X10Y36F600", 1.0),
        ("G1X10Y360F600", 1.0),
        ("G1X6Z8Y36F600", 1.0),
        ("G20G1X1Y36F60", 1.0),
        ("G20G1X1F60", 1.0),
        ("$J=G91Y36F600", 3.6),
        ("$J=G91G20Y36F600", 3.6),
        ("$J=G91X10Y36F600", 1.0),
        ("G38.3Y36F600", 3.6),
        ("G20G38.3Y36F600", 3.6),
        ("G38.3X10Y36F600", 1.0),
        ("G93G1Y36F60", 1.0),
        ("G20G93G1Y36F60", 1.0),
        ("G93G1X10Y36F60", 1.0),
        // A half circle of 15.708 mm, and Y turns along.
        ("G18G2X10Z0I5K0F600", 1.571),
        ("G18G2X10Z0I5K0Y90F600", 1.571),
        ("G18G93G2X10Z0I5K0Y90F60", 1.0),
    ] {
        let mut memory = Memory::new();
        let found = seconds(&mut boot(&mut memory), lines);
        assert!((found - wanted).abs() < 0.03 * wanted, "{lines}: {found} s");
    }
}

#[test]
fn an_axis_that_is_not_declared_rotary_counts_as_a_length() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    for line in ["$110=30000", "$111=30000", "$120=5000", "$121=5000"] {
        session.line(line);
    }
    let found = seconds(&mut session, "G1X3Y4F300");
    assert!((found - 1.0).abs() < 0.03, "{found} s");
    let found = seconds(&mut session, "G20G91G1Y1F60");
    assert!((found - 1.0).abs() < 0.03, "{found} s");
}

#[test]
fn reports_show_the_speed_in_the_unit_of_f() {
    for inches in [0, 1] {
        for (line, shown) in [
            ("G1Y36F600", 600.0),
            ("G1X10Y36F600", [600.0, 600.0 / 25.4][inches]),
            ("$J=G91G20Y36F600", 600.0),
        ] {
            let mut memory = Memory::new();
            let mut session = boot(&mut memory);
            session.line(&format!("$13={inches}"));
            session.send(format!("{line}\n"));
            session.wait_ms(500);
            let report = session.status();
            let feed = report
                .split("|FS:")
                .nth(1)
                .unwrap()
                .split(',')
                .next()
                .unwrap();
            let feed: f64 = feed.parse().unwrap();
            assert!((feed - shown).abs() <= 1.0, "{line}: {report}");
        }
    }
}

#[test]
fn a_laser_under_m4_has_its_power_at_the_programmed_speed() {
    let at_speed = |line: &str| {
        let mut memory = Memory::new();
        let mut session = boot(&mut memory);
        session.line("$32=1");
        session.send(format!("M4S500\n{line}\n"));
        session.until(|session| session.pins.power != Power::OFF);
        session.wait_ms(500);
        session.pins.power
    };
    let alone = at_speed("G1X10F600");
    for line in ["G1X10Y36F600", "G1Y36F600", "G20G1Y36F600"] {
        assert_eq!(at_speed(line), alone, "{line}");
    }
}

#[test]
fn a_rotary_axis_has_settings_in_degrees() {
    let mut memory = Memory::new();
    let settings = boot(&mut memory).line("$ES");
    for (number, unit) in [
        (100, "step/mm"),
        (101, "step/deg"),
        (111, "deg/min"),
        (112, "mm/min"),
        (121, "deg/s2"),
        (131, "deg"),
    ] {
        let row = settings
            .iter()
            .find(|row| row.starts_with(&format!("[SETTING:{number}|")));
        let row = row.unwrap();
        assert!(row.contains(&format!("|{unit}|")), "{row}");
    }
}
