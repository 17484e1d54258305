//! Random programs: the moves and refusals are those of LinuxCNC's own interpreter, recorded by
//! `linuxcnc/record.py`.

mod common;

use common::run;
use leadscrew_interpreter::{
    ArcMismatch, AxisKind, Command, Commands, Context, Dialect, Feed, Interpreter, OwnCodes,
    ToolTable, MAX_WORD,
};
use std::{env, fs};

/// Coordinates are recorded with four decimals, mm.
const BOUND: f64 = 0.000_051_1;

/// An event in the run of a program.
#[derive(Debug, PartialEq)]
enum Event {
    Rapid([f64; 3]),
    Feed([f64; 3]),
    Rate(f64),
    /// The line that was refused.
    Refused(String),
}

impl Event {
    fn read(line: &str) -> Self {
        let (kind, rest) = line.split_at(1);
        let numbers: Vec<f64> = rest
            .split_whitespace()
            .map_while(|one| one.parse().ok())
            .collect();
        let place = || [numbers[0], numbers[1], numbers[2]];
        match kind {
            "R" => Self::Rapid(place()),
            "G" => Self::Feed(place()),
            "F" => Self::Rate(numbers[0]),
            _ => Self::Refused(rest.trim().to_owned()),
        }
    }

    fn is_near(&self, other: &Self) -> bool {
        let near = |a: &f64, b: &f64| (a - b).abs() <= BOUND + 1e-12 * a.abs();
        match (self, other) {
            (Self::Rapid(one), Self::Rapid(two)) | (Self::Feed(one), Self::Feed(two)) => {
                one.iter().zip(two).all(|(a, b)| near(a, b))
            }
            (Self::Rate(one), Self::Rate(two)) => near(one, two),
            (one, two) => one == two,
        }
    }
}

/// Runs a program through the interpreter.
fn events(program: &str) -> Vec<Event> {
    let (ran, mut events, mut rate) = (run(program), Vec::new(), None);
    let mut interpreter = Interpreter::<3>::new();
    let context = Context {
        axes: &[AxisKind::Linear; 3],
        dialect: &Dialect::GRBL,
        laser_mode: false,
        soft_limits: false,
        reach: &[MAX_WORD; 3],
        arcs: ArcMismatch::GRBL,
        own: OwnCodes::NONE,
        tools: ToolTable::NONE,
    };
    for line in &ran.lines {
        let mut commands = Commands::new();
        let line: String = line.split_whitespace().collect();
        let extent = interpreter.interpret(line.as_bytes(), &context, &mut commands);
        extent.unwrap_or_else(|fault| panic!("{line}: {fault:?}"));
        if let Some((_, feed)) = line.split_once('F') {
            let feed: f64 = feed.parse().unwrap();
            if rate.replace(feed) != Some(feed) {
                events.push(Event::Rate(feed));
            }
        }
        for command in &commands {
            if let Command::Line(travel) = command {
                let place = travel.target.map(|at| at.nanos() as f64 * 1e-9);
                events.push(match travel.feed {
                    Feed::Rapid => Event::Rapid(place),
                    _ => Event::Feed(place),
                });
            }
        }
    }
    if let Some(error) = ran.error {
        let line = program.lines().nth(error.line as usize - 1);
        events.push(Event::Refused(line.unwrap().to_owned()));
    }
    events
}

/// Rates count when they change.
fn changes(recorded: Vec<Event>) -> Vec<Event> {
    let mut rate = None;
    let mut is_new = |event: &Event| match event {
        Event::Rate(now) => rate.replace(*now) != Some(*now),
        _ => true,
    };
    recorded.into_iter().filter(|event| is_new(event)).collect()
}

#[test]
fn random_programs_move_as_in_linuxcnc() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/linuxcnc/programs.txt");
    let path = env::var("LINUXCNC_PROGRAMS").unwrap_or_else(|_| folder.to_owned());
    let text = fs::read_to_string(path).unwrap();
    let (mut count, mut moves, mut refusals, mut other) = (0, 0, 0, Vec::new());
    for record in text.split("@ ").skip(1) {
        let (seed, record) = record.split_once('\n').unwrap();
        let (program, answer) = record.split_once("\n=\n").unwrap_or((record, ""));
        let theirs = changes(answer.lines().map(Event::read).collect());
        let ours = events(&format!("{program}\n"));
        count += 1;
        moves += theirs.len();
        refusals += usize::from(matches!(theirs.last(), Some(Event::Refused(_))));
        let same = ours
            .iter()
            .zip(&theirs)
            .take_while(|(one, two)| one.is_near(two))
            .count();
        if same < ours.len().max(theirs.len()) {
            other.push(format!(
                "{seed}: event {same}: {:?}, LinuxCNC {:?}",
                ours.get(same),
                theirs.get(same)
            ));
        }
    }
    println!(
        "{count} programs, {moves} events, {refusals} refusals, {} others",
        other.len()
    );
    assert!(count > 100 && refusals > 5, "{count} {refusals}");
    assert!(other.is_empty(), "{}", other.join("\n"));
}
