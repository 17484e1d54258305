//! Compares the carriages' positions with the positions that the machine counts.
//!
//! Both are counted from a common origin, which moves when the machine declares its position anew
//! (homing), when a carriage is put elsewhere by hand, or when the wiring of a direction pin
//! changes.

use leadscrew_stepper::MotorMask;

/// The common origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PositionCheck<const MOTORS: usize> {
    counted: [i32; MOTORS],
    made: [i32; MOTORS],
}

impl<const MOTORS: usize> Default for PositionCheck<MOTORS> {
    fn default() -> Self {
        Self {
            counted: [0; MOTORS],
            made: [0; MOTORS],
        }
    }
}

impl<const MOTORS: usize> PositionCheck<MOTORS> {
    /// Takes the present positions as the origin.
    pub(crate) fn compare_from_now(&mut self, counted: [i32; MOTORS], made: [i32; MOTORS]) {
        *self = Self { counted, made };
    }

    /// The first motor whose carriage has not made the steps counted since the origin, with the
    /// steps counted and the steps made. Carriages of motors in `inverted` move against the count.
    pub(crate) fn difference(
        &self,
        counted: [i32; MOTORS],
        made: [i32; MOTORS],
        inverted: MotorMask,
    ) -> Option<(usize, i32, i32)> {
        (0..MOTORS)
            .map(|motor| {
                let counted = counted[motor].wrapping_sub(self.counted[motor]);
                let made = made[motor].wrapping_sub(self.made[motor]);
                let made = if inverted.contains(motor) {
                    made.wrapping_neg()
                } else {
                    made
                };
                (motor, counted, made)
            })
            .find(|(_, counted, made)| counted != made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverted_motors_turn_the_other_way() {
        let check = PositionCheck::<2>::default();
        let y = MotorMask::only(1);
        assert_eq!(check.difference([5, 7], [5, -7], y), None);
        assert_eq!(check.difference([5, 7], [5, 7], y), Some((1, 7, -7)));
    }

    #[test]
    fn steps_are_counted_from_the_origin() {
        let mut check = PositionCheck::<1>::default();
        check.compare_from_now([1000], [3]);
        assert_eq!(check.difference([1010], [13], MotorMask::NONE), None);
        assert_eq!(
            check.difference([1010], [12], MotorMask::NONE),
            Some((0, 10, 9))
        );
    }
}
