//! The moves of a canned cycle, one at a time.

use super::holes::Cycle;
use super::kind::CycleKind;
use crate::command::{Command, Feed, Spindle, Travel};
use crate::modal_state::Rotation;
use leadscrew_planner::Coordinate;

/// The rest of a cycle: lines, dwells and spindle commands, made as they are asked for.
///
/// A move may end where the one before it ended, since each hole has the same strokes.
#[derive(Debug, Clone)]
pub struct Strokes<const AXES: usize> {
    cycle: Cycle,
    /// The travel of the cycle's line: its end is the cycle's end.
    travel: Travel<AXES>,
    clearance: Coordinate,
    /// The end of the last stroke.
    at: [Coordinate; AXES],
    /// The level that this hole has reached so far, machine coordinate.
    depth: Coordinate,
    /// Holes that come after this one.
    left: u16,
    stage: Stage,
}

/// The stroke that comes next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// Straight up to the R level.
    Lift,
    /// Over the hole.
    Over,
    /// Down to the R level.
    Approach,
    /// Into the material.
    Cut,
    /// Back after a peck.
    Out,
    /// Down again, to just above the bottom of the peck before.
    In,
    Dwell,
    StopSpindle,
    Back,
    /// G85: from the R level to the end of the cycle.
    Rise,
    StartSpindle,
    End,
}

impl<const AXES: usize> Strokes<AXES> {
    /// Begins a cycle at `start`, machine coordinates. `clearance`, mm: how far G73 goes back after
    /// a peck, and how far above the bottom of the peck before G83 begins to feed again. Neither
    /// goes above the R level.
    pub fn new(
        start: &[Coordinate; AXES],
        travel: &Travel<AXES>,
        cycle: &Cycle,
        clearance: Coordinate,
    ) -> Self {
        Self {
            cycle: *cycle,
            travel: *travel,
            clearance,
            at: *start,
            depth: cycle.clear,
            left: cycle.repeats.saturating_sub(1),
            stage: Stage::Lift,
        }
    }

    /// Returns true if no stroke is left.
    pub fn is_over(&self) -> bool {
        self.stage == Stage::End
    }

    /// Makes the stroke of this stage, and goes on to the next stage. `None` if this cycle has
    /// no stroke in this stage.
    fn make(&mut self) -> Option<Command<AXES>> {
        let (kind, clear) = (self.cycle.kind, self.cycle.clear);
        match self.stage {
            Stage::Lift => {
                self.stage = Stage::Over;
                let lifts = self.cycle.lifts && self.level() < clear;
                lifts.then(|| self.rapid(clear))
            }
            Stage::Over => {
                self.stage = Stage::Approach;
                Some(self.over())
            }
            Stage::Approach => {
                self.stage = Stage::Cut;
                Some(self.rapid(clear))
            }
            Stage::Cut => Some(self.cut()),
            Stage::Out if kind == CycleKind::Peck => {
                self.stage = Stage::In;
                Some(self.rapid(clear))
            }
            Stage::Out | Stage::In => {
                self.stage = Stage::Cut;
                Some(self.rapid((self.depth + self.clearance).min(clear)))
            }
            Stage::Dwell => {
                self.stage = Stage::StopSpindle;
                kind.dwells().then_some(Command::Dwell(self.cycle.value))
            }
            Stage::StopSpindle => {
                self.stage = Stage::Back;
                self.stops_spindle()
                    .then(|| Command::Spindle(self.spindle()))
            }
            Stage::Back => Some(self.back()),
            Stage::Rise => {
                self.end_hole();
                Some(self.rapid(self.cycle.level(&self.travel.target)))
            }
            Stage::StartSpindle => {
                self.end_hole();
                Some(Command::Spindle(self.spindle()))
            }
            Stage::End => None,
        }
    }

    /// Rapid to the next hole: no lower than the tool is now, and no lower than the level to which
    /// it goes back.
    fn over(&mut self) -> Command<AXES> {
        let level = self.level().max(self.cycle.level(&self.travel.target));
        self.go(
            self.cycle.hole(&self.travel.target, self.left, level),
            Feed::Rapid,
        )
    }

    /// Feeds to the bottom, or a peck deeper.
    fn cut(&mut self) -> Command<AXES> {
        let bottom = self.cycle.bottom;
        let peck = Coordinate::from_nanos(self.cycle.value.nanos());
        self.depth = match self.cycle.kind.pecks() {
            true => (self.depth - peck).max(bottom),
            false => bottom,
        };
        self.stage = match self.depth > bottom {
            true => Stage::Out,
            false => Stage::Dwell,
        };
        self.feed(self.depth)
    }

    /// Goes back to the level at which the cycle ends: G85 at the feed rate as far as the R level,
    /// G89 all the way.
    fn back(&mut self) -> Command<AXES> {
        let level = self.cycle.level(&self.travel.target);
        let (back, next) = match self.cycle.kind {
            CycleKind::Bore => (self.feed(self.cycle.clear), Stage::Rise),
            CycleKind::BoreDwell => (self.feed(level), Stage::End),
            CycleKind::BoreStop => (self.rapid(level), Stage::StartSpindle),
            CycleKind::ChipBreak | CycleKind::Drill | CycleKind::DrillDwell | CycleKind::Peck => {
                (self.rapid(level), Stage::End)
            }
        };
        match next {
            Stage::End => self.end_hole(),
            next => self.stage = next,
        }
        back
    }

    fn end_hole(&mut self) {
        self.stage = Stage::End;
        if let Some(left) = self.left.checked_sub(1) {
            self.left = left;
            self.depth = self.cycle.clear;
            self.stage = Stage::Over;
        }
    }

    fn stops_spindle(&self) -> bool {
        self.cycle.kind == CycleKind::BoreStop
    }

    /// The spindle in this stage: G86 goes back with the spindle stopped.
    fn spindle(&self) -> Spindle {
        let rotation = match self.stage == Stage::Back && self.stops_spindle() {
            true => Rotation::Off,
            false => self.travel.spindle.rotation,
        };
        Spindle {
            rotation,
            ..self.travel.spindle
        }
    }

    fn level(&self) -> Coordinate {
        self.cycle.level(&self.at)
    }

    fn rapid(&mut self, level: Coordinate) -> Command<AXES> {
        self.along(level, Feed::Rapid)
    }

    fn feed(&mut self, level: Coordinate) -> Command<AXES> {
        self.along(level, self.travel.feed)
    }

    /// Goes along the tool's axis.
    fn along(&mut self, level: Coordinate, feed: Feed) -> Command<AXES> {
        self.go(self.cycle.at_level(&self.at, level), feed)
    }

    fn go(&mut self, target: [Coordinate; AXES], feed: Feed) -> Command<AXES> {
        self.at = target;
        Command::Line(Travel {
            target,
            feed,
            spindle: self.spindle(),
            line_number: self.travel.line_number,
        })
    }
}

impl<const AXES: usize> Iterator for Strokes<AXES> {
    type Item = Command<AXES>;

    fn next(&mut self) -> Option<Command<AXES>> {
        while !self.is_over() {
            if let Some(stroke) = self.make() {
                return Some(stroke);
            }
        }
        None
    }
}
