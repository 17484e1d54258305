//! Any bytes as lines: nothing panics, and a line that is refused has changed nothing.
//!
//! ```text
//!  first byte: dialect, laser, inches     the rest: lines
//!                                           |
//!   LineReader --> gcode::words, gcode::parse
//!              --> `$…`: SystemCommand::parse, `$J=`: Interpreter::jog
//!              --> Interpreter::check, then Interpreter::interpret
//! ```

#![no_main]

use leadscrew_gcode::{parse, words};
use leadscrew_machine::interpreter::{
    ArcMismatch, AxisKind, Commands, Context, Coordinate, Dialect, Extent, Interpreter, OwnCodes,
    ToolTable,
};
use leadscrew_machine::protocol::line_reader::{LineReader, GRBL_LINE_LENGTH};
use leadscrew_machine::protocol::system_command::{Activity, Circumstances, SystemCommand};
use libfuzzer_sys::fuzz_target;

const AXES: usize = 4;

/// The context that lines depend on, out of one byte.
struct Bench {
    axes: [AxisKind; AXES],
    dialect: Dialect,
    laser_mode: bool,
    soft_limits: bool,
    reach: [Coordinate; AXES],
    circumstances: Circumstances,
    interpreter: Interpreter<AXES>,
    commands: Commands<AXES>,
}

impl Bench {
    fn new(choice: u8) -> Self {
        let chosen = |bit: u8| choice >> bit & 1 != 0;
        let mut axes = [AxisKind::Linear; AXES];
        axes[3] = AxisKind::Rotary;
        let dialect = Dialect {
            mist: chosen(0),
            parking_override: chosen(1),
            ..Dialect::GRBL
        };
        let activities = [
            Activity::Idle,
            Activity::Alarm,
            Activity::Jog,
            Activity::Check,
            Activity::Busy,
        ];
        Self {
            axes,
            dialect,
            laser_mode: chosen(2),
            soft_limits: chosen(3),
            reach: [Coordinate::from_nanos(1_000_000_000_000_000); AXES],
            circumstances: Circumstances {
                activity: activities[usize::from(choice >> 5) % activities.len()],
                homing: chosen(3),
                single_axis_homing: chosen(4),
            },
            interpreter: Interpreter::new(),
            commands: Commands::new(),
        }
    }

    fn line(&mut self, line: &[u8]) {
        spell(line);
        if line.first() == Some(&b'$') {
            self.system(line);
        } else {
            self.program(line);
        }
    }

    fn system(&mut self, line: &[u8]) {
        match SystemCommand::parse(line, &self.circumstances) {
            Ok(SystemCommand::Jog(words)) => self.jog(words),
            Ok(SystemCommand::StoreStartup { line, .. }) => {
                let _ = self.interpreter.check(line, &self.context());
            }
            Ok(_) | Err(_) => {}
        }
    }

    fn jog(&mut self, words: &[u8]) {
        let before = self.interpreter.clone();
        if let Ok(Some(jog)) = self.interpreter.jog(words, &self.context()) {
            self.assert_within_reach(&jog.travel.target);
            self.interpreter.set_position(jog.travel.target);
        } else {
            assert_eq!(self.interpreter, before);
        }
    }

    fn program(&mut self, line: &[u8]) {
        let before = self.interpreter.clone();
        let expected = self.interpreter.check(line, &self.context());
        let context = Context {
            axes: &self.axes,
            dialect: &self.dialect,
            laser_mode: self.laser_mode,
            soft_limits: self.soft_limits,
            reach: &self.reach,
            arcs: ArcMismatch::GRBL,
            own: OwnCodes::NONE,
            tools: ToolTable::NONE,
        };
        let answer = self
            .interpreter
            .interpret(line, &context, &mut self.commands)
            .map(|extent| assert_eq!(extent, Extent::Whole, "there is no extension"));
        assert_eq!(answer, expected, "the check has told the truth");
        match answer {
            Ok(()) => self.assert_within_reach(self.interpreter.position()),
            Err(fault) => {
                assert!(fault.column <= line.len());
                assert!(self.commands.is_empty());
                assert_eq!(self.interpreter, before, "a refused line changes nothing");
            }
        }
    }

    fn context(&self) -> Context<'_, AXES> {
        Context {
            axes: &self.axes,
            dialect: &self.dialect,
            laser_mode: self.laser_mode,
            soft_limits: self.soft_limits,
            reach: &self.reach,
            arcs: ArcMismatch::GRBL,
            own: OwnCodes::NONE,
            tools: ToolTable::NONE,
        }
    }

    /// Within reach, or just beyond it if soft limits are to say so.
    fn assert_within_reach(&self, target: &[Coordinate; AXES]) {
        for (target, reach) in target.iter().zip(&self.reach) {
            let farthest = reach.nanos().unsigned_abs() + u64::from(self.soft_limits);
            assert!(target.nanos().unsigned_abs() <= farthest);
        }
    }
}

/// Both ways of reading words; the printed words of one are read again.
fn spell(line: &[u8]) {
    for error in words(line).filter_map(Result::err) {
        assert!(error.column <= line.len());
    }
    if let Ok(block) = parse(line) {
        if block.checksum().is_none() {
            let printed = block.to_string();
            let again = parse(printed.as_bytes()).expect("what was printed is right");
            assert_eq!(again.words(), block.words(), "{printed}");
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    let Some((choice, bytes)) = bytes.split_first() else {
        return;
    };
    let mut bench = Bench::new(*choice);
    let mut reader = LineReader::<128>::new(GRBL_LINE_LENGTH);
    // Once as it comes, to meet any length and byte, and once line by line through the filter.
    for line in bytes.split(|byte| *byte == b'\n') {
        spell(line);
    }
    for byte in bytes.iter().chain(b"\n") {
        if reader.push(*byte) {
            if let Ok(line) = reader.line() {
                assert!(line.len() <= GRBL_LINE_LENGTH);
                bench.line(line);
            }
            reader.clear();
        }
    }
});
