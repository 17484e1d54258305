//! Canned cycles: a program gives the same moves, dwells, spindle commands and errors as in
//! LinuxCNC's interpreter.

mod desk;
mod inside;

use desk::{run, Event};
use serde_json::Value;

/// The tolerance of coordinates, mm: LinuxCNC prints them with this precision.
const TOLERANCE: f64 = 1e-6;
/// The time by which a dwell may be longer, s: motion has to come to rest, and to start again.
const LATE: f64 = 0.02;

/// Programs in which LinuxCNC made some moves of the line that it then refused, with the number of
/// these moves. Here, as in Grbl, a line is carried out wholly or not at all.
const BEGUN: [(usize, usize); 2] = [(0, 1), (80, 1)];

/// A program, and the motions that LinuxCNC makes of it.
struct Recorded {
    program: Vec<String>,
    events: Vec<Event>,
    error: Option<u32>,
}

fn recorded() -> Vec<Recorded> {
    let all: Vec<Value> = serde_json::from_str(include_str!("linuxcnc.json")).unwrap();
    all.iter()
        .enumerate()
        .map(|(index, row)| read(index, row))
        .collect()
}

fn read(index: usize, row: &Value) -> Recorded {
    let lines = row["program"].as_array().unwrap();
    let moves = row["moves"].as_array().unwrap();
    let begun = BEGUN.iter().find(|(program, _)| *program == index);
    let carried_out = moves.len() - begun.map_or(0, |(_, begun)| *begun);
    Recorded {
        program: lines
            .iter()
            .map(|line| line.as_str().unwrap().to_owned())
            .collect(),
        events: events(&moves[..carried_out]),
        error: row["error"].as_str().map(error),
    }
}

/// The events of LinuxCNC's list, without entries that change nothing.
fn events(moves: &[Value]) -> Vec<Event> {
    let (mut at, mut rate, mut turns) = ([0.0; 3], 0.0, false);
    let mut events = Vec::new();
    for row in moves {
        let number = |place: usize| row[place].as_f64().unwrap();
        let mut place = || {
            let target = [number(1), number(2), number(3)];
            (std::mem::replace(&mut at, target) != target).then_some(target)
        };
        match row[0].as_str().unwrap() {
            "rate" => rate = number(1),
            "traverse" => events.extend(place().map(Event::Rapid)),
            "feed" => events.extend(place().map(|target| Event::Feed(target, rate))),
            "dwell" => events.push(Event::Dwell(number(1))),
            "start_spindle_clockwise" => {
                turns = true;
                events.push(Event::Spindle(true));
            }
            "stop_spindle_turning" => {
                if std::mem::take(&mut turns) {
                    events.push(Event::Spindle(false));
                }
            }
            other => panic!("{other}"),
        }
    }
    events
}

/// Our error number for LinuxCNC's error message.
fn error(words: &str) -> u32 {
    match words {
        "All axes missing with motion code" => 26,
        "Cannot feed with zero feed rate" => 22,
        "Cannot do zero repeats of cycle" => 52,
        "R clearance plane unspecified in cycle" => 28,
        _ if words.contains("value unspecified in") => 28,
        _ if words.starts_with("Dwell time p word missing") => 28,
        _ if words.starts_with("R less than") => 200,
        _ if words.starts_with("L word with no") || words.starts_with("R word with no") => 36,
        _ => panic!("{words}"),
    }
}

fn agree(expected: &Event, actual: &Event) -> bool {
    let near = |one: &[f64; 3], other: &[f64; 3]| {
        one.iter()
            .zip(other)
            .all(|(one, other)| (one - other).abs() < TOLERANCE)
    };
    match (expected, actual) {
        (Event::Rapid(one), Event::Rapid(other)) => near(one, other),
        (Event::Feed(one, rate), Event::Feed(other, actual)) => {
            near(one, other) && (rate - actual).abs() < 1e-3
        }
        (Event::Dwell(expected), Event::Dwell(actual)) => (actual - expected).abs() < LATE,
        (Event::Spindle(one), Event::Spindle(other)) => one == other,
        _ => false,
    }
}

