//! Grbl's answers and actions, line by line: the rules of the recorded conversations as tables.

mod axis_words;
mod cycles;
mod extruder;
mod jogs;
mod linuxcnc;
mod motion;
mod offsets;
mod program;
mod properties;
mod spindle;
mod whole_lines;
mod word_by_word;

use super::*;
use crate::AxisKind;
use std::string::{String, ToString};
use std::vec::Vec;

/// An interpreter and all that its lines depend on.
#[derive(Debug, Clone)]
pub(super) struct Bench<const AXES: usize> {
    pub(super) interpreter: Interpreter<AXES>,
    pub(super) dialect: Dialect,
    pub(super) axes: [AxisKind; AXES],
    pub(super) laser_mode: bool,
    pub(super) soft_limits: bool,
    pub(super) reach: [Coordinate; AXES],
}

impl<const AXES: usize> Bench<AXES> {
    /// As at power-up, of linear axes and by Grbl's own words.
    pub(super) fn new() -> Self {
        Self {
            interpreter: Interpreter::new(),
            dialect: Dialect::default(),
            axes: [AxisKind::Linear; AXES],
            laser_mode: false,
            soft_limits: false,
            reach: [mm(1e6); AXES],
        }
    }

    /// A bench that has carried out these lines.
    pub(super) fn after(lines: &[&str]) -> Self {
        let mut bench = Self::new();
        for line in lines {
            bench.run(line);
        }
        bench
    }

    pub(super) fn send(&mut self, line: &[u8]) -> Result<Commands<AXES>, Fault> {
        let mut commands = Commands::new();
        let mut interpreter = self.interpreter.clone();
        let answer = interpreter.interpret(line, &self.context(), &mut commands);
        self.interpreter = interpreter;
        answer.map(|_| commands)
    }

    pub(super) fn jog(&self, line: &str) -> Result<Option<Jog<AXES>>, Fault> {
        self.interpreter.jog(line.as_bytes(), &self.context())
    }

    pub(super) fn context(&self) -> Context<'_, AXES> {
        Context {
            axes: &self.axes,
            dialect: &self.dialect,
            laser_mode: self.laser_mode,
            soft_limits: self.soft_limits,
            reach: &self.reach,
            arcs: ArcMismatch::GRBL,
            own: OwnCodes::NONE,
            tools: match self.dialect.tools {
                true => ToolTable::some(&length_of_tool),
                false => ToolTable::NONE,
            },
        }
    }

    /// Carries out a line that must be right, and answers its commands in words.
    pub(super) fn run(&mut self, line: &str) -> Vec<String> {
        match self.send(line.as_bytes()) {
            Ok(commands) => commands.iter().map(ToString::to_string).collect(),
            Err(fault) => panic!("{line}: {fault}"),
        }
    }

    /// Carries out a line and answers Grbl's number: 0 for `ok`, or the number of the error.
    pub(super) fn answer(&mut self, line: &str) -> u8 {
        match self.send(line.as_bytes()) {
            Ok(_) => 0,
            Err(fault) => fault.status.number(),
        }
    }

    /// Carries out lines in turn and compares their answers.
    #[track_caller]
    pub(super) fn expect(&mut self, answers: &[(&str, u8)]) {
        for (line, expected) in answers {
            assert_eq!(self.answer(line), *expected, "{line}");
        }
    }

    /// The words of `$G`.
    pub(super) fn modes(&self) -> String {
        let modal = self.interpreter.modal();
        std::format!("{modal} T{} F{} S{}", modal.tool, modal.feed, modal.speed)
    }

    pub(super) fn position(&self) -> [f64; AXES] {
        self.interpreter.position().map(to_mm)
    }
}

/// Answers lines at power-up, each on a fresh machine.
#[track_caller]
pub(super) fn expect_at_power_up(answers: &[(&str, u8)]) {
    for answer in answers {
        Bench::<3>::new().expect(&[*answer]);
    }
}

/// The table of a machine with tools: number 1 is in the spindle, 3 mm long; 2 is 5 mm long.
fn length_of_tool(tool: Option<u32>) -> Option<Coordinate> {
    match tool {
        None | Some(1) => Some(mm(3.0)),
        Some(2) => Some(mm(5.0)),
        Some(_) => None,
    }
}

pub(super) fn mm(value: f64) -> Coordinate {
    Coordinate::from_nanos((value * 1e9).round() as i64)
}

pub(super) fn to_mm(value: Coordinate) -> f64 {
    value.nanos() as f64 / 1e9
}
