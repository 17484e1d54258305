//! The wishes of owners beyond Grbl: zero at a place of their choice, spindles that take time, arcs
//! as CAM programs round them, jogs that end at the travel. Each is off on a machine that answers
//! as Grbl.

use crate::bench::{Contact, Memory, Session};
use leadscrew_machine::config::MachineConfig;

/// Steps in a millimetre.
const MM: i32 = 250;

const HOMING: [&str; 11] = [
    "$22=1",
    "$24=300",
    "$25=1200",
    "$26=2",
    "$27=1",
    "$110=1200",
    "$111=1200",
    "$112=1200",
    "$120=200",
    "$121=200",
    "$122=200",
];

/// A machine as Grbl with these settings.
fn grbl<'a>(memory: &'a mut Memory, settings: &[&str]) -> Session<'a> {
    let mut session = Session::boot(memory, MachineConfig::grbl());
    for line in settings {
        assert_eq!(session.line(line), ["ok"], "{line}");
    }
    session
}

/// The machine position of a report.
fn place(session: &mut Session<'_>) -> String {
    let status = session.status();
    let (_, rest) = status.split_once("MPos:").unwrap();
    rest.split('|').next().unwrap().to_owned()
}

#[test]
fn zero_is_where_the_owner_wants_it_after_homing() {
    let own = [
        "$719=5", "$740=-3", "$742=12", "$750=2", "$130=100", "$132=50",
    ];
    let settings: Vec<&str> = HOMING.iter().chain(&own).copied().collect();
    let mut memory = Memory::new();
    let mut session = grbl(&mut memory, &settings);
    session.contact = Some(Contact::Limits([3 * MM, 2 * MM, MM]));
    assert_eq!(session.line("$H"), ["ok"]);
    // X and Z have their switches at -3 and 12, Y at 0; X goes 2 mm off its switch, the others 1.
    assert_eq!(place(&mut session), "-5.000,-1.000,11.000");
    let at = session.pins.position;
    for (is, should) in at.iter().zip([MM, MM, 0]) {
        assert!(is.abs_diff(should) <= 1, "{at:?}");
    }
    // The travel ends where the owner's zero says.
    assert_eq!(session.line("$20=1"), ["ok"]);
    assert_eq!(session.line("$J=G53X-3Z12F1000"), ["ok"]);
    assert_eq!(session.line("$J=G53X-2.9F1000"), ["error:15"]);
    assert_eq!(session.line("$J=G53Z12.1F1000"), ["error:15"]);
    assert_eq!(session.line("$J=G53X-103.1F1000"), ["error:15"]);
    assert_eq!(session.line("$J=G53Z-38.1F1000"), ["error:15"]);
    session.until_quiet();
    assert_eq!(session.line("G53G0X-103Z-38"), ["ok"]);
    session.until_quiet();
    assert_eq!(place(&mut session), "-103.000,-1.000,-38.000");
}

#[test]
fn an_axis_that_homes_low_has_positive_space_where_its_place_is_zero() {
    let own = ["$23=1", "$719=1", "$740=0", "$130=100", "$20=1"];
    let settings: Vec<&str> = HOMING.iter().chain(&own).copied().collect();
    let mut memory = Memory::new();
    let mut session = grbl(&mut memory, &settings);
    for (target, answer) in [
        ("0", "ok"),
        ("100", "ok"),
        ("100.1", "error:15"),
        ("-0.1", "error:15"),
    ] {
        let line = format!("$J=G53X{target}F1000");
        assert_eq!(session.line(&line), [answer], "{line}");
        session.send([0x85]);
        session.until_quiet();
    }
}

/// Milliseconds that homing of X alone takes.
fn homing_time(settings: &[&str]) -> u64 {
    let settings: Vec<&str> = HOMING.iter().chain(settings).copied().collect();
    let mut memory = Memory::new();
    let mut session = grbl(&mut memory, &settings);
    session.contact = Some(Contact::Limits([4 * MM, 4 * MM, 4 * MM]));
    let begin = session.now_us();
    assert_eq!(session.line("$H"), ["ok"], "{settings:?}");
    let at = session.pins.position;
    for is in at {
        assert!(is.abs_diff(3 * MM) <= 1, "{at:?}");
    }
    (session.now_us() - begin) / 1_000
}

#[test]
fn each_axis_homes_at_its_own_speeds_and_grbl_s_without() {
    let grbl = homing_time(&[]);
    assert_eq!(
        grbl,
        homing_time(&[
            "$760=1200",
            "$761=1200",
            "$762=1200",
            "$770=300",
            "$771=300",
            "$772=300"
        ])
    );
    // 4 mm at 120 mm/min take 2 s, at 1200 mm/min 0.2 s; the way off and back is slower as well.
    let slow = homing_time(&["$762=120"]);
    assert!((1_700..6_000).contains(&(slow - grbl)), "{slow} {grbl}");
    let located = homing_time(&["$772=30"]);
    assert!(
        (1_500..4_000).contains(&(located - grbl)),
        "{located} {grbl}"
    );
    // X and Y home together: the slower one does not hold up the other, nor hurry with it.
    let one = homing_time(&["$760=300"]);
    assert!((300..3_000).contains(&(one - grbl)), "{one} {grbl}");
}

