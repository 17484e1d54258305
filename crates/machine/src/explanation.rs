//! The machine tells a board's [`Explain`](crate::explain::Explain) how it plans.

use crate::board::Board;
use crate::explain::{Ahead, Committed, PlannedMove};
use crate::extension::Extension;
use crate::machine::Machine;
use leadscrew_planner::{self as planner, Kinematics, Move};

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Tells the explainer of a move that has just been queued. To be called while `path_end` is
    /// still the beginning of the move.
    pub(crate) fn explain_move<B: Board>(&self, of: &Move<AXES>, board: &mut B) {
        let (Some(explainer), Some(outline)) = (board.explainer(), self.motion.newest()) else {
            return;
        };
        explainer.move_planned(&PlannedMove {
            begin: &self.motion.path_end,
            target: &of.target,
            kind: of.kind,
            power: of.power.programmed(),
            is_laser: self.tool.spindle.is_laser(),
            speed_limit: self.motion.arc_speed(of),
            line: self.work.lines,
            steps: &outline.steps,
            acceleration: outline.acceleration,
            rate: outline.rate,
            feed: outline.feed,
        });
    }

    /// Tells the explainer of the segments made since [`crate::work::Work::segments`] was `before`.
    pub(crate) fn explain_segments<B: Board>(&self, before: u32, board: &mut B) {
        let count = self.work.segments.wrapping_sub(before);
        if count == 0 {
            return;
        }
        if let Some(explainer) = board.explainer() {
            explainer.segments_made(count, &|| self.committed());
        }
    }

    /// Motion at the end of the segment that was made last.
    fn committed(&self) -> Committed {
        let (speed, ahead) = self.motion.committed();
        let waits = self.activity.line.is_busy() && !self.activity.line.moves_next();
        Committed {
            speed,
            ahead: match ahead {
                planner::Ahead::QueueEnd { .. } if waits => Ahead::Stop,
                planner::Ahead::QueueEnd { full: true } => Ahead::LookAhead,
                planner::Ahead::QueueEnd { full: false } => Ahead::NoLine,
                planner::Ahead::Corner => Ahead::Corner,
                planner::Ahead::Curve => Ahead::Curve,
                planner::Ahead::SlowerMove => Ahead::SlowerMove,
            },
        }
    }
}
