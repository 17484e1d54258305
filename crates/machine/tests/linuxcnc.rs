//! Words of LinuxCNC's as a sender sees them.

use crate::bench::{Memory, Session};
use leadscrew_machine::config::MachineConfig;

fn boot(memory: &mut Memory) -> Session<'_> {
    Session::boot(memory, MachineConfig::new())
}

#[test]
fn a_file_of_linuxcnc_s_post_processor_runs_to_its_end() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    for line in [
        "%",
        "G17 G21 G40 G49 G64 P0.05 G80 G90 G94",
        "G59.1",
        "G0 Z1 G49",
        "G1 X1 F3000",
        "G2 I0.5",
        "G2 X2 I0.5 P2",
        "G92.2",
        "M30",
        "%",
    ] {
        let answer = session.line(line);
        assert_eq!(answer.last().map(String::as_str), Some("ok"), "{line}");
    }
    session.until_quiet();
    assert_eq!(session.pins.position, [500, 0, 250]);
}

#[test]
fn a_list_of_offsets_has_nine_systems_where_programs_have_them() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    assert_eq!(session.line("G10L2P8X3"), ["ok"]);
    let lines = session.line("$#");
    assert_eq!(lines.len(), 15);
    assert_eq!(lines[7], "[G59.2:3.000,0.000,0.000]");
    assert!(lines[9].starts_with("[G28:"));
    assert!(session.line("$RST=#").contains(&"ok".to_owned()));
    session.until_quiet();
    let lines = session.line("$#");
    assert!(
        lines.contains(&"[G59.2:0.000,0.000,0.000]".to_owned()),
        "{lines:?}"
    );

    let mut memory = Memory::new();
    let mut session = Session::boot(&mut memory, MachineConfig::grbl());
    assert_eq!(session.line("$#").len(), 12);
}

/// The overrides that a report shows.
fn overrides(session: &mut Session<'_>) -> Vec<u8> {
    loop {
        let status = session.status();
        if let Some((_, rest)) = status.split_once("|Ov:") {
            let digits = |c: char| !c.is_ascii_digit() && c != ',';
            let values = rest.split(digits).next().unwrap();
            return values
                .split(',')
                .map(|value| value.parse().unwrap())
                .collect();
        }
    }
}

#[test]
fn overrides_act_as_the_program_says_until_it_ends() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    // Feed + 10 %, spindle + 10 %, rapids 50 %.
    let all = [0x91, 0x9A, 0x96];
    session.send(all);
    assert_eq!(overrides(&mut session), [110, 50, 110]);
    assert_eq!(session.line("M50P0"), ["ok"]);
    assert_eq!(overrides(&mut session), [100, 50, 110]);
    session.send(all);
    assert_eq!(overrides(&mut session), [100, 50, 120]);
    assert_eq!(session.line("M49"), ["ok"]);
    session.send(all);
    assert_eq!(overrides(&mut session), [100, 50, 100]);
    assert_eq!(session.line("M48"), ["ok"]);
    session.send(all);
    assert_eq!(overrides(&mut session), [110, 50, 110]);
    session.line("M49");
    session.line("M2");
    session.send(all);
    assert_eq!(overrides(&mut session), [110, 50, 110]);
    session.line("M49");
    session.send("\x18");
    session.until_quiet();
    session.send(all);
    assert_eq!(overrides(&mut session), [110, 50, 110]);
}

#[test]
fn check_mode_leaves_the_overrides_alone() {
    let mut memory = Memory::new();
    let mut session = boot(&mut memory);
    session.send([0x91]);
    session.line("$C");
    assert_eq!(session.line("M49"), ["ok"]);
    assert_eq!(overrides(&mut session), [110, 100, 100]);
}