/// Milliseconds from a line until its `ok`.
fn answer_time(session: &mut Session<'_>, line: &str) -> u64 {
    let begin = session.now_us();
    assert_eq!(session.line(line), ["ok"], "{line}");
    (session.now_us() - begin) / 1_000
}

#[test]
fn the_program_waits_while_the_spindle_speeds_up_and_stops() {
    let mut memory = Memory::new();
    let mut session = grbl(&mut memory, &["$30=10000", "$716=1", "$717=0.5", "$718=2"]);
    for (line, ms) in [
        ("M3S4000", 1_000 + 2_000),
        ("M3", 0),
        ("S6000", 1_000),
        ("S5000", 500),
        ("M4", 2_000 + 1_000 + 2_500),
        ("M5", 2_000),
        ("M5", 0),
        ("M3S1000", 1_500),
    ] {
        let took = answer_time(&mut session, line);
        assert!((ms..ms + 30).contains(&took), "{line}: {took} ms");
    }
    // In check mode, and with a laser, nothing waits.
    session.line("$C");
    assert!(answer_time(&mut session, "M4S9000") < 30);
    session.line("$C");
    session.until_quiet();
    session.line("$32=1");
    assert!(answer_time(&mut session, "M3S9000") < 30);
    assert!(answer_time(&mut session, "M5") < 30);
}

#[test]
fn a_reset_ends_the_wait_for_a_spindle() {
    let mut memory = Memory::new();
    let mut session = grbl(&mut memory, &["$716=60"]);
    session.send("M3S100\n");
    session.wait_ms(500);
    session.lines();
    session.send("\x18");
    session.wait_ms(50);
    session.lines();
    assert_eq!(session.line("M5"), ["ok"]);
}

#[test]
fn as_in_grbl_nothing_waits_for_a_spindle_unless_a_setting_says_so() {
    let mut memory = Memory::new();
    let mut session = grbl(&mut memory, &[]);
    for line in ["M3S1000", "M4", "S500", "M5"] {
        assert!(answer_time(&mut session, line) < 30, "{line}");
    }
}

#[test]
fn arcs_are_taken_as_far_as_settings_say_and_the_difference_is_told() {
    let mut memory = Memory::new();
    let mut session = grbl(&mut memory, &["$700=1", "$110=5000", "$111=5000"]);
    let line = "G2X2Y0I1.02J0F3000";
    assert_eq!(
        session.line(line),
        [
            "[MSG:The target of the motion is invalid: radii of the arc differ by 0.040 mm]",
            "error:33"
        ]
    );
    assert_eq!(
        session.line("G38.2X0F10"),
        ["[MSG:The target of the motion is invalid]", "error:33"]
    );
    for taken in ["$713=0.05", "$714=4"] {
        session.line("$713=0.005");
        session.line(taken);
        assert_eq!(session.line("G0X0Y0"), ["ok"]);
        assert_eq!(session.line(line), ["ok"], "{taken}");
        session.until_quiet();
        assert_eq!(session.pins.position, [2 * MM, 0, 0]);
    }
    session.line("$713=0");
    session.line("$714=0");
    assert_eq!(session.line("G2X4Y0I1.001J0").last().unwrap(), "error:33");
}

#[test]
fn jogs_end_at_the_travel_where_a_setting_says_so() {
    let mut memory = Memory::new();
    let limits = [
        "$22=1",
        "$20=1",
        "$130=10",
        "$131=10",
        "$132=10",
        "$110=3000",
        "$111=3000",
        "$120=500",
        "$121=500",
    ];
    let mut session = grbl(&mut memory, &limits);
    assert_eq!(session.line("$J=G91X-50Y-3F3000"), ["error:15"]);
    assert_eq!(session.line("$715=1"), ["ok"]);
    assert_eq!(session.line("$J=G91X-50Y-3F3000"), ["ok"]);
    session.until_quiet();
    assert_eq!(session.pins.position, [-10 * MM, -3 * MM, 0]);
    // At the end of the travel a jog farther moves nothing, and the next one counts from there.
    assert_eq!(session.line("$J=G91X-5F3000"), ["ok"]);
    assert_eq!(session.line("$J=G91X2F3000"), ["ok"]);
    session.until_quiet();
    assert_eq!(session.pins.position, [-8 * MM, -3 * MM, 0]);
    // A program's target beyond the travel stays an alarm.
    session.send("G0X5\n");
    session.wait_ms(20);
    assert_eq!(session.lines()[0], "ALARM:2");
}
