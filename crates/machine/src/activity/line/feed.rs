//! The feed of a move for the planner, and `G92 E0`, which does not wait for motion to end.

use crate::config::extruder;
use crate::machine::Machine;
use crate::motion::measure::{is_plain, Measure};
use leadscrew_planner::{self as planner, Coordinate};

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X> {
    /// The length of the path of all axes to `target`, divided by the length that F counts.
    pub(crate) fn stretch_to(&self, target: &[Coordinate; AXES]) -> f32 {
        if is_plain(&self.config.axes) {
            return 1.0;
        }
        let mut ways = [0.0; AXES];
        let ends = target.iter().zip(&self.motion.path_end);
        for (way, (to, from)) in ways.iter_mut().zip(ends) {
            *way = (*to - *from).to_mm();
        }
        Measure::of(&self.config.axes, &ways).stretch
    }

    /// The feed that the planner gets for a straight move to `target`.
    pub(crate) fn feed_to(
        &self,
        target: &[Coordinate; AXES],
        feed: planner::Feed,
    ) -> planner::Feed {
        stretched(feed, self.stretch_to(target))
    }

    /// Returns true if a work offset differs from the present one in no axis but the extruder's.
    pub(super) fn is_offset_of_e(&self, offset: &[Coordinate; AXES]) -> bool {
        let Some(e) = extruder(&self.config.axes) else {
            return false;
        };
        let mut parts = offset.iter().zip(&self.program.work_offset).enumerate();
        parts.all(|(axis, (new, old))| axis == e || new == old)
    }
}

/// The feed along the path of all axes: `feed` is that of the axes that F counts.
pub(crate) fn stretched(feed: planner::Feed, stretch: f32) -> planner::Feed {
    match feed {
        planner::Feed::PerMinute(rate) => planner::Feed::PerMinute(rate * stretch),
        planner::Feed::InverseTime(_) | planner::Feed::Rapid => feed,
    }
}
