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

    /// As [`Planner::steps_at`], but only for motors whose place differs from the last time.
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

    /// Where the motors stand, in steps, where the axes stand at `axes`; `None` beyond `i32`.
    pub fn steps_at(&self, axes: &[Coordinate; AXES]) -> Option<[i32; MOTORS]> {
        let motors = self.kinematics.motors(axes);
        let mut steps = [0; MOTORS];
        for ((steps, motor), scale) in steps.iter_mut().zip(motors).zip(self.scales.steps_per_mm) {
            *steps = scale.steps(motor)?;
        }
        Some(steps)
    }

    /// Where the axes stand where the motors stand at `steps`.
    pub fn axes_at(&self, steps: &[i32; MOTORS]) -> [Coordinate; AXES] {
        let mut motors = [Coordinate::ZERO; MOTORS];
        for ((motor, steps), scale) in motors.iter_mut().zip(steps).zip(self.scales.steps_per_mm) {
            *motor = scale.coordinate(*steps);
        }
        self.kinematics.axes(&motors)
    }

    /// `steps` with every second motor put where the motor of its axis is. Their counts
    /// have to be so before a move, since it brings both to the same one.
    pub fn ganged(&self, steps: [i32; MOTORS]) -> [i32; MOTORS] {
        let mut ganged = steps;
        for (motor, place) in ganged.iter_mut().enumerate() {
            let own = steps.get(self.kinematics.axis_of(motor));
            *place = own.copied().unwrap_or(*place);
        }
        ganged
    }
}
