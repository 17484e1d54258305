//! The gearing between axes and motors, chosen when the machine is made rather than when the
//! program is compiled.

use leadscrew_planner::{Coordinate, Kinematics};
use leadscrew_stepper::MotorMask;
use std::array::from_fn;

/// The gearing between axes and motors. It maps places as [`leadscrew_planner::Cartesian`],
/// [`leadscrew_planner::CoreXy`] and [`leadscrew_planner::Ganged`] do.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Train {
    /// One motor for each axis.
    Straight,
    /// X and Y on two crossed belts, one motor each for all other axes.
    Crossed,
    /// One motor for each axis, and one more that turns with this axis.
    Ganged(usize),
}

impl Train {
    fn axis<const AXES: usize>(self, motor: usize) -> usize {
        match self {
            Self::Ganged(axis) if motor >= AXES => axis,
            Self::Ganged(_) | Self::Straight | Self::Crossed => motor,
        }
    }
}

impl<const AXES: usize, const MOTORS: usize> Kinematics<AXES, MOTORS> for Train {
    fn axis_of(&self, motor: usize) -> usize {
        self.axis::<AXES>(motor)
    }

    fn sharing(&self) -> MotorMask {
        match self {
            Self::Crossed => MotorMask::only(0).with(MotorMask::only(1)),
            Self::Straight | Self::Ganged(_) => MotorMask::NONE,
        }
    }

    fn motors(&self, axes: &[Coordinate; AXES]) -> [Coordinate; MOTORS] {
        let of = |motor| axes.get(self.axis::<AXES>(motor)).copied();
        let mut motors = from_fn(|motor| of(motor).unwrap_or_default());
        if let (Self::Crossed, [a, b, ..]) = (self, motors.as_mut_slice()) {
            (*a, *b) = (*a + *b, *a - *b);
        }
        motors
    }

    fn axes_mm(&self, motors: &[f32; MOTORS]) -> [f32; AXES] {
        let mut axes = from_fn(|axis| motors.get(axis).copied().unwrap_or_default());
        if let (Self::Crossed, [x, y, ..]) = (self, axes.as_mut_slice()) {
            (*x, *y) = (0.5 * (*x + *y), 0.5 * (*x - *y));
        }
        axes
    }

    fn axes(&self, motors: &[Coordinate; MOTORS]) -> [Coordinate; AXES] {
        let mut axes = from_fn(|axis| motors.get(axis).copied().unwrap_or_default());
        if let (Self::Crossed, [x, y, ..]) = (self, axes.as_mut_slice()) {
            (*x, *y) = ((*x + *y).half(), (*x - *y).half());
        }
        axes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_planner::{Cartesian, CoreXy, Ganged};

    /// Checks that two gearings map axes to motors, and back, alike.
    fn assert_alike<const MOTORS: usize>(one: Train, other: impl Kinematics<3, MOTORS>) {
        let axes = [3.0, -1.25, 7.0].map(Coordinate::from_mm);
        let motors = one.motors(&axes);
        assert_eq!(motors, other.motors(&axes));
        assert_eq!(Kinematics::<3, MOTORS>::axes(&one, &motors), axes);
        let turned = std::array::from_fn(|motor| motor as f32 + 0.5);
        assert_eq!(one.axes_mm(&turned), other.axes_mm(&turned));
        for motor in 0..MOTORS {
            let own = Kinematics::<3, MOTORS>::axis_of(&one, motor);
            assert_eq!(own, other.axis_of(motor));
        }
        let own = Kinematics::<3, MOTORS>::sharing(&one);
        assert_eq!(own.bits(), other.sharing().bits());
    }

    #[test]
    fn each_train_is_the_planner_s() {
        assert_alike::<3>(Train::Straight, Cartesian);
        assert_alike::<3>(Train::Crossed, CoreXy);
        assert_alike::<4>(Train::Ganged(1), Ganged { axis_of: [1] });
    }
}
