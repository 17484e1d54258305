//! Reads the first lines of a G-code file and plans their moves, nothing else: what a line costs
//! from its bytes to its planned move, for a profiler to count.
//!
//! ```text
//! cargo xtask bench target/fast/examples/plan_lines raster.gcode {lines}
//! ```
//!
//! Line reader, interpreter and planner are those of the machine; the queue is emptied whenever it
//! is full. Settings: 250 steps/mm, 2000 mm/min, 200 mm/s², as in `bench/settings/mid.json`, and
//! the corner rule that a machine has from the start. A third argument `grbl` takes Grbl's.

use leadscrew_machine::interpreter::{
    ArcMismatch, AxisKind, Command, Commands, Context, Dialect, Feed, Interpreter, OwnCodes,
    ToolTable, MAX_WORD,
};
use leadscrew_machine::protocol::line_reader::{LineReader, GRBL_LINE_LENGTH};
use leadscrew_planner::StepsPerMm;
use leadscrew_planner::{
    self as planner, Cartesian, Config, CornerRule, Move, MoveKind, MovePower, Planner,
    THREE_DECIMALS,
};
use leadscrew_stepper::{OutputChange, Ticks};
use std::hint::black_box;

const AXES: usize = 3;
const MOVES: usize = 1024;

type Queue<'q> = Planner<'q, Cartesian, AXES, AXES>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(file), Some(count)) = (arguments.next(), arguments.next()) else {
        return Err("usage: plan_lines FILE LINES [grbl]".into());
    };
    let rule = match arguments.next().as_deref() {
        None => CornerRule::Limits,
        Some("grbl") => CornerRule::Grbl,
        Some(other) => return Err(format!("no corner rule: {other}").into()),
    };
    let (text, count) = (std::fs::read(file)?, count.parse()?);
    let mut room = planner::Queue::<AXES, AXES, MOVES>::new();
    let mut pixels = planner::PixelQueue::<1>::new();
    let mut queue = Queue::new(config(rule), Cartesian, &mut room, &mut pixels)?;
    let mut interpreter = Interpreter::new();
    let mut planned = 0;
    for line in text.split_inclusive(|byte| *byte == b'\n').take(count) {
        planned += plan_line(line, &mut interpreter, &mut queue);
    }
    println!("{planned} moves planned");
    Ok(())
}

fn config(corner_rule: CornerRule) -> Config<AXES> {
    Config {
        steps_per_mm: [StepsPerMm::from_nanos(250_000_000_000); AXES],
        max_rate: [2000.0 / 60.0; AXES],
        acceleration: [200.0; AXES],
        jerk: 0.0,
        resonance: 0.0,
        junction_deviation: 0.010,
        corner_rule,
        arc_tolerance: 0.002,
        timer_hz: 84_000_000,
        shortest_tick: Ticks(840),
        longest_segment: 1e-3,
        moves: MOVES,
        pixels: 0,
    }
}

/// Takes a line from its bytes to its planned moves; returns how many they are.
#[inline(never)]
fn plan_line(bytes: &[u8], interpreter: &mut Interpreter<AXES>, queue: &mut Queue<'_>) -> u32 {
    let mut reader = LineReader::<128>::new(GRBL_LINE_LENGTH);
    for byte in bytes {
        reader.push(*byte);
    }
    let context = Context {
        axes: &[AxisKind::Linear; AXES],
        dialect: &Dialect::GRBL,
        laser_mode: true,
        soft_limits: false,
        reach: &[MAX_WORD; AXES],
        arcs: ArcMismatch::GRBL,
        own: OwnCodes::NONE,
        tools: ToolTable::NONE,
    };
    let mut commands = Commands::new();
    let line = reader.line().unwrap_or_default();
    if interpreter
        .interpret(line, &context, &mut commands)
        .is_err()
    {
        return 0;
    }
    let mut planned = 0;
    for command in &commands {
        if let Command::Line(travel) = command {
            planned += 1;
            push(queue, travel.target, travel.feed);
        }
    }
    black_box(planned)
}

fn push(queue: &mut Queue, target: [planner::Coordinate; AXES], feed: Feed) {
    if !queue.has_room() {
        let end = queue.position();
        queue.clear();
        queue.set_position(end);
    }
    let (feed, kind) = match feed {
        Feed::Rapid => (planner::Feed::Rapid, MoveKind::Rapid),
        Feed::PerMinute(mm) => (planner::Feed::PerMinute(mm.to_f32() / 60.0), MoveKind::Feed),
        Feed::InverseTime(rate) => (
            planner::Feed::InverseTime(rate.to_f32() / 60.0),
            MoveKind::Feed,
        ),
    };
    let next = Move {
        target,
        feed,
        power: MovePower::Off,
        curve: None,
        rounding: THREE_DECIMALS,
        outputs: OutputChange::NONE,
        line_number: None,
        kind,
    };
    let _ = black_box(queue.push(&next));
}
