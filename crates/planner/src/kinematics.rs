//! Which motors move which axes.
//!
//! Limits apply to axes, Bresenham's tracer to motors. The maps are linear, so that a straight move is
//! straight in both, and a map of positions is also one of differences.

use crate::Coordinate;

/// A linear map between axes and motors and its inverse. Motor *m* has the steps/mm of axis *m*.
pub trait Kinematics<const AXES: usize, const MOTORS: usize> {
    /// How far the motors are turned where the axes stand at `axes`.
    fn motors(&self, axes: &[Coordinate; AXES]) -> [Coordinate; MOTORS];

    /// Where the axes stand (or how far they move), in mm, where the motors stand at `motors`.
    fn axes_mm(&self, motors: &[f32; MOTORS]) -> [f32; AXES];

    /// Where the axes stand where the motors stand at `motors`.
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

/// Two crossed belts: motor 0 turns by `x + y`, motor 1 by `x − y`; all other axes have a motor each.
///
/// Source: <https://corexy.com/theory.html>.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct CoreXy;

impl<const N: usize> Kinematics<N, N> for CoreXy {
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
}
