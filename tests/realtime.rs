//! Each realtime byte in each state, and pairs of them, as the tables of `docs/senders.md` have them.

use leadscrew_machine::board::CoolantOutput;
use leadscrew_planner::Cartesian;
use leadscrew_sim::{Memory, Rate};
use leadscrew_stepper::Power;
use leadscrew_tests::{setup, Session};
use std::fs;
use std::num::NonZeroU32;
use std::path::Path;

type Desk<'a> = Session<'a, Cartesian, 3>;

/// The rows of the table of `docs/senders.md` whose header begins with these cells.
fn table(header: &str) -> Vec<Vec<String>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/senders.md");
    let text = fs::read_to_string(path).unwrap();
    let cells = |line: &str| -> Vec<String> {
        let inner = line.trim_matches('|').split('|');
        inner.map(|cell| cell.trim().to_owned()).collect()
    };
    let rows = text.lines().skip_while(|line| !line.starts_with(header));
    let rows = rows.take_while(|line| line.starts_with('|'));
    rows.enumerate()
        .filter(|(number, _)| *number != 1)
        .map(|(_, line)| cells(line))
        .collect()
}

/// A byte as the tables spell it.
fn byte(text: &str) -> u8 {
    match text.strip_prefix("0x") {
        Some(digits) => u8::from_str_radix(digits, 16).unwrap(),
        None => text.trim_matches('`').as_bytes()[0],
    }
}

fn bytes(cell: &str) -> Vec<u8> {
    let ranges = cell.split(", ").map(|range| {
        let (from, to) = range.split_once(" to ").unwrap_or((range, range));
        byte(from)..=byte(to)
    });
    ranges.flatten().collect()
}

/// A machine with a spindle at M3 S100, mist and flood on, and 115 200 baud, in this state.
fn in_state(state: &str, tool: &str, test: impl FnOnce(&mut Desk<'_>)) {
    let mut setup = setup::<3>(1);
    setup.machine.dialect.mist = true;
    setup.lines = vec![Rate::Baud(NonZeroU32::new(115_200).unwrap())];
    let mut memory = Memory::new(&setup);
    let mut session = Session::new(&mut memory, &setup, Cartesian);
    session.stream("$100=20\n$110=6000\n$120=500\n");
    session.stream(tool);
    let say: &[&[u8]] = match state {
        "Idle" => &[],
        "Run" => &[b"G1X1000F1000\n"],
        "Hold" => &[b"G1X1000F1000\n", b"!"],
        "Jog" => &[b"$J=X1000F1000\n"],
        "Home" => &[b"$22=1\n", b"$H\n"],
        "Door" => &[b"\x84"],
        "Alarm" => &[b"G1X1000F1000\n", b"\x18"],
        "Check" => &[b"$C\n"],
        "Sleep" => &[b"$SLP\n"],
        _ => panic!("no state: {state}"),
    };
    for piece in say {
        session.send(0, piece);
        session.wait_us(300_000);
    }
    assert_eq!(report(&mut session), state);
    session.heard(0);
    test(&mut session);
}

/// The state in the next report, without its number.
fn report(session: &mut Desk<'_>) -> String {
    session.heard(0);
    session.send(0, "?");
    session.wait_us(20_000);
    let heard = session.heard(0);
    let report = heard.iter().find(|line| line.starts_with('<'));
    let report = report.unwrap_or_else(|| panic!("no report: {heard:?}"));
    report[1..].split(['|', ':']).next().unwrap().to_owned()
}

/// The values that a byte may change besides the state.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Values {
    overrides: [u8; 3],
    power: Power,
    coolant: CoolantOutput,
}

fn values(session: &Desk<'_>) -> Values {
    let overrides = session.sim.machine().overrides();
    Values {
        overrides: [overrides.feed, overrides.rapid, overrides.spindle],
        power: session.sim.board().power(),
        coolant: session.sim.board().coolant(),
    }
}

/// The state after a byte whose cell has these words.
fn state_after(words: &[&str], before: &str, interrupted: bool) -> String {
    const STATES: [&str; 9] = [
        "Idle", "Run", "Hold", "Jog", "Home", "Door", "Alarm", "Check", "Sleep",
    ];
    let word = words.iter().find(|word| STATES.contains(word));
    match (word, words.contains(&"on")) {
        (Some(state), _) => (*state).to_owned(),
        (None, true) => if interrupted { "Run" } else { "Idle" }.to_owned(),
        (None, false) => before.to_owned(),
    }
}

/// The lines that a cell stands for.
fn lines_of(words: &[&str]) -> Vec<String> {
    let mut lines = Vec::new();
    for word in words {
        match *word {
            "message" => lines.push("[MSG:Check Door]".to_owned()),
            "banner" => lines.push("Grbl 1.1h ['$' for help]".to_owned()),
            alarm if alarm.starts_with("ALARM:") => lines.push(alarm.to_owned()),
            _ => {}
        }
    }
    lines
}

