//! Tests of M62 to M65 from the sender's view and at the pins.

#[path = "../../machine/tests/bench/mod.rs"]
mod bench;

use bench::{Memory, Session};
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::extension::OutputChange;
use leadscrew_outputs::{OutputPort, Outputs, OutputsConfig};
use leadscrew_planner::Cartesian;
use std::cell::Cell;
use std::rc::Rc;

struct Wires(Rc<Cell<u8>>);

impl OutputPort for Wires {
    fn change(&mut self, change: OutputChange) {
        self.0.set(change.applied_to(self.0.get()));
    }
    fn levels(&self) -> u8 {
        self.0.get()
    }
}

type Desk<'m> = Session<'m, Cartesian, Outputs<Wires>>;

/// Three outputs: a feeder, a lamp that stays on in a hold, and a fan that is on from the start.
const CONFIG: OutputsConfig = OutputsConfig {
    count: 3,
    boot: 0b100,
    stay: 0b010,
};

fn boot(memory: &mut Memory, config: OutputsConfig) -> (Desk<'_>, Rc<Cell<u8>>) {
    let levels = memory.outputs.clone();
    levels.set(0b011);
    let extension = Outputs::new(config, Wires(levels.clone()));
    let session = Session::extended(memory, MachineConfig::grbl(), Cartesian, extension);
    (session, levels)
}

/// Steps of a length in mm: 250 steps/mm.
const fn mm(x: i32) -> i32 {
    x * 250
}

#[test]
fn m62_and_m63_change_an_output_where_the_next_move_begins() {
    let mut memory = Memory::new();
    let (mut session, levels) = boot(&mut memory, CONFIG);
    session.send("G1X1F600\nM62P0\nX2\nX3\nM63P0\nM62P1\nM63P2X4\nX5\n");
    session.until_quiet();
    assert_eq!(session.lines(), ["ok"; 8]);
    let changes: Vec<_> = session.pins.output_changes.clone();
    assert_eq!(changes, [([mm(1), 0, 0], 0b101), ([mm(3), 0, 0], 0b010)]);
    assert_eq!(levels.get(), 0b010);
}

#[test]
fn the_path_does_not_stop_for_an_output() {
    let mut memory = Memory::new();
    let (mut session, _) = boot(&mut memory, CONFIG);
    let time = |session: &mut Desk<'_>, lines: &str| {
        let begin = session.now_us();
        session.send(lines);
        session.until_quiet();
        session.now_us() - begin
    };
    let without = time(&mut session, "G1X10F1200\nX20\n");
    session.line("G0X0");
    let with = time(&mut session, "G1X10F1200\nM62P0X20\n");
    // A stop from 20 mm/s at 10 mm/s², and speeding up again, would take two seconds more.
    assert!(with.abs_diff(without) < 20_000, "{without} us, {with} us");
}

#[test]
fn m64_and_m65_change_it_at_once_and_the_moves_under_way_leave_it_so() {
    let mut memory = Memory::new();
    let (mut session, levels) = boot(&mut memory, CONFIG);
    session.send("M62P0\nG1X10F600\nX20\n");
    session.until(|session| session.pins.position[0] > mm(2));
    assert_eq!(levels.get(), 0b101);
    session.send("M65P0\nM64P1\n");
    session.wait_ms(5);
    assert_eq!(levels.get(), 0b110);
    session.until_quiet();
    assert_eq!(levels.get(), 0b110);
}

#[test]
fn in_a_hold_outputs_are_off_unless_they_stay_and_come_back_with_the_resume() {
    let mut memory = Memory::new();
    let (mut session, levels) = boot(&mut memory, CONFIG);
    session.send("M64P1\nM62P0\nG1X20F600\nM63P0X30\n");
    session.until(|session| session.pins.position[0] > mm(5));
    session.send("!");
    session.wait_ms(10);
    assert_eq!(levels.get(), 0b111, "it still moves");
    session.wait_ms(3_000);
    assert!(session.status().starts_with("<Hold:0|"));
    assert_eq!(levels.get(), 0b010);
    let rest = session.pins.pulses;
    session.send("~");
    session.until(|session| session.pins.pulses != rest);
    assert_eq!(levels.get(), 0b111, "on before the first step");
    session.until_quiet();
    assert_eq!(levels.get(), 0b110);
}

