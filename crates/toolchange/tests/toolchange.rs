//! Tests of M6 and the tool table, from the sender's view.

#[path = "../../machine/tests/bench/mod.rs"]
mod bench;

use bench::{Contact, Memory, Session};
use leadscrew_machine::board::SpindleOutput;
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::extension::Shown;
use leadscrew_planner::Cartesian;
use leadscrew_stepper::Power;
use leadscrew_toolchange::{ToolChange, ToolChangeConfig};

type Desk<'m> = Session<'m, Cartesian, ToolChange<3, 1024>>;

fn boot_as(memory: &mut Memory, shown: Shown) -> Desk<'_> {
    let mut config = MachineConfig::grbl();
    config.dialect.tools = true;
    let extension = ToolChange::new(ToolChangeConfig {
        shown,
        ..ToolChangeConfig::DEFAULT
    });
    Session::extended(memory, config, Cartesian, extension)
}

fn boot(memory: &mut Memory) -> Desk<'_> {
    boot_as(memory, Shown::Hold)
}

/// Steps of a length in mm: 250 steps/mm.
const fn mm(x: i32) -> i32 {
    x * 250
}

fn until_asked(session: &mut Desk<'_>) {
    session.until(|session| session.pins.spindle == SpindleOutput::Off);
    session.wait_ms(500);
}

#[test]
fn m6_ends_motion_stops_spindle_and_coolant_names_the_tool_and_has_no_ok_yet() {
    for (shown, state) in [(Shown::Hold, "<Hold:0|"), (Shown::Tool, "<Tool|")] {
        let mut memory = Memory::new();
        let mut session = boot_as(&mut memory, shown);
        session.send("M3S1000\nM8\nG1X2F600\nT3 M6 (0.8 mm drill)\n");
        session.until(|session| session.pins.position[0] == mm(1));
        assert!(session.pins.coolant.flood);
        session.wait_ms(3_000);
        assert_eq!(session.pins.position, [mm(2), 0, 0]);
        assert_eq!(session.pins.spindle, SpindleOutput::Off);
        assert_eq!(session.pins.power, Power::OFF);
        assert!(!session.pins.coolant.flood);
        assert_eq!(
            session.lines(),
            ["ok", "ok", "ok", "[MSG:Tool 3: 0.8 mm drill, then ~]"]
        );
        assert!(session.status().starts_with(state));
        session.send("~");
        session.until_quiet();
        assert_eq!(session.lines(), ["ok"]);
        assert_eq!(session.pins.spindle, SpindleOutput::Clockwise);
        assert_ne!(session.pins.power, Power::OFF);
        assert!(session.pins.coolant.flood);
        assert!(session.status().starts_with("<Idle|"));
        assert!(session.status().contains("|T:3"));
    }
}

#[test]
fn a_resume_right_behind_the_message_is_obeyed() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.send("T3M6\nG1X1F6000\n");
    let mut answers = Vec::new();
    while answers.is_empty() {
        session.wait_ms(1);
        answers.extend(session.lines());
    }
    assert_eq!(answers, ["[MSG:Tool 3, then ~]"]);
    session.send("~");
    session.until_quiet();
    assert_eq!(session.lines(), ["ok", "ok"]);
    assert_eq!(session.pins.position[0], mm(1));
}

#[test]
fn a_window_full_of_lines_waits_and_follows_in_its_order_with_an_answer_each() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    // Sends as LaserGRBL does: everything that fits, and then it waits for answers.
    let mut job = String::from("G91\nG1F6000X1\nT1M6\n");
    let mut lines = 3;
    while job.len() < 1000 {
        job.push_str("X1 Y-0.5\n");
        lines += 1;
    }
    session.send(&job);
    session.wait_ms(1_000);
    assert_eq!(session.pins.position, [mm(1), 0, 0]);
    assert_eq!(session.lines(), ["ok", "ok", "[MSG:Tool 1, then ~]"]);
    // The sender cannot send more; the operator changes the tool and presses the sender's resume
    // button.
    session.send("?");
    session.wait_ms(10);
    session.send("~");
    session.until_quiet();
    let answers = session.lines();
    assert_eq!(
        answers.iter().filter(|line| *line == "ok").count(),
        lines - 2
    );
    let moves = lines as i32 - 3;
    assert_eq!(session.pins.position, [mm(1 + moves), -125 * moves, 0]);
    // No part of the job is left over.
    assert_eq!(session.line("G90X0Y0"), ["ok"]);
    assert_eq!(session.pins.position, [0; 3]);
}