fn check(state: &str, byte: u8, cell: &str) {
    let words: Vec<&str> = cell.split(", ").collect();
    // Each of the bytes changes one of these overrides.
    let mut before = b"\x91\x91\x97\x9a\x9a".to_vec();
    before.extend((byte == 0x97).then_some(0x96));
    in_state(state, "M3S100M7\nM8\n", |session| {
        session.send(0, &before);
        session.wait_us(50_000);
        session.heard(0);
        let old = values(session);
        session.send(0, [byte]);
        session.wait_us(50_000);
        let mut heard = session.heard(0);
        let reports = heard.iter().filter(|line| line.starts_with('<')).count();
        // The restart after a door takes five seconds.
        session.wait_us(6_000_000);
        heard.extend(session.heard(0));
        let what = format!("{byte:#x} in {state}: {heard:?}");
        assert_eq!(reports, usize::from(words.contains(&"report")), "{what}");
        let said = heard.into_iter().filter(|line| {
            let is_locked = line.starts_with("[MSG:'$H'");
            !line.starts_with('<') && line != "ok" && !is_locked
        });
        assert_eq!(said.collect::<Vec<_>>(), lines_of(&words), "{what}");
        let new = values(session);
        let on = words.contains(&"on") && state == "Door";
        let off = words.contains(&"off");
        let overridden = words.contains(&"override") || words.contains(&"banner");
        assert_eq!(new.overrides != old.overrides, overridden, "{what}");
        if off {
            assert_eq!(new.power, Power::OFF, "{what}");
            assert_eq!(new.coolant, CoolantOutput::default(), "{what}");
        } else {
            let turned = words.contains(&"spindle") || on;
            assert_eq!(new.power != old.power, turned, "{what}");
            let flows = words.contains(&"coolant") || on;
            assert_eq!(new.coolant != old.coolant, flows, "{what}");
        }
        let expected = state_after(&words, state, state == "Hold");
        assert_eq!(report(session), expected, "{what}");
    });
}

#[test]
fn each_byte_acts_in_each_state_as_docs_senders_md_says() {
    let rows = table("| byte | Idle");
    let states = &rows[0][1..];
    let mut walked = 0;
    for row in &rows[1..] {
        for byte in bytes(&row[0]) {
            for (state, cell) in states.iter().zip(&row[1..]) {
                check(state, byte, cell);
                walked += 1;
            }
        }
    }
    assert!(walked > 500, "{walked}");
}

/// A row of the second table: the state, the bytes, the times, and the state that follows.
type Exception = (String, [u8; 2], Vec<String>, String);

fn exceptions() -> Vec<Exception> {
    let rows = table("| in | bytes");
    let read = |row: &Vec<String>| {
        let (first, second) = row[1].split_once(' ').unwrap();
        let times = row[2].split(", ").map(str::to_owned).collect();
        (
            row[0].clone(),
            [byte(first), byte(second)],
            times,
            row[3].clone(),
        )
    };
    rows[1..].iter().map(read).collect()
}

#[test]
fn pairs_of_bytes_act_one_behind_the_other_but_for_those_that_docs_senders_md_names() {
    let (rows, exceptions) = (table("| byte | Idle"), exceptions());
    let states = &rows[0][1..];
    let after = |pressed: u8, state: &str, interrupted| {
        let row = rows[1..]
            .iter()
            .find(|row| bytes(&row[0]).contains(&pressed));
        let column = states.iter().position(|name| name == state).unwrap();
        let words: Vec<&str> = row.unwrap()[column + 1].split(", ").collect();
        state_after(&words, state, interrupted)
    };
    let pressed = ["`!`", "`~`", "0x84", "0x85", "0x18"].map(byte);
    let mut used = vec![0; exceptions.len()];
    let mut wrong = Vec::new();
    for state in ["Idle", "Run", "Hold", "Jog", "Door"] {
        for pair in pressed
            .iter()
            .flat_map(|one| pressed.map(|two| [*one, two]))
        {
            for gap in ["0", "1", "5", "50"] {
                let row = exceptions.iter().position(|(at, bytes, times, _)| {
                    at == state && *bytes == pair && times.iter().any(|time| time == gap)
                });
                let between = after(pair[0], state, matches!(state, "Run" | "Hold"));
                let interrupted = matches!(state, "Run" | "Hold") && pair[0] != 0x18;
                let expected = match row {
                    Some(row) => exceptions[row].3.clone(),
                    None => after(pair[1], &between, interrupted),
                };
                row.into_iter().for_each(|row| used[row] += 1);
                in_state(state, "", |session| {
                    session.send(0, [pair[0]]);
                    session.wait_us(gap.parse::<u64>().unwrap() * 1_000);
                    session.send(0, [pair[1]]);
                    session.wait_us(400_000);
                    let found = report(session);
                    if found != expected {
                        wrong.push(format!("{state} {pair:x?} {gap}: {found}, not {expected}"));
                    }
                });
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(used.iter().all(|count| *count > 0), "{used:?}");
}
