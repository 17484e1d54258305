//! Whether light goes with a move that has none: a rapid, or the machine's own motion.
//!
//! ```text
//!  move_planned  -->  planned moves, oldest first  --+--> segment_taken: a move begins, dark or lit
//! ```
//!
//! Where the power leads the motion (`$703`), or a spindle turns, nobody asks.

use leadscrew_machine::explain::PlannedMove;
use leadscrew_planner::MoveKind;
use leadscrew_sim::observer::{Observer, Taken};
use leadscrew_sim::Cycle;
use leadscrew_stepper::Power;
use std::collections::VecDeque;

/// A move of the program: the steps of each motor, whichever way, and whether light goes with it.
#[derive(Debug, PartialEq, Eq)]
struct Planned {
    steps: Vec<u32>,
    lit: bool,
}

/// Follows the moves that segments belong to.
#[derive(Debug, Default)]
pub(super) struct Light {
    planned: VecDeque<Planned>,
    /// How many of them there were at the end of the turn before, less those that have begun.
    planned_before: usize,
    /// The program's move that was begun last: the machine may come back to it, or to its rest.
    begun: Option<Planned>,
    /// A door is dealt with: parking begins, which is dark.
    at_door: bool,
    /// A line of parking has begun since: the next move may be the rest of the move that it cut.
    parked: bool,
    may_burn: bool,
    /// When a dark move was lit.
    wrong: Option<Cycle>,
}

impl Light {
    /// When a dark move was lit since this was asked last.
    pub(super) fn take_wrong(&mut self) -> Option<Cycle> {
        self.wrong.take()
    }

    /// After a turn of the main loop; `at_door`: a door is dealt with; `dropped`: in this turn,
    /// what was planned was dropped. Moves planned in the same turn may have been dropped or not:
    /// nobody asks about them.
    pub(super) fn end_turn(&mut self, at_door: bool, dropped: bool) {
        self.at_door = at_door;
        if dropped {
            self.planned
                .drain(..self.planned_before.min(self.planned.len()));
            self.planned.iter_mut().for_each(|of| of.lit = true);
        }
        self.planned_before = self.planned.len();
    }

    /// A row's moves are planned one by one, the last of them with all the steps.
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

/// Whether a line of `rest` steps leads to the end of one of `all` steps: as far in each motor's
/// share, to the nearest step.
fn is_rest(rest: &[u32], all: &[u32]) -> bool {
    let events = |line: &[u32]| i64::from(line.iter().copied().max().unwrap_or(0));
    let (left, whole) = (events(rest), events(all));
    rest.iter().zip(all).all(|(rest, all)| {
        let off = i64::from(*rest) * whole - i64::from(*all) * left;
        rest <= all && off.abs() <= whole
    })
}

/// Whether a laser may burn in motion of this kind: in a jog it does in Grbl, too.
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
