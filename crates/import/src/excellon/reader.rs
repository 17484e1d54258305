//! The state of a file that is being read, and the shapes read so far.

use super::fact::{Place, Source};
use super::format::{Format, Known, Notes, Units, Zeros};
use super::shape::{Cut, Shape};
use super::tool::Tool;
use super::word::Word;
use super::wrong::Wrong;
use super::{Drawing, Hit};
use crate::{Fault, Mm, Point};
use std::collections::BTreeMap;

/// The most shapes: more than any board has. The limit is needed because a repeat may ask for any
/// number.
pub(super) const MOST_HITS: usize = 100_000;
pub(super) const TOO_MANY: &str = "more than 100000 holes";

/// The meaning of coordinates.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Mode {
    /// A hole.
    Drill,
    /// A move above the board.
    Up(Motion),
    /// A cut of the path that was begun at this point.
    Down(Motion, Point),
}

/// The router's mode of motion.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Motion {
    /// `G00`.
    Rapid,
    /// `G01`.
    Line,
    /// `G02`, or `G03` in the other direction.
    Arc {
        /// True if it is clockwise (`G02`).
        is_clockwise: bool,
    },
}

/// The part of a file that the reader is in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Stage {
    /// Nothing but comments so far.
    Start,
    /// After `M48`.
    Header,
    /// After the header, or in a file without a header.
    Body,
    /// After `M30` or `M00`.
    Ended,
}

/// The state left by the statements so far; the meaning of a statement depends on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    pub(super) format: Format,
    pub(super) stage: Stage,
    pub(super) is_incremental: bool,
    /// The tool in the spindle.
    pub(super) tool: Option<u32>,
    pub(super) mode: Mode,
    /// The tool's place.
    pub(super) at: Point,
}

/// Reads a file line by line. A line with a fault changes nothing.
pub(super) struct Reader {
    pub(super) now: State,
    /// Cuts of the path that is not finished yet.
    pub(super) cuts: Vec<Cut>,
    pub(super) line: usize,
    /// Diameters that comments state by the tools' numbers, each with its line.
    pub(super) listed: BTreeMap<u32, (Mm, usize)>,
    pub(super) drawing: Drawing,
    pub(super) notes: Notes,
    pub(super) faults: Vec<Fault>,
}

impl Reader {
    pub(super) fn new(
        known: &Known,
        shown: Option<(Zeros, usize)>,
        ahead: Option<(Units, usize)>,
    ) -> Self {
        let now = State {
            format: Format::new(known, shown, ahead),
            stage: Stage::Start,
            is_incremental: false,
            tool: None,
            mode: Mode::Drill,
            at: Point::ORIGIN,
        };
        Self {
            now,
            cuts: Vec::new(),
            line: 1,
            listed: BTreeMap::new(),
            drawing: Drawing::default(),
            notes: Notes::default(),
            faults: Vec::new(),
        }
    }

    /// Called at a statement that only a body has: it ends a header whose `%` is missing.
    pub(super) fn begin_body(&mut self) {
        if self.now.stage == Stage::Header {
            self.notes.add("the header has no end (%)");
        }
        self.now.stage = Stage::Body;
    }

    /// Takes the facts about the file's numbers that a statement at `column` has.
    pub(super) fn said(
        &mut self,
        said: &Known,
        column: usize,
        source: Source,
    ) -> Result<(), Wrong> {
        let at = Place {
            source,
            line: self.line,
            is_in_header: matches!(self.now.stage, Stage::Start | Stage::Header),
        };
        let taken = self.now.format.take(said, at, &mut self.notes);
        taken.map_err(|message| Wrong::at(column, message))
    }

    /// The point that X and Y words give, starting from `from`: a missing coordinate stays the
    /// same.
    pub(super) fn target(&mut self, words: &[Word], from: Point) -> Result<Point, Wrong> {
        let (mut x, mut y) = (None, None);
        for word in words {
            let slot = match word.letter {
                'X' => &mut x,
                'Y' => &mut y,
                _ => return Err(word.wrong("not understood here; X and Y are")),
            };
            if slot.is_some() {
                return Err(word.wrong("stands twice in this line"));
            }
            *slot = Some(self.now.format.coordinate(word, &mut self.notes)?);
        }
        let way = Point {
            x: x.unwrap_or_default(),
            y: y.unwrap_or_default(),
        };
        let target = if self.now.is_incremental {
            from + way
        } else {
            Point {
                x: x.unwrap_or(from.x),
                y: y.unwrap_or(from.y),
            }
        };
        self.reachable(words, target)
    }

    fn reachable(&self, words: &[Word], target: Point) -> Result<Point, Wrong> {
        let limit = Mm::LIMIT;
        if target.x.abs() <= limit && target.y.abs() <= limit {
            return Ok(target);
        }
        let column = words.first().map_or(1, |word| word.column);
        Err(Wrong::at(
            column,
            "this place is further than 100 m from zero",
        ))
    }

    /// Adds a shape that the tool in the spindle makes.
    pub(super) fn hit(&mut self, words: &[Word], shape: Shape) -> Result<(), Wrong> {
        let column = words.first().map_or(1, |word| word.column);
        let Some(tool) = self.now.tool else {
            return Err(Wrong::at(
                column,
                "no tool was chosen for this hole: add a line such as T1 above it",
            ));
        };
        if self.drawing.tools.get(&tool).is_some_and(Tool::is_empty) {
            let message =
                format!("T{tool} has a diameter of 0: give it its diameter, as in T{tool}C0.8");
            return Err(Wrong::at(column, message));
        }
        if self.drawing.hits.len() == MOST_HITS {
            return Err(Wrong::at(column, TOO_MANY));
        }
        self.now.at = shape.to();
        let line = u32::try_from(self.line).unwrap_or(u32::MAX);
        self.drawing.hits.push(Hit { tool, line, shape });
        Ok(())
    }
}
