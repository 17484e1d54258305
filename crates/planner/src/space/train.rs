//! The gearing between axes and motors, chosen when the machine is made rather than when the
//! program is compiled.

use crate::{Coordinate, Kinematics};
use core::array::from_fn;
use leadscrew_stepper::MotorMask;

/// The gearing between axes and motors, chosen at run time. It maps places as [`crate::Cartesian`],
/// [`crate::CoreXy`] and [`crate::Ganged`] do.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Train {
    /// One motor for each axis.
    Straight,
    /// X and Y on two crossed belts, one motor each for all other axes.
    Crossed,
    /// One motor for each axis, and the last motor turns with this axis. If there are no more
    /// motors than axes, the last axis has no motor, and stands still.
    Ganged(usize),
}

impl Train {
    /// The axis that a motor turns with.
    fn axis<const MOTORS: usize>(self, motor: usize) -> usize {
        match self {
            Self::Ganged(axis) if motor + 1 == MOTORS => axis,
            Self::Ganged(_) | Self::Straight | Self::Crossed => motor,
        }
    }

    /// The place of the motor that has the axis's number, if this motor turns with the axis;
    /// otherwise 0.
    fn own<T: Copy + Default, const MOTORS: usize>(self, motors: &[T; MOTORS], axis: usize) -> T {
        let is_own = self.axis::<MOTORS>(axis) == axis;
        let place = motors.get(axis).filter(|_| is_own);
        place.copied().unwrap_or_default()
    }
}

impl<const AXES: usize, const MOTORS: usize> Kinematics<AXES, MOTORS> for Train {
    fn axis_of(&self, motor: usize) -> usize {
        self.axis::<MOTORS>(motor)
    }

    fn sharing(&self) -> MotorMask {
        match self {
            Self::Crossed => MotorMask::only(0).with(MotorMask::only(1)),
            Self::Straight | Self::Ganged(_) => MotorMask::NONE,
        }
    }

    fn motors(&self, axes: &[Coordinate; AXES]) -> [Coordinate; MOTORS] {
        let of = |motor| axes.get(self.axis::<MOTORS>(motor)).copied();
        let mut motors = from_fn(|motor| of(motor).unwrap_or_default());
        if let (Self::Crossed, [a, b, ..]) = (self, motors.as_mut_slice()) {
            (*a, *b) = (*a + *b, *a - *b);
        }
        motors
    }

    fn axes_mm(&self, motors: &[f32; MOTORS]) -> [f32; AXES] {
        let mut axes = from_fn(|axis| self.own(motors, axis));
        if let (Self::Crossed, [x, y, ..]) = (self, axes.as_mut_slice()) {
            (*x, *y) = (0.5 * (*x + *y), 0.5 * (*x - *y));
        }
        axes
    }

    fn axes(&self, motors: &[Coordinate; MOTORS]) -> [Coordinate; AXES] {
        let mut axes = from_fn(|axis| self.own(motors, axis));
        if let (Self::Crossed, [x, y, ..]) = (self, axes.as_mut_slice()) {
            (*x, *y) = ((*x + *y).half(), (*x - *y).half());
        }
        axes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cartesian, CoreXy, Ganged};

    /// Checks that two gearings map axes to motors, and back, alike.
    fn assert_alike<const MOTORS: usize>(one: Train, other: impl Kinematics<3, MOTORS>) {
        let axes = [3.0, -1.25, 7.0].map(Coordinate::near);
        let motors = one.motors(&axes);
        assert_eq!(motors, other.motors(&axes));
        assert_eq!(Kinematics::<3, MOTORS>::axes(&one, &motors), axes);
        let turned = from_fn(|motor| motor as f32 + 0.5);
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

    #[test]
    fn an_axis_whose_motor_turns_with_another_stands_still() {
        let train = Train::Ganged(1);
        let [x, y, z] = [3.0, -1.25, 7.0].map(Coordinate::near);
        let motors: [Coordinate; 4] = train.motors(&[x, y, z, Coordinate::ZERO]);
        assert_eq!(motors, [x, y, z, y]);
        let axes: [Coordinate; 4] = train.axes(&motors);
        assert_eq!(axes, [x, y, z, Coordinate::ZERO]);
        let axes: [f32; 4] = train.axes_mm(&[3.0, -1.25, 7.0, -1.25]);
        assert_eq!(axes, [3.0, -1.25, 7.0, 0.0]);
    }
}
