//! Canned cycles: a command that becomes one stroke after the other.

use super::Progress;
use crate::board::{Board, Instant};
use crate::extension::Extension;
use crate::interpreter::{Cycle, Strokes, Travel};
use crate::machine::Machine;
use crate::settings::table::Setting;
use crate::state::State;
use leadscrew_planner::{Coordinate, Kinematics};

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Begins a cycle: from now on its strokes are the commands of the line. A cycle that would
    /// leave the travel does not begin.
    pub(super) fn perform_cycle<B: Board>(
        &mut self,
        travel: &Travel<AXES>,
        cycle: &Cycle,
        board: &mut B,
        now: Instant,
    ) -> Progress {
        let corners = cycle.corners(&travel.target);
        if !corners.iter().all(|corner| self.is_within_travel(corner)) {
            return self.leave_travel(board, now);
        }
        if self.state != State::Check {
            let clearance = self.settings.value(Setting::PeckClearance);
            let clearance = Coordinate::from_nanos(clearance.nanos());
            let strokes = Strokes::new(&self.motion.path_end, travel, cycle, clearance);
            self.activity.line.cycle = Some(strokes);
        }
        Progress::Done
    }
}
