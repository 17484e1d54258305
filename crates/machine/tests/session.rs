//! Whole conversations with a machine: bytes in, answers and step pulses out.

use crate::bench::{Contact, Memory, Session};
use leadscrew_machine::board::SpindleOutput;
use leadscrew_machine::config::MachineConfig;
use leadscrew_stepper::Power;

#[test]
fn a_feed_move_is_answered_and_makes_exactly_its_steps() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.line("$110=6000");
    session.line("$120=500");
    assert_eq!(session.line("G1 X10 F600"), ["ok"]);
    assert_eq!(session.pins.pulses, [2500, 0, 0]);
    assert_eq!(session.pins.position, [2500, 0, 0]);
    assert!(session
        .status()
        .starts_with("<Idle|MPos:10.000,0.000,0.000|FS:0,0"));
}

#[test]
fn every_line_gets_one_answer_and_the_path_ends_at_the_exact_step() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    let job = "$120=500\n$121=500\n$110=6000\n$111=6000\nG91\nF3000\nG1X0.1Y0.2\nG1X.1\nX.1Y-.2\n\
               G2X5Y5I5\nG3X-5Y-5J-5\nG90\nG0X1.234Y-3.21\nG4P0.1\nM3S100\nM5\nG17\n\n(c)\nQ1\nG1X0Y0\n";
    session.send(job);
    session.until_quiet();
    let lines = session.lines();
    assert_eq!(lines.len(), job.lines().count(), "{lines:?}");
    let refused: Vec<_> = lines.iter().filter(|line| *line != "ok").collect();
    assert_eq!(refused, ["error:20"]);
    assert_eq!(session.pins.position, [0, 0, 0]);
}

#[test]
fn a_hold_stops_on_the_path_and_a_resume_ends_at_the_target() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.line("$120=100");
    session.send("G1X10Y5F500\n");
    session.wait_ms(600);
    session.send("!");
    session.wait_ms(20);
    assert!(session.status().starts_with("<Hold:1"));
    session.wait_ms(500);
    assert!(session.status().starts_with("<Hold:0"));
    let [x, y, _] = session.pins.position;
    assert!(x > 0 && x < 2500 && (x - 2 * y).abs() <= 1, "{x} {y}");
    session.send("~");
    session.until_quiet();
    assert_eq!(session.pins.position, [2500, 1250, 0]);
}

#[test]
fn a_reset_in_motion_is_an_alarm_and_keeps_the_position() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.send("G1X10F500\nG1X20\n");
    session.wait_ms(500);
    session.lines();
    session.send("\x18?");
    session.wait_ms(5);
    let lines = session.lines();
    assert_eq!(
        lines[..4],
        [
            "ALARM:3",
            "",
            "Grbl 1.1h ['$' for help]",
            "[MSG:'$H'|'$X' to unlock]"
        ]
    );
    assert!(lines[4].starts_with("<Alarm|"), "{lines:?}");
    assert_eq!(session.line("G0X1"), ["error:9"]);
    assert_eq!(session.line("$X"), ["[MSG:Caution: Unlocked]", "ok"]);
    assert_eq!(session.line("G0X1"), ["ok"]);
    assert_eq!(session.pins.position, [250, 0, 0]);
}

#[test]
fn a_jog_is_cancelled_and_the_next_one_starts_from_there() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.line("$120=100");
    assert_eq!(session.line("$J=G91X1F500"), ["ok"]);
    session.send("$J=X50F500\n");
    session.wait_ms(500);
    assert!(session.status().starts_with("<Jog|"));
    session.lines();
    session.send([0x85]);
    session.send("$J=G91X1F500\n");
    session.until_quiet();
    assert_eq!(session.lines(), ["ok"]);
    let stopped = session.pins.position[0] - 250;
    assert!(stopped > 250 && stopped < 5000, "{stopped}");
    assert!(session.status().starts_with("<Idle|"));
}

#[test]
fn a_probe_reports_the_step_of_the_contact() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.line("$112=1000");
    session.line("$122=100");
    session.contact = Some(Contact::Probe(-500));
    let lines = session.line("G38.2Z-10F100");
    assert_eq!(lines, ["[PRB:0.000,0.000,-2.000:1]", "ok"]);
    session.contact = None;
    session.switch(|switches| switches.probe = true);
    let lines = session.line("G38.2Z-5F300");
    assert_eq!(lines, ["ALARM:5", "[PRB:0.000,0.000,-2.000:0]", "ok"]);
}

#[test]
fn a_probe_that_touches_in_a_hold_is_answered_after_the_resume_and_moves_no_further() {
    for then_contact_ms in [5, 300] {
        let mut memory = Memory::new();
        let mut session = Session::boot(&mut memory, MachineConfig::grbl());
        session.line("$112=1000");
        session.line("$122=100");
        session.send("G38.2Z-10F200\n");
        session.wait_ms(300);
        session.send("!");
        session.wait_ms(then_contact_ms);
        session.switch(|switches| switches.probe = false);
        session.wait_ms(300);
        assert!(session.status().starts_with("<Hold:0|"));
        let at = session.pins.position;
        assert_eq!(session.lines(), [""; 0]);
        session.send("~");
        session.wait_ms(100);
        let lines = session.lines();
        assert!(
            lines[0].ends_with(":1]") && lines[1..] == ["ok"],
            "{lines:?}"
        );
        assert_eq!(session.pins.position, at);
        assert!(session.status().starts_with("<Idle|"));
    }
}

