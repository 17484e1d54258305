//! The axis with two motors: found in the kinematics, so that no configuration can contradict them.

use leadscrew_planner::Kinematics;
use leadscrew_stepper::MotorMask;

/// An axis that a second motor helps to turn.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct DualAxis {
    /// The axis.
    pub(crate) axis: usize,
    /// The second motor's number: its bit in `$2`, `$3` and in the limit inputs.
    pub(crate) motor: usize,
}

impl DualAxis {
    /// The first motor that turns an axis of another number: the second motor of that axis. `None`
    /// if there is no such motor.
    pub(crate) fn of<const AXES: usize, const MOTORS: usize>(
        kinematics: &impl Kinematics<AXES, MOTORS>,
    ) -> Option<Self> {
        let mut all = (0..MOTORS).map(|motor| Self {
            axis: kinematics.axis_of(motor),
            motor,
        });
        all.find(|dual| dual.axis < AXES && dual.axis != dual.motor)
    }
}

/// The motors of axes that are absent, on a machine with `count` axes.
pub(crate) fn absent<const AXES: usize, const MOTORS: usize>(
    kinematics: &impl Kinematics<AXES, MOTORS>,
    count: usize,
) -> MotorMask {
    let absent = (0..MOTORS).filter(|motor| (count..AXES).contains(&kinematics.axis_of(*motor)));
    absent.fold(MotorMask::NONE, |all, motor| {
        all.with(MotorMask::only(motor))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_planner::{Cartesian, Ganged, Train};

    #[test]
    fn the_axis_with_two_motors_is_that_of_the_kinematics() {
        let found = DualAxis::of::<3, 4>(&Ganged { axis_of: [1] });
        assert_eq!(found, Some(DualAxis { axis: 1, motor: 3 }));
        assert_eq!(DualAxis::of::<3, 4>(&Ganged { axis_of: [7] }), None);
        assert_eq!(DualAxis::of::<3, 3>(&Cartesian), None);
        let found = DualAxis::of::<4, 4>(&Train::Ganged(1));
        assert_eq!(found, Some(DualAxis { axis: 1, motor: 3 }));
    }

    #[test]
    fn the_motor_of_an_absent_axis_is_absent_and_a_second_motor_is_not() {
        let absent_of = |train, count| absent::<4, 4>(&train, count).bits();
        assert_eq!(absent_of(Train::Straight, 3), 0b1000);
        assert_eq!(absent_of(Train::Crossed, 3), 0b1000);
        assert_eq!(absent_of(Train::Ganged(1), 3), 0);
        assert_eq!(absent_of(Train::Straight, 4), 0);
    }
}