#[test]
fn lines_that_wait_behind_a_second_change_wait_for_its_operator_too() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.send("G91G21F6000\nT1M6\nG1X1\nT2M6\nG1X1\nT3M6\nG1X1\n");
    let mut answers = Vec::new();
    for changes in 1..=3 {
        session.wait_ms(1_000);
        assert_eq!(session.pins.position, [mm(changes - 1), 0, 0]);
        answers.extend(session.lines());
        session.send("~");
    }
    session.until_quiet();
    answers.extend(session.lines());
    assert_eq!(session.pins.position, [mm(3), 0, 0]);
    let refused = answers.iter().filter(|line| line.starts_with("error"));
    assert_eq!(refused.count(), 0, "{answers:?}");
    assert_eq!(answers.iter().filter(|line| *line == "ok").count(), 7);
}

#[test]
fn a_reset_drops_the_lines_that_were_kept() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.send("T1M6\nG1X5F600\nX6\n");
    session.wait_ms(500);
    session.send([0x18]);
    session.until_quiet();
    let lines = session.lines();
    assert_eq!(lines.last().unwrap(), "Grbl 1.1h ['$' for help]");
    assert!(session.status().starts_with("<Idle|"));
    session.send("~");
    session.until_quiet();
    assert_eq!(session.pins.position, [0; 3]);
    assert_eq!(session.line("G0X1"), ["ok"]);
}

#[test]
fn the_operator_may_jog_probe_and_set_offsets_and_nothing_else() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.send("M3S1000\nG91\nT1M6\nG1X1F600\n");
    session.wait_ms(500);
    session.lines();
    for line in [
        "G0X5",
        "G1X5F100",
        "X5",
        "M3",
        "M5",
        "M30",
        "T2M6",
        "G28",
        "G92X0",
        "$0=5",
        "$C",
        "$SLP",
        "$RST=$",
        "G10L2P1X1",
    ] {
        assert_eq!(session.line(line).last().unwrap(), "error:9", "{line}");
    }
    assert_eq!(session.pins.position, [0; 3]);
    for line in [
        "$J=G91X2Z-1F600",
        "G10L20P1Z0",
        "G43.1Z0.5",
        "G49",
        "G90",
        "$G",
        "$#",
        "$$",
        "G21G94F100",
        "",
    ] {
        assert_eq!(session.line(line).last().unwrap(), "ok", "{line}");
    }
    assert_eq!(session.pins.position, [mm(2), 0, mm(-1)]);
    assert_eq!(session.pins.spindle, SpindleOutput::Off);
    assert!(session.status().starts_with("<Hold:0|"));
    session.send("~");
    session.until_quiet();
    // G91 is active again, as the program has set it: X1 moves one mm on.
    assert_eq!(session.pins.position[0], mm(1));
    assert_eq!(session.pins.spindle, SpindleOutput::Clockwise);
}

#[test]
fn z_goes_up_before_x_and_y_go_back_and_down_after() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.line("$860=1");
    session.line("G0X4Z2");
    session.send("T2M6\n");
    session.wait_ms(500);
    session.line("$J=X20Y5Z-3F3000");
    session.wait_ms(10);
    session.lines();
    session.send("~");
    let (mut low, mut high) = (mm(-3), mm(-3));
    session.until(|session| {
        let [x, y, z] = session.pins.position;
        if [x, y] != [mm(20), mm(5)] && [x, y] != [mm(4), 0] {
            assert_eq!(z, mm(3), "X and Y move at the clear height");
        }
        low = low.min(z);
        high = high.max(z);
        session.machine.is_quiet()
    });
    assert_eq!((low, high), (mm(-3), mm(3)));
    assert_eq!(session.pins.position, [mm(4), 0, mm(2)]);
    assert_eq!(session.lines(), ["ok"]);
}

#[test]
fn the_recipe_for_touching_off_gives_each_tool_the_same_zero() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    // The plate closes the contact at -10 mm and below with the first tool; the second tool is 2 mm
    // longer.
    session.contact = Some(Contact::Probe(mm(-10)));
    session.line("G21G90");
    session.line("G38.2Z-20F100");
    session.line("G10L20P1Z0");
    session.line("$J=Z2F600");
    assert_eq!(session.line("G0Z5"), ["ok"]);
    let first = session.pins.position[2];
    session.send("T2M6\nG0Z5\n");
    session.wait_ms(500);
    session.contact = Some(Contact::Probe(mm(-8)));
    for line in ["G91", "G38.2Z-20F100", "G10L20P1Z0", "$J=G91Z3F600"] {
        let said = session.line(line);
        assert_eq!(said.last().unwrap(), "ok", "{line}: {said:?}");
    }
    session.wait_ms(10);
    session.send("~");
    session.until_quiet();
    let second = session.pins.position[2];
    // Probing stops a few steps after the contact, with both tools by the same distance.
    assert!((second - first - mm(2)).abs() <= 2, "{first} {second}");
    let offset = session.line("$#");
    assert!(
        offset
            .iter()
            .any(|line| line.starts_with("[G54:0.000,0.000,-8.")),
        "{offset:?}"
    );
}

