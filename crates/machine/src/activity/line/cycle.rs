//! Canned cycles: a command that becomes one stroke after the other.

use super::Progress;
use crate::board::{Board, Instant};
use crate::extension::Extension;
use crate::interpreter::{Cycle, Strokes, Travel};
use crate::machine::Machine;
#[cfg(feature = "cycles")]
use crate::settings::table::Setting;
use crate::settings::values::Settings;
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
            let clearance = clearance(&self.settings);
            let strokes = Strokes::new(&self.motion.path_end, travel, cycle, clearance);
            self.activity.line.cycle = Some(strokes);
        }
        Progress::Done
    }
}

/// How far a peck goes back.
#[cfg(feature = "cycles")]
fn clearance<const AXES: usize>(settings: &Settings<AXES>) -> Coordinate {
    Coordinate::from_nanos(settings.value(Setting::PeckClearance).nanos())
}

/// A build without cycles makes no pecks.
#[cfg(not(feature = "cycles"))]
fn clearance<const AXES: usize>(_: &Settings<AXES>) -> Coordinate {
    Coordinate::ZERO
}