/// Runs all programs, and prints each one that differs.
fn assert_all_agree(programs: impl Iterator<Item = Recorded>) {
    let mut differ = Vec::new();
    for (index, recorded) in programs.enumerate() {
        let (events, error) = run(&recorded.program);
        let pairs = recorded.events.iter().zip(&events);
        let same = pairs
            .take_while(|(expected, actual)| agree(expected, actual))
            .count();
        if same < recorded.events.len() || events.len() > same || error != recorded.error {
            differ.push(format!(
                "{index} {:?}\n  expected {:?} {:?}\n  actual   {error:?} {:?}",
                recorded.program,
                recorded.error,
                &recorded.events[same.saturating_sub(1)..],
                &events[same.saturating_sub(1)..],
            ));
        }
    }
    let count = differ.len();
    assert!(differ.is_empty(), "{count} differ:\n{}", differ.join("\n"));
}

/// The program with each line rewritten from its words.
fn rewrite(recorded: Recorded, line: impl Fn(Vec<&str>) -> String) -> Recorded {
    let lines = recorded.program.iter();
    let program = lines.map(|text| line(text.split(' ').collect())).collect();
    Recorded {
        program,
        ..recorded
    }
}

#[test]
fn the_machine_does_the_same_as_linuxcnc() {
    assert_all_agree(recorded().into_iter());
}

#[test]
fn the_order_of_words_their_case_blanks_and_comments_change_nothing() {
    let scrambled = |words: Vec<&str>| {
        let mut words: Vec<String> = words.iter().map(|word| word.to_lowercase()).collect();
        words.reverse();
        format!("(hole) {}; G80", words.join("\t ( L0 )"))
    };
    assert_all_agree(
        recorded()
            .into_iter()
            .map(|recorded| rewrite(recorded, scrambled)),
    );
}

/// Runs all programs with X renamed to Y, Y to Z, and Z to X.
#[test]
fn no_plane_has_rules_of_its_own() {
    let turned = |word: &str| match (word, word.split_at(1)) {
        ("G17", _) => "G19".to_owned(),
        ("G19", _) => "G18".to_owned(),
        ("G18", _) => "G17".to_owned(),
        (_, ("X", value)) => format!("Y{value}"),
        (_, ("Y", value)) => format!("Z{value}"),
        (_, ("Z", value)) => format!("X{value}"),
        (other, _) => other.to_owned(),
    };
    let turn = |event: Event| match event {
        Event::Rapid([x, y, z]) => Event::Rapid([z, x, y]),
        Event::Feed([x, y, z], rate) => Event::Feed([z, x, y], rate),
        Event::Dwell(_) | Event::Spindle(_) => event,
    };
    assert_all_agree(recorded().into_iter().map(|recorded| {
        let events = recorded.events.iter().copied().map(turn).collect();
        let line = |words: Vec<&str>| {
            let words: Vec<String> = words.into_iter().map(turned).collect();
            words.join(" ")
        };
        Recorded {
            events,
            ..rewrite(recorded, line)
        }
    }));
}

#[test]
fn the_documented_program_drills_six_holes() {
    let page = include_str!("../../docs/cycles.md");
    let (_, rest) = page.split_once("```gcode\n").unwrap();
    let (program, _) = rest.split_once("```").unwrap();
    let program: Vec<String> = program.lines().map(str::to_owned).collect();
    let (events, error) = run(&program);
    assert_eq!(error, None);
    let mut bottoms: Vec<[f64; 3]> = Vec::new();
    for event in &events {
        if let Event::Feed(at, _) = event {
            let [x, y, _] = *at;
            bottoms.retain(|[hole_x, hole_y, _]| (*hole_x, *hole_y) != (x, y));
            bottoms.push(*at);
        }
    }
    let expected = [
        [10.0, 10.0, -3.0],
        [20.0, 10.0, -3.0],
        [30.0, 10.0, -4.0],
        [30.0, 15.0, -5.0],
        [30.0, 20.0, -5.0],
        [30.0, 25.0, -5.0],
    ];
    assert_eq!(bottoms, expected);
}