#[test]
fn a_probe_without_contact_leaves_the_tool_change_open() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.send("T1M6\nG0X1\n");
    session.wait_ms(500);
    let said = session.line("G38.2Z-1F600");
    assert!(said.contains(&"ALARM:5".to_owned()), "{said:?}");
    session.line("$X");
    assert!(session.status().starts_with("<Hold:0|"));
    session.send("~");
    session.until_quiet();
    assert_eq!(session.pins.position, [mm(1), 0, 0]);
    assert_eq!(
        session.lines().iter().filter(|line| *line == "ok").count(),
        2
    );
}

#[test]
fn a_tool_stays_selected_until_m6_takes_it_and_bcnc_sees_it() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.line("T5");
    session.line("G0X1");
    assert!(session.line("$G")[0].contains(" T5 "));
    // bCNC asks for state and modes all the time, and counts the bytes that have not been answered
    // with `ok` yet.
    session.send("M6\n");
    for _ in 0..20 {
        session.send("?");
        session.wait_ms(50);
        session.send("$G\n");
        session.wait_ms(50);
    }
    let lines = session.lines();
    let modes = lines.iter().filter(|line| line.starts_with("[GC:"));
    assert!(modes.clone().count() >= 15, "{lines:?}");
    assert!(lines.iter().any(|line| line.starts_with("<Hold:0|")));
    assert!(lines.contains(&"[MSG:Tool 5, then ~]".to_owned()));
    let answered = lines.iter().filter(|line| *line == "ok").count();
    session.send("~");
    session.until_quiet();
    let more = session.lines().iter().filter(|line| *line == "ok").count();
    assert_eq!(answered + more, 21);
}

#[test]
fn g43_takes_lengths_from_the_table_that_g10_l1_fills() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    assert_eq!(session.line("G10L1P3Z12.5"), ["ok"]);
    assert_eq!(session.line("G20G10L1P4Z-0.1"), ["ok"]);
    assert_eq!(session.line("G21"), ["ok"]);
    let listed = session.line("$#");
    assert!(listed.contains(&"[TLO:0.000]".to_owned()));
    let tools: Vec<_> = listed
        .iter()
        .filter(|line| line.starts_with("[T:"))
        .collect();
    assert_eq!(
        tools,
        ["[T:3|0.000,0.000,12.500]", "[T:4|0.000,0.000,-2.540]"]
    );
    assert_eq!(session.line("$883"), ["$883=12.500", "ok"]);
    // The length already applies to the motion of its own line.
    assert_eq!(session.line("G0G43H3Z1"), ["ok"]);
    assert_eq!(session.pins.position[2], mm(13) + 125);
    assert!(session.line("$#").contains(&"[TLO:12.500]".to_owned()));
    session.line("G0Z0");
    assert_eq!(session.pins.position[2], mm(12) + 125);
    session.line("G43H0");
    session.line("G0Z0");
    assert_eq!(session.pins.position[2], 0);
    session.line("G43H4Z0");
    assert_eq!(session.pins.position[2], -635);
    session.line("G49Z0");
    for (line, error) in [
        ("G43H17", 203),
        ("G43H3L1", 36),
        ("G10L1P17Z1", 203),
        ("G10L1P0Z1", 203),
        ("G10L1P3X1", 37),
        ("G10L1P3Z1000.001", 52),
        ("G10L1P3Z-1001", 52),
        ("H3", 36),
    ] {
        assert_eq!(session.line(line), [format!("error:{error}")], "{line}");
    }
}

#[test]
fn g43_without_h_is_the_tool_in_the_spindle_and_the_program_goes_on_as_high_above_the_work() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.line("G10L1P2Z3");
    session.line("G0Z5");
    session.send("T2M6\nG43\nG0Z5\n");
    session.wait_ms(500);
    session.send("~");
    session.until_quiet();
    assert_eq!(session.pins.position[2], mm(8));
    session.send("T1M6\n");
    session.wait_ms(500);
    session.line("G43.1Z1");
    session.send("~");
    session.until_quiet();
    assert_eq!(
        session.pins.position[2],
        mm(6),
        "5 mm above the work, as before"
    );
}

