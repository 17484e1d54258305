//! A change is stored before its line is answered: whoever has heard `ok` may pull the plug.

use crate::bench::flash::MockFlash as Flash;
use crate::bench::{Memory, Session};
use leadscrew_machine::config::MachineConfig;

/// Bytes of an area.
const SIZE: usize = 1024;

/// Lines, and the row of a list that shows what each of them stores.
const CHANGES: [(&str, &str); 8] = [
    ("G10L2P1X5\n", "[G54:5.000,0.000,0.000]"),
    ("$100=300\n", "$100=300.000"),
    ("G10L20P3Y-2\n", "[G56:0.000,2.000,0.000]"),
    ("G10L2P9Y4\n", "[G59.3:0.000,4.000,0.000]"),
    ("$N0=G21\n", "$N0=G21"),
    ("G10L2P1X7\n", "[G54:7.000,0.000,0.000]"),
    ("G10L2P6Z1000000000\n", "[G59:0.000,0.000,2147483.648]"),
    ("$I=MINE\n", "[VER:1.1h.20190830:MINE]"),
];

fn switch_on<'a>(memory: &'a mut Memory, flash: &mut Flash) -> Session<'a> {
    let mut config = MachineConfig::grbl();
    config.dialect.linuxcnc = true;
    let mut session = Session::boot(memory, config);
    session.machine.load(flash).unwrap();
    session
}

/// Runs the main loop until `done`, or until the power goes: then false.
fn run(session: &mut Session<'_>, flash: &mut Flash, done: impl Fn(&Session<'_>) -> bool) -> bool {
    for _ in 0..100_000 {
        if done(session) {
            return true;
        }
        session.turn();
        if session.machine.save(flash).is_err() {
            return false;
        }
    }
    panic!("never: {:?}", session.machine.state());
}

fn answers(session: &Session<'_>) -> usize {
    let sent = String::from_utf8_lossy(&session.pins.sent);
    sent.lines().filter(|line| *line == "ok").count()
}

/// All lists of a machine that starts with what is stored.
fn read_back(flash: &mut Flash) -> Vec<String> {
    flash.restart();
    let mut memory = Memory::new();
    let mut session = switch_on(&mut memory, flash);
    ["$#", "$$", "$N", "$I"]
        .map(|list| session.line(list))
        .concat()
}

#[test]
fn an_answered_change_survives_a_power_loss_at_any_byte() {
    let mut fuel = 0;
    loop {
        let mut flash = Flash {
            fuel,
            ..Flash::new(SIZE)
        };
        let mut memory = Memory::new();
        let mut session = switch_on(&mut memory, &mut flash);
        session.send(CHANGES.map(|(line, _)| line).concat());
        let all = run(&mut session, &mut flash, |session| {
            answers(session) == CHANGES.len()
        });
        let answered = answers(&session);
        drop(session);
        let rows = read_back(&mut flash);
        for (index, (line, row)) in CHANGES.iter().enumerate() {
            let stored = rows.iter().any(|other| other == row);
            // A later change of the same offset has replaced it, or may have.
            let replaced = index == 0 && answered >= 4;
            let may_be = index == answered;
            assert!(
                stored == (index < answered) || may_be || replaced,
                "{line:?} after {fuel} bytes, {answered} answers: {rows:?}"
            );
        }
        if all {
            break;
        }
        fuel += 1;
    }
    assert!(fuel > 100, "only {fuel} bytes were written");
}

#[test]
fn a_change_in_motion_is_stored_and_answered_once_motion_has_ended() {
    for line in ["G10L2P1X7\n", "G10L2P2X7\n", "G28.1\n"] {
        let mut flash = Flash::new(SIZE);
        let mut memory = Memory::new();
        let mut session = switch_on(&mut memory, &mut flash);
        session.send("G1X1F500\n");
        run(&mut session, &mut flash, |session| {
            session.pins.position[0] > 100
        });
        session.send(line);
        run(&mut session, &mut flash, |session| answers(session) == 2);
        assert_eq!(session.pins.position[0], 250, "{line}");
        drop(session);
        let rows = read_back(&mut flash);
        let changed = rows
            .iter()
            .any(|row| row.contains(":7.000") || row == "[G28:1.000,0.000,0.000]");
        assert!(changed, "{line}: {rows:?}");
    }
}

#[test]
fn defaults_are_restored_in_the_store_before_the_answer_and_the_banner() {
    let mut flash = Flash::new(SIZE);
    let mut memory = Memory::new();
    let mut session = switch_on(&mut memory, &mut flash);
    session.send(CHANGES.map(|(line, _)| line).concat());
    run(&mut session, &mut flash, |session| {
        answers(session) == CHANGES.len()
    });
    session.lines();
    session.send("$RST=*\n");
    run(&mut session, &mut flash, |session| answers(session) == 1);
    drop(session);
    let rows = read_back(&mut flash);
    for (line, row) in CHANGES {
        assert!(!rows.iter().any(|other| other == row), "{line}: {rows:?}");
    }
}

/// A test of whether a row of a list shows its default after `$RST=`.
type Goes = fn(&str) -> bool;

const RESTORES: [(&str, Goes); 3] = [
    ("$RST=$\n", |row| row.starts_with("$1")),
    ("$RST=#\n", |row| row.starts_with("[G")),
    ("$RST=*\n", |_| true),
];

#[test]
fn power_lost_at_any_byte_of_rst_leaves_all_values_or_none() {
    let mut known = Flash::new(SIZE);
    let mut memory = Memory::new();
    let mut session = switch_on(&mut memory, &mut known);
    let changes = ["$110=700\n", "$111=701\n", "$121=33\n"].concat();
    session.send(changes + &CHANGES.map(|(line, _)| line).concat());
    run(&mut session, &mut known, |session| answers(session) == 10);
    drop(session);
    let defaults = read_back(&mut Flash::new(SIZE));
    let old = read_back(&mut known);
    for (line, goes) in RESTORES {
        let pairs = old.iter().zip(&defaults);
        let new: Vec<&String> = pairs
            .map(|(old, default)| if goes(old) { default } else { old })
            .collect();
        let (mut fuel, mut found) = (0, [0, 0]);
        loop {
            let mut flash = Flash {
                fuel,
                ..known.clone()
            };
            let mut memory = Memory::new();
            let mut session = switch_on(&mut memory, &mut flash);
            session.send(line);
            let answered = run(&mut session, &mut flash, |session| answers(session) == 1);
            drop(session);
            let rows = read_back(&mut flash);
            let is_new = rows.iter().eq(new.iter().copied());
            assert!(
                is_new || rows == old && !answered,
                "{line:?} after {fuel} bytes: {rows:?}"
            );
            found[usize::from(is_new)] += 1;
            if answered {
                break;
            }
            fuel += 1;
        }
        assert!(found[0] > 30, "{line:?}: {found:?}");
    }
}

#[test]
fn a_change_that_the_memory_does_not_take_is_error_7() {
    let mut flash = Flash {
        fuel: 0,
        ..Flash::new(SIZE)
    };
    let mut memory = Memory::new();
    let mut session = switch_on(&mut memory, &mut flash);
    session.send("$100=300\n");
    assert!(!run(&mut session, &mut flash, |_| false));
    session.wait_ms(1);
    assert_eq!(session.lines(), ["error:7"]);
}