#[test]
fn the_door_switches_off_and_closing_it_brings_back() {
    let mut memory = Memory::new();
    let (mut session, levels) = boot(&mut memory, CONFIG);
    session.send("M62P0\nG1X20F600\n");
    session.until(|session| session.pins.position[0] > mm(5));
    session.send([0x84]);
    session.wait_ms(3_000);
    assert!(session.status().starts_with("<Door:"));
    assert_eq!(levels.get(), 0);
    session.send("~");
    session.until_quiet();
    assert_eq!(levels.get(), 0b101);
}

#[test]
fn reset_alarm_and_the_end_of_the_program_bring_the_boot_level() {
    for end in ["\x18", "M2\n", "M30\n"] {
        let mut memory = Memory::new();
        let (mut session, levels) = boot(&mut memory, CONFIG);
        assert_eq!(levels.get(), 0b100, "from the start");
        session.line("M64P0");
        session.line("M65P2");
        session.line("M62P1");
        assert_eq!(levels.get(), 0b001);
        session.send(end);
        session.until_quiet();
        assert_eq!(levels.get(), 0b100, "{end:?}");
        // The change that waited for a move has been dropped.
        session.line("G0X1");
        assert_eq!(levels.get(), 0b100, "{end:?}");
    }
}

#[test]
fn a_reset_in_motion_leaves_no_change_of_the_moves_that_were_planned() {
    let mut memory = Memory::new();
    let (mut session, levels) = boot(&mut memory, CONFIG);
    session.send("M62P0\nG1X5F600\nM62P1X6\nM63P2X7\n");
    session.until(|session| session.pins.position[0] > mm(2));
    session.send([0x18]);
    session.wait_ms(100);
    assert!(session.lines().contains(&"ALARM:3".to_owned()));
    assert_eq!(levels.get(), 0b100);
}

#[test]
fn sleep_switches_off() {
    let mut memory = Memory::new();
    let (mut session, levels) = boot(&mut memory, CONFIG);
    session.line("M64P0");
    session.line("$SLP");
    session.wait_ms(100);
    assert_eq!(levels.get(), 0);
    session.send([0x18]);
    session.wait_ms(10);
    assert_eq!(levels.get(), 0b100);
}

#[test]
fn a_line_with_a_wrong_output_changes_nothing() {
    let mut memory = Memory::new();
    let (mut session, levels) = boot(&mut memory, CONFIG);
    for (line, answer) in [
        ("M62", "error:28"),
        ("M64P3", "error:52"),
        ("M64P0.5", "error:23"),
        ("M64P-1", "error:4"),
        ("M62P0M63P1", "error:21"),
        ("G1X5F600M64P8", "error:52"),
    ] {
        assert_eq!(session.line(line), [answer], "{line}");
    }
    assert_eq!(levels.get(), 0b100);
    assert_eq!(session.pins.position, [0; 3]);
    assert!(session.line("$G")[0].contains("G0 "), "the modes stay too");
}

#[test]
fn check_mode_checks_and_switches_nothing() {
    let mut memory = Memory::new();
    let (mut session, levels) = boot(&mut memory, CONFIG);
    session.line("$C");
    assert_eq!(session.line("M64P0"), ["ok"]);
    assert_eq!(session.line("M64P3"), ["error:52"]);
    assert_eq!(levels.get(), 0b100);
}

#[test]
fn without_outputs_the_words_are_refused_as_grbl_does() {
    let mut memory = Memory::new();
    let (mut session, levels) = boot(&mut memory, OutputsConfig::default());
    for line in ["M62P0", "M63P0", "M64P0", "M65P0"] {
        assert_eq!(session.line(line), ["error:20"], "{line}");
    }
    assert_eq!(levels.get(), 0b011, "no pin is touched");
    assert!(!session.status().contains("Out:"));
}

#[test]
fn reports_show_the_levels_from_output_0_on() {
    let mut memory = Memory::new();
    let (mut session, _) = boot(&mut memory, CONFIG);
    session.line("M64P0");
    let report = session.status();
    assert!(report.ends_with("|Out:101>"), "{report}");
}
