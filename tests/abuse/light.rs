//! Watches whether the laser is lit in a move that must be dark: a rapid, or the machine's own
//! motion.
//!
//! ```text
//!  move_planned  -->  planned moves, oldest first  --+--> segment_taken: a move begins, dark or lit
//! ```
//!
//! The result is not used if the power leads the motion (`$703`), or a spindle turns.

use leadscrew_machine::explain::PlannedMove;
use leadscrew_planner::MoveKind;
use leadscrew_sim::observer::{Observer, Taken};
use leadscrew_sim::Cycle;
use leadscrew_stepper::Power;
use std::collections::VecDeque;

/// A move of the program: the steps of each motor without sign, and whether the laser may burn in
/// it.
#[derive(Debug, PartialEq, Eq)]
struct Planned {
    steps: Vec<u32>,
    lit: bool,
}

/// Follows the moves that segments belong to.
#[derive(Debug, Default)]
pub(super) struct Light {
    planned: VecDeque<Planned>,
    /// The number of planned moves at the end of the previous turn, less the moves that have
    /// begun since.
    planned_before: usize,
    /// The move of the program that began last. The machine may run it, or the rest of it, again.
    begun: Option<Planned>,
    /// The machine handles an open door: the parking motion begins, which is dark.
    at_door: bool,
    /// A parking motion has begun since then: the next move may be the rest of the interrupted
    /// move.
    parked: bool,
    may_burn: bool,
    /// The time at which the laser was lit in a dark move.
    wrong: Option<Cycle>,
}

impl Light {
    /// The time at which the laser was lit in a dark move since the last call, if it was.
    pub(super) fn take_wrong(&mut self) -> Option<Cycle> {
        self.wrong.take()
    }

    /// Call this after a turn of the main loop. `at_door`: the machine handles an open door.
    /// `dropped`: planned moves were dropped in this turn. Moves planned in the same turn may have
    /// been dropped or not, so they are not checked.
    pub(super) fn end_turn(&mut self, at_door: bool, dropped: bool) {
        self.at_door = at_door;
        if dropped {
            self.planned
                .drain(..self.planned_before.min(self.planned.len()));
            self.planned.iter_mut().for_each(|of| of.lit = true);
        }
        self.planned_before = self.planned.len();
    }

    /// A move begins. The moves of a laser row are planned one by one, and the last of them has all
    /// the steps.
    fn begin(&mut self, steps: &[u32]) {
        if let Some(last) = self.planned.iter().position(|of| of.steps == steps) {
            let lit = self.planned.drain(..=last).any(|of| of.lit);
            let steps = steps.to_vec();
            self.begun = Some(Planned { steps, lit });
            self.parked = false;
        } else if self.at_door {
            self.parked = true;
        }
        let back = !self.at_door && std::mem::take(&mut self.parked);
        let begun = self
            .begun
            .as_mut()
            .filter(|of| of.steps == steps || back && is_rest(steps, &of.steps));
        self.may_burn = begun.is_some_and(|of| {
            of.steps = steps.to_vec();
            of.lit
        });
    }
}

/// Returns true if a line of `rest` steps may be the remaining part of a line of `all` steps: its
/// motors have the same ratios, to the nearest step.
fn is_rest(rest: &[u32], all: &[u32]) -> bool {
    let events = |line: &[u32]| i64::from(line.iter().copied().max().unwrap_or(0));
    let (left, whole) = (events(rest), events(all));
    rest.iter().zip(all).all(|(rest, all)| {
        let off = i64::from(*rest) * whole - i64::from(*all) * left;
        rest <= all && off.abs() <= whole
    })
}

/// Returns true if a laser may burn in motion of this kind. Grbl lets it burn in a jog, too.
fn burns(kind: MoveKind) -> bool {
    match kind {
        MoveKind::Feed | MoveKind::Jog => true,
        MoveKind::Rapid | MoveKind::System => false,
    }
}

impl Observer for Light {
    fn move_planned(&mut self, planned: &PlannedMove<'_>) {
        self.planned.push_back(Planned {
            steps: planned
                .steps
                .iter()
                .map(|steps| steps.unsigned_abs())
                .collect(),
            lit: planned.power > Power::OFF && burns(planned.kind),
        });
    }

    fn segment_taken(&mut self, cycle: Cycle, taken: Option<&Taken<'_>>) {
        let Some(taken) = taken else { return };
        if let Some(steps) = taken.line {
            self.begin(steps);
        }
        if !self.may_burn && taken.power.iter().any(|power| *power > 0.0) {
            self.wrong.get_or_insert(cycle);
        }
    }
}
