//! Between axes and motors: the end of the queue, and the steps of a target.

use super::Planner;
use crate::{Coordinate, Kinematics};

impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Where the last queued move ends, in steps of each motor.
    pub const fn position(&self) -> [i32; MOTORS] {
        self.position
    }

    /// Sets where the motors stand. At rest with an empty queue only.
    pub fn set_position(&mut self, steps: [i32; MOTORS]) {
        self.position = steps;
        self.forget_direction();
    }

    /// As [`Planner::steps_at`]. Computes only the steps of motors whose place has changed since
    /// the last call.
    pub(super) fn approach(&mut self, axes: &[Coordinate; AXES]) -> Option<[i32; MOTORS]> {
        let motors = self.kinematics.motors(axes).into_iter();
        let scales = motors.zip(self.scales.steps_per_mm);
        for (known, (motor, scale)) in self.target.iter_mut().zip(scales) {
            if known.0 != motor {
                *known = (motor, scale.steps(motor)?);
            }
        }
        Some(self.target.map(|(_, steps)| steps))
    }

    /// Places of the motors, in steps, for the places `axes` of the axes; `None` if a place is
    /// beyond `i32`.
    pub fn steps_at(&self, axes: &[Coordinate; AXES]) -> Option<[i32; MOTORS]> {
        let motors = self.kinematics.motors(axes);
        let mut steps = [0; MOTORS];
        for ((steps, motor), scale) in steps.iter_mut().zip(motors).zip(self.scales.steps_per_mm) {
            *steps = scale.steps(motor)?;
        }
        Some(steps)
    }

    /// Places of the axes for the places `steps` of the motors.
    pub fn axes_at(&self, steps: &[i32; MOTORS]) -> [Coordinate; AXES] {
        let mut motors = [Coordinate::ZERO; MOTORS];
        for ((motor, steps), scale) in motors.iter_mut().zip(steps).zip(self.scales.steps_per_mm) {
            *motor = scale.coordinate(*steps);
        }
        self.kinematics.axes(&motors)
    }

    /// `steps`, with every second motor of an axis put to the place of the axis's own motor. Both
    /// must have the same count before a move, because a move brings both to the same count.
    pub fn ganged(&self, steps: [i32; MOTORS]) -> [i32; MOTORS] {
        let mut ganged = steps;
        for (motor, place) in ganged.iter_mut().enumerate() {
            let own = steps.get(self.kinematics.axis_of(motor));
            *place = own.copied().unwrap_or(*place);
        }
        ganged
    }
}
