//! `$10` adds the line of the running move and the remaining time to status reports. Without it,
//! reports are Grbl's.

use crate::bench::{Memory, Session};
use leadscrew_machine::config::MachineConfig;

/// The text after `|key:` in a report.
fn field<'a>(report: &'a str, key: &str) -> Option<&'a str> {
    let fields = report.trim_matches(['<', '>']).split('|');
    fields
        .filter_map(|field| field.split_once(':'))
        .find_map(|(name, value)| (name == key).then_some(value))
}

fn number(report: &str, key: &str) -> f64 {
    let value = field(report, key).unwrap_or_else(|| panic!("no {key} in {report}"));
    value.parse().unwrap()
}

/// Grbl's queue and start, with our own bits of `$10`.
fn with_own_bits() -> MachineConfig<3> {
    MachineConfig {
        report_bits: MachineConfig::<3>::new().report_bits,
        ..MachineConfig::grbl()
    }
}

fn assert_reports_as_grbl(config: MachineConfig<3>, mask: &str) {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, config);
    session.line(mask);
    session.send("G1X10F500\nN7X20\n");
    session.wait_ms(500);
    let report = session.status();
    assert!(report.starts_with("<Run|MPos:"), "{report}");
    assert_eq!((field(&report, "Ln"), field(&report, "Fin")), (None, None));
}

#[test]
fn reports_have_neither_line_nor_time_unless_asked() {
    assert_reports_as_grbl(with_own_bits(), "$10=3");
}

#[test]
fn a_machine_as_grbl_s_keeps_bits_of_10_that_grbl_does_not_know_and_ignores_them() {
    assert_reports_as_grbl(MachineConfig::grbl(), "$10=255");
}

#[test]
fn a_line_is_counted_from_the_program_s_begin_or_has_its_n_word() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, with_own_bits());
    session.line("$10=5");
    session.send("G21 (millimetres)\n\nG1X2F500\n$G\nX4\nN700X6\nX8\n");
    let mut lines = Vec::new();
    while session.pins.position[0] < 1990 {
        session.wait_ms(50);
        if let Some(line) = field(&session.status(), "Ln") {
            lines.push(line.to_owned());
        }
    }
    lines.dedup();
    // `$G` waits for rest and is no line of the program.
    assert_eq!(lines, ["3", "4", "700", "6"]);
    session.until_quiet();
    assert_eq!(field(&session.status(), "Ln"), None, "nothing is under way");
    session.send("M30\nG1X0\n");
    session.wait_ms(100);
    assert_eq!(number(&session.status(), "Ln"), 1.0);
    session.send("\x18");
    session.wait_ms(10);
    session.send("$X\nG1X5F400\n");
    session.wait_ms(100);
    assert_eq!(number(&session.status(), "Ln"), 1.0);
}

#[test]
fn the_time_to_finish_is_what_finishing_takes() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, with_own_bits());
    session.line("$10=9");
    assert_eq!(number(&session.status(), "Fin"), 0.0);
    session.line("$120=50");
    session.send("G1X10F500\nX20F300\nY3\nG0X0Y0\n");
    let mut told = Vec::new();
    for _ in 0..8 {
        session.wait_ms(700);
        let report = session.status();
        told.push((session.now_us() as f64 / 1e6, number(&report, "Fin")));
    }
    // Not quite the end: `until_quiet` waits for the last step, no longer.
    session.until_quiet();
    let end = session.now_us() as f64 / 1e6;
    for (at, left) in told {
        assert!(
            (at + left - end).abs() < 0.1,
            "{left} s told {} s before",
            end - at
        );
    }
}

#[test]
fn a_report_of_a_full_queue_comes_within_a_few_milliseconds() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, with_own_bits());
    session.line("$10=9");
    let job: String = (1..20).map(|k| format!("G1X{k}F500\n")).collect();
    session.send(job);
    session.wait_ms(300);
    session.lines();
    session.send("?");
    session.wait_ms(5);
    let report = session
        .lines()
        .into_iter()
        .find(|line| line.starts_with('<'));
    let left = number(&report.unwrap(), "Fin");
    assert!(left > 1.0, "{left}");
}

/// As in Grbl: the speed in a report is that of the present power, and `A:` is there while there is
/// power.
#[test]
fn a_laser_s_speed_in_a_report_is_that_of_its_power_now() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    for line in ["$32=1", "$110=3000", "$120=100", "F600"] {
        assert_eq!(session.line(line), ["ok"]);
    }
    let mut speed = |line: &str, moving: bool| {
        session.send(line);
        session.send("\n");
        session.wait_ms(if moving { 300 } else { 20 });
        session.lines();
        let report = session.status();
        assert_eq!(report.starts_with("<Run|"), moving, "{line}: {report}");
        session.until_quiet();
        let field = report
            .split('|')
            .find_map(|field| field.strip_prefix("FS:"));
        let speed = field
            .unwrap()
            .trim_end_matches('>')
            .split_once(',')
            .unwrap()
            .1;
        speed.parse::<u32>().unwrap()
    };
    assert_eq!(speed("M3S500", false), 0, "G0 is dark");
    assert_eq!(speed("G1", false), 500, "on at rest");
    assert_eq!(speed("G1X8", true), 500);
    assert_eq!(speed("G0X0", true), 0);
    assert_eq!(speed("M4", false), 0);
    assert_eq!(speed("G1", false), 0, "dark at rest under M4");
    assert_eq!(speed("G1X8", true), 500, "at the feed");
    let slow = speed("G1X0F6000", true);
    assert!((50..250).contains(&slow), "far from the feed: {slow}");
    assert_eq!(speed("M5", false), 0);
}

#[test]
fn the_last_end_of_the_program_is_a_row_of_its_own() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::new());
    let rows = session.line("$I");
    assert_eq!(rows.len(), 3, "{rows:?}");
    session.pins.last_end = Some("a fault in the program, feed.rs line 7");
    let told = session.line("$I");
    assert_eq!(told[..2], rows[..2]);
    assert_eq!(
        told[2..],
        ["[LAST END:a fault in the program, feed.rs line 7]", "ok"]
    );
}