#[test]
fn a_door_or_a_hold_in_between_starts_no_spindle() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.send("M3S1000\nT1M6\nG1X1F600\n");
    until_asked(&mut session);
    for stop in [0x84, b'!'] {
        session.send([stop]);
        session.wait_ms(1_000);
        session.send("~");
        session.wait_ms(6_000);
        assert_eq!(session.pins.spindle, SpindleOutput::Off);
        assert!(session.status().starts_with("<Hold:0|"), "{stop}");
    }
    session.send("~");
    session.until_quiet();
    assert_eq!(session.pins.spindle, SpindleOutput::Clockwise);
    assert_eq!(session.pins.position[0], mm(1));
}

#[test]
fn a_laser_is_dark_from_the_message_until_the_tool_is_back() {
    for mode in ["M3", "M4"] {
        let mut memory = Memory::new();
        let mut session = boot(&mut memory);
        session.send(format!("$32=1\n{mode}S500\nG1X1F600\nT1M6\nG1X2\n"));
        session.until(|session| session.pins.spindle != SpindleOutput::Off);
        until_asked(&mut session);
        let dark_until = |session: &mut Desk, line: &str, there: [i32; 3]| {
            session.send(line);
            session.until(|session| {
                assert_eq!(session.pins.power, Power::OFF, "{mode} {line:?}");
                session.pins.position == there
            });
        };
        dark_until(&mut session, "$J=G91X5F600\n", [mm(6), 0, 0]);
        session.until_quiet();
        dark_until(&mut session, "~", [mm(1), 0, 0]);
        session.until(|session| session.pins.power != Power::OFF);
        session.until_quiet();
        assert_eq!(session.pins.position[0], mm(2));
    }
}

#[test]
fn nothing_turns_or_burns_while_the_lines_of_the_sender_are_collected() {
    for laser in [0, 1] {
        let mut memory = Memory::new();
        let mut session = boot(&mut memory);
        session.send(format!("$32={laser}\nM3S500\nG1X1F600\nT1M6\nG1X2\n"));
        session.until(|session| session.pins.position[0] == mm(1));
        session.wait_ms(20);
        assert_eq!(session.pins.power, Power::OFF, "$32={laser}");
        assert_eq!(session.pins.spindle, SpindleOutput::Off, "$32={laser}");
        session.send("!");
        session.wait_ms(10);
        session.send("~");
        session.wait_ms(10);
        assert_eq!(session.pins.power, Power::OFF, "$32={laser}, resumed");
        assert_eq!(
            session.pins.spindle,
            SpindleOutput::Off,
            "$32={laser}, resumed"
        );
        let said = session.lines().join(" ");
        assert!(!said.contains("then ~"), "the lines were collected: {said}");
    }
}

#[test]
fn without_the_extension_all_of_it_is_refused_as_grbl_does() {
    let mut memory = Memory::new();
    let mut stock = Session::boot(&mut memory, MachineConfig::grbl());
    for line in ["M6", "T1M6", "G43H1", "G10L1P1Z1"] {
        let said = stock.line(line);
        assert!(said[0].starts_with("error:"), "{line} {said:?}");
    }
    stock.line("T3");
    stock.line("G0X1");
    assert!(stock.line("$G")[0].contains(" T0 "));
}

#[test]
fn check_mode_passes_over_a_tool_change() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.line("$C");
    assert_eq!(session.line("T1M6"), ["ok"]);
    assert_eq!(session.line("G43H1"), ["ok"]);
    assert_eq!(session.line("T2M6G43H2M3S500G1X1F600"), ["ok"]);
}

/// A line with a tool change, and what it has done once the operator has sent `~`: position in mm,
/// spindle, flood, and the length in force.
type After = (&'static str, [i32; 3], SpindleOutput, bool, &'static str);