#[test]
fn a_fault_behind_a_dollar_is_where_it_stands_in_the_whole_line() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    for (line, column) in [
        ("$J=X1Y-F100", 6),
        ("$N1=G21Q3", 7),
        ("$J=X1", 3),
        ("$99=1", 1),
        ("$0=1", 3),
        ("$20=1", 4),
        ("$11=1.2.3", 7),
        ("$G1", 2),
    ] {
        assert!(session.line(line)[0].starts_with("error:"));
        let fault = session.machine.take_fault().map(|fault| fault.column);
        assert_eq!(fault, Some(column), "{line}");
    }
}

#[test]
fn homing_ends_a_pull_off_away_from_the_switches() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    for line in [
        "$22=1",
        "$24=100",
        "$25=1000",
        "$26=10",
        "$27=1",
        "$110=1000",
        "$111=1000",
        "$112=1000",
        "$120=100",
        "$121=100",
        "$122=100",
        "$130=20",
        "$131=20",
        "$132=20",
    ] {
        assert_eq!(session.line(line), ["ok"]);
    }
    session.contact = Some(Contact::Limits([1000, 1500, 500]));
    assert_eq!(session.line("$H"), ["ok"]);
    assert!(session
        .status()
        .starts_with("<Idle|MPos:-1.000,-1.000,-1.000|"));
    assert_eq!(session.pins.position, [750, 1250, 250]);
}

#[test]
fn homing_without_a_switch_is_alarm_9() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    for line in ["$22=1", "$25=5000", "$112=5000", "$122=500", "$132=5"] {
        assert_eq!(session.line(line), ["ok"]);
    }
    let lines = session.line("$H");
    assert_eq!(
        lines,
        [
            "ALARM:9",
            "ok",
            "",
            "Grbl 1.1h ['$' for help]",
            "[MSG:'$H'|'$X' to unlock]"
        ]
    );
}

#[test]
fn a_limit_switch_stops_at_once_and_only_a_reset_helps() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.line("$21=1");
    session.line("G1X10F500");
    session.send("G1X0F500\n");
    session.wait_ms(500);
    session.lines();
    session.switch(|switches| switches.limits = leadscrew_stepper::MotorMask::from_bits(0xFE));
    let at = session.pins.position;
    session.wait_ms(50);
    assert_eq!(session.pins.position, at);
    assert_eq!(session.lines(), ["ALARM:1", "[MSG:Reset to continue]"]);
    session.send("$X\n");
    session.wait_ms(50);
    assert_eq!(session.lines(), [""; 0]);
    session.send("\x18");
    session.wait_ms(50);
    let lines = session.lines();
    assert_eq!(
        lines[2..],
        ["[MSG:Check Limits]", "[MSG:'$H'|'$X' to unlock]"]
    );
}

#[test]
fn the_spindle_waits_for_motion_to_end_and_a_door_switches_it_off_and_on() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.line("$120=100");
    session.line("M3S1000");
    assert_eq!(session.pins.spindle, SpindleOutput::Clockwise);
    assert_eq!(session.pins.power, Power::FULL);
    session.send("G1X10F500\n");
    session.wait_ms(800);
    session.send([0x84]);
    session.wait_ms(600);
    assert!(session.lines().contains(&"[MSG:Check Door]".to_owned()));
    assert!(session.status().starts_with("<Door:0|"));
    assert_eq!(session.pins.power, Power::OFF);
    session.send("~");
    session.wait_ms(3000);
    assert!(session.status().starts_with("<Door:3|"));
    assert_eq!(session.pins.power, Power::FULL);
    session.until_quiet();
    assert_eq!(session.pins.position, [2500, 0, 0]);
}

#[test]
fn a_list_goes_out_whole_however_slowly_it_is_read_and_reports_stand_between_its_rows() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.pins.reading = false;
    session.send("$$\n$$\n$#\n?");
    session.wait_ms(20);
    session.pins.reading = true;
    session.until_quiet();
    let lines = session.lines();
    assert_eq!(lines.iter().filter(|line| *line == "ok").count(), 3);
    assert_eq!(
        lines.iter().filter(|line| line.starts_with('$')).count(),
        68
    );
    assert_eq!(lines.iter().filter(|line| line.starts_with('<')).count(), 1);
    assert_eq!(session.machine.lost_output(), 0);
}

#[test]
fn motors_are_enabled_for_motion_and_let_go_after_the_set_delay() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.line("$1=100");
    assert!(!session.pins.enabled);
    session.line("G0X0.1");
    assert!(session.pins.enabled);
    session.wait_ms(90);
    assert!(session.pins.enabled);
    session.wait_ms(20);
    assert!(!session.pins.enabled);
}

