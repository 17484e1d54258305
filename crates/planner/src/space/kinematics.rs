//! Which motors move which axes.
//!
//! Limits apply to axes, Bresenham's tracer to motors. The maps are linear, so that a straight move
//! is straight in both, and a map of positions is also one of differences.
//!
//! ```text
//!             axes     motors
//!  Cartesian  X ------ 0           one motor an axis
//!  CoreXy     X, Y --- 0, 1        two belts, each of them moved by both axes
//!  Ganged     X ------ 0
//!             Y --+--- 1           two motors on one axis
//!                 +--- 2
//! ```
//!
//! Ganged motors have the same steps at the same ticks: the tracer has the same numbers for both.
//! Only a motor lock (homing) tells them apart.

use crate::Coordinate;
use core::array::from_fn;
use leadscrew_stepper::MotorMask;

/// A linear map between axes and motors and its inverse. There are at least as many motors as axes.
pub trait Kinematics<const AXES: usize, const MOTORS: usize> {
    /// The axis whose steps/mm `motor` has. A motor beyond the axes turns with that axis.
    fn axis_of(&self, motor: usize) -> usize {
        motor
    }

    /// Axes that share motors (CoreXY), by axis number: one of these motors turns for each of the
    /// axes. The axes home one by one, and a limit switch of any of them stops all of these motors.
    fn sharing(&self) -> MotorMask {
        MotorMask::NONE
    }

    /// Places of the motors for the places `axes` of the axes.
    fn motors(&self, axes: &[Coordinate; AXES]) -> [Coordinate; MOTORS];

    /// Places of the axes, mm, for the places `motors` of the motors, mm. The map is linear, so it
    /// also turns distances of motors into distances of axes.
    fn axes_mm(&self, motors: &[f32; MOTORS]) -> [f32; AXES];

    /// Places of the axes for the places `motors` of the motors.
    fn axes(&self, motors: &[Coordinate; MOTORS]) -> [Coordinate; AXES];
}

/// One motor an axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Cartesian;

impl<const N: usize> Kinematics<N, N> for Cartesian {
    fn motors(&self, axes: &[Coordinate; N]) -> [Coordinate; N] {
        *axes
    }

    fn axes_mm(&self, motors: &[f32; N]) -> [f32; N] {
        *motors
    }

    fn axes(&self, motors: &[Coordinate; N]) -> [Coordinate; N] {
        *motors
    }
}

/// Two crossed belts: motor 0 turns by `x + y`, motor 1 by `x − y`; all other axes have a motor
/// each.
///
/// Source: <https://corexy.com/theory.html>.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct CoreXy;

impl<const N: usize> Kinematics<N, N> for CoreXy {
    fn sharing(&self) -> MotorMask {
        MotorMask::only(0).with(MotorMask::only(1))
    }

    fn motors(&self, axes: &[Coordinate; N]) -> [Coordinate; N] {
        let mut motors = *axes;
        if let [a, b, ..] = motors.as_mut_slice() {
            (*a, *b) = (*a + *b, *a - *b);
        }
        motors
    }

    fn axes_mm(&self, motors: &[f32; N]) -> [f32; N] {
        let mut axes = *motors;
        if let [x, y, ..] = axes.as_mut_slice() {
            (*x, *y) = (0.5 * (*x + *y), 0.5 * (*x - *y));
        }
        axes
    }

    fn axes(&self, motors: &[Coordinate; N]) -> [Coordinate; N] {
        let mut axes = *motors;
        if let [x, y, ..] = axes.as_mut_slice() {
            (*x, *y) = ((*x + *y).half(), (*x - *y).half());
        }
        axes
    }
}

/// As [`Cartesian`], but motor `AXES + k` turns together with the motor of axis `axis_of[k]`.
///
/// The axis stands at the count of its own motor, which has the axis's number. A missing axis
/// stands still.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Ganged<const MORE: usize> {
    /// The axis of each motor beyond the axes.
    pub axis_of: [usize; MORE],
}

impl<const AXES: usize, const MOTORS: usize, const MORE: usize> Kinematics<AXES, MOTORS>
    for Ganged<MORE>
{
    fn axis_of(&self, motor: usize) -> usize {
        let more = motor.checked_sub(AXES);
        let axis = more.and_then(|more| self.axis_of.get(more));
        axis.copied().unwrap_or(motor)
    }

    fn motors(&self, axes: &[Coordinate; AXES]) -> [Coordinate; MOTORS] {
        let axis_of = |motor| Kinematics::<AXES, MOTORS>::axis_of(self, motor);
        from_fn(|motor| axes.get(axis_of(motor)).copied().unwrap_or_default())
    }

    fn axes_mm(&self, motors: &[f32; MOTORS]) -> [f32; AXES] {
        from_fn(|axis| motors.get(axis).copied().unwrap_or_default())
    }

    fn axes(&self, motors: &[Coordinate; MOTORS]) -> [Coordinate; AXES] {
        from_fn(|axis| motors.get(axis).copied().unwrap_or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crossed_belts_turn_by_sum_and_difference_and_back() {
        let axes = [3.0, -1.0, 7.0].map(Coordinate::from_mm);
        let motors = CoreXy.motors(&axes);
        assert_eq!(motors, [2.0, 4.0, 7.0].map(Coordinate::from_mm));
        assert_eq!(CoreXy.axes(&motors), axes);
        assert_eq!(CoreXy.axes_mm(&[2.0, 4.0, 7.0]), [3.0, -1.0, 7.0]);
    }

    #[test]
    fn a_second_motor_turns_with_its_axis_which_stands_where_the_first_one_does() {
        let ganged = Ganged { axis_of: [1] };
        let [x, y, twin] = [3.0, -1.0, 7.0].map(Coordinate::from_mm);
        assert_eq!(ganged.motors(&[x, y]), [x, y, y]);
        assert_eq!(ganged.axes(&[x, y, twin]), [x, y]);
        let axis_of = |motor| Kinematics::<2, 3>::axis_of(&ganged, motor);
        assert_eq!([0, 1, 2].map(axis_of), [0, 1, 1]);
    }
}
