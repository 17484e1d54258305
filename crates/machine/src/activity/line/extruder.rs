//! Moves of a machine with an extruder: the feed is the speed of the other axes, and `G92 E0` does
//! not wait for motion to end.
//!
//! ```text
//!   G1 X30 Y40 E10 F3000     50 mm at 3000 mm/min: one second. The path of all four axes has
//!                            51 mm, and is planned at 3059 mm/min.
//!   G1 E-2 F1800             no other axis moves: E moves at the feed
//! ```

use crate::config::{extruder, WITHOUT_EXTRUDER};
use crate::machine::Machine;
use leadscrew_planner::{self as planner, Coordinate};

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X> {
    /// The feed that the planner gets for a move to `target`: speed along the path of all axes.
    /// `feed` is the speed along the path without the extruder.
    pub(super) fn feed_beside_e(
        &self,
        feed: planner::Feed,
        target: &[Coordinate; AXES],
    ) -> planner::Feed {
        match feed {
            planner::Feed::PerMinute(rate) if AXES > WITHOUT_EXTRUDER => {
                planner::Feed::PerMinute(rate * self.stretch(target))
            }
            planner::Feed::PerMinute(_) | planner::Feed::InverseTime(_) | planner::Feed::Rapid => {
                feed
            }
        }
    }

    /// The length of the path of all axes to `target`, divided by its length without the extruder;
    /// 1 where no other axis moves.
    fn stretch(&self, target: &[Coordinate; AXES]) -> f32 {
        let Some(e) = extruder(&self.config.axes) else {
            return 1.0;
        };
        let ways = target.iter().zip(&self.motion.path_end);
        let (mut others, mut filament) = (0.0, 0.0);
        for (axis, (to, from)) in ways.enumerate() {
            let way = (*to - *from).to_mm();
            match axis == e {
                true => filament = way * way,
                false => others += way * way,
            }
        }
        match others > 0.0 {
            true => libm::sqrtf(1.0 + filament / others),
            false => 1.0,
        }
    }

    /// Whether a work offset differs from the present one in no axis but the extruder's.
    pub(super) fn is_offset_of_e(&self, offset: &[Coordinate; AXES]) -> bool {
        let Some(e) = extruder(&self.config.axes) else {
            return false;
        };
        let mut parts = offset.iter().zip(&self.program.work_offset).enumerate();
        parts.all(|(axis, (new, old))| axis == e || new == old)
    }
}
