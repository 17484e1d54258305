//! The place of the motors, and the time that the queued moves will take.

use super::Motion;
use leadscrew_planner::{Coordinate, Kinematics, TimeLeft};
use leadscrew_stepper::MotorMask;

impl<K, const AXES: usize, const MOTORS: usize> Motion<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS> + Clone,
{
    /// Declares the axes' present position. At rest, with nothing queued.
    pub(crate) fn set_position(&mut self, axes: &[Coordinate; AXES]) {
        // A place beyond 2³¹ steps from the origin cannot be counted: the motors then count from 0.
        let steps = self.program.planner.steps_at(axes).unwrap_or([0; MOTORS]);
        self.shared.set_position(steps);
        self.resync();
    }

    /// The position of the axes, counted from steps. Motors beyond the axes do not count.
    pub(crate) fn position(&self) -> [Coordinate; AXES] {
        self.axes(&self.shared.position())
    }

    /// The position of the axes when the motors are at `steps`.
    pub(crate) fn axes(&self, steps: &[i32; MOTORS]) -> [Coordinate; AXES] {
        self.program.planner.axes_at(steps)
    }

    pub(super) fn resync(&mut self) {
        let steps = self.gang();
        self.program.planner.set_position(steps);
        self.aside.planner.set_position(steps);
    }

    /// Sets a second motor's position to the position of its axis, if a motor lock has let the
    /// two step apart. Otherwise the next move would bring back the skew that homing has taken out.
    /// Returns the positions of all motors, in steps. At rest.
    pub(super) fn gang(&mut self) -> [i32; MOTORS] {
        let counted = self.shared.position();
        let steps = self.program.planner.ganged(counted);
        if steps != counted {
            self.shared.set_position(steps);
        }
        steps
    }

    /// The motors of the axes that share motors: each has the number of its axis.
    pub(crate) fn sharing(&self) -> MotorMask {
        self.program.planner.kinematics().sharing()
    }

    /// Begins to add up how long the program's queue takes.
    pub(crate) fn time_left(&self) -> TimeLeft {
        self.program.planner.time_left(&self.program.segmenter)
    }

    /// Adds up some more moves; returns whether more are left.
    pub(crate) fn add_time(&self, left: &mut TimeLeft) -> bool {
        self.program.planner.add_time(left)
    }
}