/// LinuxCNC documents this order of execution: tool, spindle, coolant, dwell, length,
/// offsets, motion.
#[test]
fn the_other_words_of_a_line_follow_its_tool_change() {
    use SpindleOutput::{Clockwise, Off};
    const LINES: [After; 12] = [
        ("T1M6G43H1", [0, 0, 5], Off, false, "2.000"),
        ("G43H1T1M6", [0, 0, 5], Off, false, "2.000"),
        ("T1M6G43", [0, 0, 5], Off, false, "2.000"),
        ("N10T1M06S1000M3", [0, 0, 5], Clockwise, false, "0.000"),
        ("M3S1000M8T1M6", [0, 0, 5], Clockwise, true, "0.000"),
        ("G0X1T1M6", [1, 0, 5], Off, false, "0.000"),
        ("T1M6G43H1G0Z6", [0, 0, 8], Off, false, "2.000"),
        ("T1M6G91G1X2F600", [2, 0, 5], Off, false, "0.000"),
        ("T1M6G4P0.1", [0, 0, 5], Off, false, "0.000"),
        ("T1M6G92Z0", [0, 0, 5], Off, false, "0.000"),
        ("T1M6G43.1Z3", [0, 0, 5], Off, false, "3.000"),
        ("T1M6G28X1", [0, 0, 5], Off, false, "0.000"),
    ];
    for (line, place, spindle, flood, length) in LINES {
        let mut memory = Memory::new();
        let mut session = boot(&mut memory);
        session.line("G10L1P1Z2");
        session.line("G0Z5");
        session.send(format!("{line}\n"));
        session.wait_ms(500);
        assert_eq!(session.lines(), ["[MSG:Tool 1, then ~]"], "{line}");
        assert_eq!(session.pins.position, [0, 0, mm(5)], "{line}");
        assert_eq!(session.pins.spindle, Off, "{line}");
        session.send("~");
        session.until_quiet();
        assert_eq!(session.lines(), ["ok"], "{line}");
        assert_eq!(session.pins.position, place.map(mm), "{line}");
        assert_eq!(session.pins.spindle, spindle, "{line}");
        assert_eq!(session.pins.coolant.flood, flood, "{line}");
        let offsets = session.line("$#").join(" ");
        assert!(
            offsets.contains(&format!("[TLO:{length}]")),
            "{line}: {offsets}"
        );
    }
}

#[test]
fn the_rest_of_the_line_counts_from_the_zero_that_the_operator_has_set() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.line("G0X4Z5");
    session.send("T1M6G90G0X1\nX2\n");
    session.wait_ms(500);
    session.line("G10L20P1X0");
    session.send("~");
    session.until(|session| session.pins.position[0] == mm(5));
    session.until_quiet();
    assert_eq!(session.pins.position[0], mm(6));
}

#[test]
fn a_fault_of_any_word_beside_a_tool_change_refuses_the_line_before_it() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    for (line, answer) in [
        ("T1M6G1X1", "error:22"),
        ("T1M6P1", "error:36"),
        ("T1M6G43H17", "error:203"),
        ("T1M6M3M4", "error:21"),
        ("T1M6G0X1G28Z0", "error:24"),
        ("T4294967296M6G0X1", "error:38"),
    ] {
        assert_eq!(session.line(line), [answer], "{line}");
    }
    assert!(session.status().contains("|T:0"));
    assert!(
        session.line("$G")[0].contains(" T0 "),
        "nothing is selected"
    );
}

#[test]
fn a_reset_in_the_tool_change_drops_the_rest_of_its_line() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.send("T1M6G0X1\n");
    session.wait_ms(500);
    session.send([0x18]);
    session.wait_ms(50);
    session.line("G0Y1");
    session.until_quiet();
    assert_eq!(session.pins.position, [0, mm(1), 0]);
}

#[test]
fn a_tool_number_that_no_t_can_have_is_refused_and_its_word_named() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.line("$700=1");
    let said = session.line("M6T4294967296");
    assert_eq!(said, ["[MSG:The tool number is too large]", "error:38"]);
    assert!(session.status().starts_with("<Idle|"));
    for tool in ["256", "301", "4294967295"] {
        session.send(format!("T{tool}M6\n"));
        session.wait_ms(500);
        assert_eq!(session.lines(), [format!("[MSG:Tool {tool}, then ~]")]);
        session.send("~");
        session.until_quiet();
        assert_eq!(session.lines(), ["ok"]);
        assert!(session.status().contains(&format!("|T:{tool}")));
        assert!(session.line("$G")[0].contains(&format!(" T{tool} ")));
    }
    // The table ends at 16: a length beyond it is no length of this tool.
    for line in [
        "G43",
        "G43H301",
        "G43H17",
        "G43H-1",
        "G10L1P17Z1",
        "G10L1P301Z1",
    ] {
        let said = session.line(line);
        let text = "[MSG:The tool is not in the table of tool lengths]";
        assert_eq!(said, [text, "error:203"], "{line}");
    }
}
