//! The axis with two motors: found in the kinematics, so that no configuration can contradict them.

use leadscrew_planner::Kinematics;

/// An axis that a second motor helps to turn.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct DualAxis {
    /// The axis.
    pub(crate) axis: usize,
    /// The second motor's number, beyond the axes: its bit in `$2`, `$3` and in the limit inputs.
    pub(crate) motor: usize,
}

impl DualAxis {
    /// The first motor beyond the axes that turns with an axis; `None` where there is none.
    pub(crate) fn of<const AXES: usize, const MOTORS: usize>(
        kinematics: &impl Kinematics<AXES, MOTORS>,
    ) -> Option<Self> {
        let mut more = (AXES..MOTORS).map(|motor| Self {
            axis: kinematics.axis_of(motor),
            motor,
        });
        more.find(|dual| dual.axis < AXES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_planner::{Cartesian, Ganged};

    #[test]
    fn the_axis_with_two_motors_is_that_of_the_kinematics() {
        let found = DualAxis::of::<3, 4>(&Ganged { axis_of: [1] });
        assert_eq!(found, Some(DualAxis { axis: 1, motor: 3 }));
        assert_eq!(DualAxis::of::<3, 4>(&Ganged { axis_of: [7] }), None);
        assert_eq!(DualAxis::of::<3, 3>(&Cartesian), None);
    }
}