/// The events that a job of two lines and a corner may meet at any moment.
const INTERRUPTIONS: [u8; 4] = [b'!', 0x84, 0x85, 0x18];

#[test]
fn after_an_interruption_at_any_moment_nothing_moves_and_the_position_is_the_plants() {
    for byte in INTERRUPTIONS {
        for after_us in (0..400_000).step_by(7_919) {
            let mut memory = Memory::new();
            let mut session = Session::boot(&mut memory, MachineConfig::grbl());
            session.line("$120=500\n$121=500\n$110=3000\n$111=3000");
            let jog = byte == 0x85;
            session.send(if jog {
                "$J=G91X2Y1F2000\n$J=G91Y2F2000\n"
            } else {
                "G1X2Y1F2000\nY3\n"
            });
            let start = session.now_us();
            session.until(|session| session.now_us() >= start + after_us);
            session.send([byte]);
            session.wait_ms(120);
            let at = session.pins.position;
            session.wait_ms(300);
            assert_eq!(session.pins.position, at, "{byte:#x} after {after_us} us");
            assert_eq!(session.pins.position, session.shared.position());
            let [x, y, _] = at;
            let on_path = y <= 250 && (x - 2 * y).abs() <= 2 || x == 500;
            assert!(on_path, "{at:?}: {byte:#x} after {after_us} us");
            go_on(&mut session, byte, at);
        }
    }
}

/// The right way out of an interruption, and its result.
fn go_on(session: &mut Session<'_>, byte: u8, at: [i32; 3]) {
    session.send("~");
    session.until_quiet();
    let lines = session.lines();
    match byte {
        b'!' | 0x84 => assert_eq!(session.pins.position, [500, 750, 0]),
        0x18 => {
            assert_eq!(session.pins.position, at);
            let moving = lines.contains(&"ALARM:3".to_owned());
            assert_eq!(moving, session.line("G4P0") == ["error:9"]);
        }
        _ => assert_eq!(session.pins.position, at),
    }
    session.line("$X");
    session.line("G90G1X0Y0F2000");
    assert_eq!(session.pins.position, [0, 0, 0]);
}

#[test]
fn with_soft_limits_a_target_beyond_reach_is_alarm_2_and_a_jog_there_error_15() {
    for travel in ["$130=200", "$130=9000000000"] {
        let mut memory = Memory::new();
        let mut session = Session::boot(&mut memory, MachineConfig::grbl());
        for line in ["$22=1", "$20=1", travel] {
            assert_eq!(session.line(line), ["ok"]);
        }
        assert_eq!(session.line("$J=X-99999999999F100"), ["error:15"]);
        session.send("G0X-99999999999\n");
        session.wait_ms(5);
        assert_eq!(session.lines()[0], "ALARM:2");
        session.send("\x18");
        session.until_quiet();
        assert_eq!(session.pins.position, [0; 3]);
        assert_eq!(session.lines()[0], "ok");
    }
}

#[test]
fn the_board_filters_its_switches_as_long_as_706_says() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    assert_eq!(session.pins.port.filter_us, 200);
    assert_eq!(session.line("$706=50"), ["ok"]);
    assert_eq!(session.pins.port.filter_us, 50);
    assert_ne!(session.line("$706=10001"), ["ok"]);
    assert_eq!(session.pins.port.filter_us, 50);
}

/// A motion that has hardly begun is soon at rest, and so is a machine whose door opens. Over USB,
/// or in a simulation that falls behind, a sender reads of it and answers within the time that
/// tells a burst.
#[test]
fn a_resume_behind_a_report_of_the_rest_goes_on_however_soon_it_comes() {
    for (stop, rest) in [(b'!', "<Hold:0|"), (0x84, "<Door:0|")] {
        for turns in 0..100 {
            let mut memory = Memory::new();
            let mut session = Session::boot(&mut memory, MachineConfig::grbl());
            session.send("G1X10F600\n");
            (0..turns).for_each(|_| session.turn());
            session.send([stop]);
            while !session.next_report().starts_with(rest) {}
            session.send("~");
            session.wait_ms(100);
            let status = session.status();
            assert!(
                status.starts_with("<Run|"),
                "{rest} {turns} turns: {status}"
            );
        }
    }
}

/// A burst of overrides fills the queue of realtime commands before the main loop looks at it.
#[test]
fn a_hold_behind_a_hundred_overrides_holds_and_a_resume_behind_it_goes_on() {
    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    session.send("G1X10F600\n");
    session.wait_ms(300);
    session.send([&[0x91; 100][..], b"!"].concat());
    session.wait_ms(500);
    assert!(session.status().starts_with("<Hold:0|"));
    session.send([&[0x92; 100][..], b"~"].concat());
    session.wait_ms(100);
    assert!(session.status().starts_with("<Run|"));
    session.send([&[0x91; 100][..], b"\x84"].concat());
    session.wait_ms(500);
    assert!(session.status().starts_with("<Door:"));
}
