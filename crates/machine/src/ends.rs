//! The end of its travel at which each axis stands, as its limit switch and its last motion tell.

use core::cmp::Ordering;

/// The direction of each motor, and the end of its travel at which each axis stands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ends<const AXES: usize, const MOTORS: usize> {
    /// Steps counted at the last look.
    pub(crate) seen: [i32; MOTORS],
    /// The direction of each motor's last step in this motion: 1, -1, or 0 if it has not stepped.
    pub(crate) heading: [i32; MOTORS],
    /// For each axis whose limit switch is closed: the direction that leads farther into the
    /// switch, `Equal` if it is unknown.
    pub(crate) closed: [Option<Ordering>; AXES],
}

impl<const AXES: usize, const MOTORS: usize> Ends<AXES, MOTORS> {
    /// At rest, with all switches open.
    pub(crate) const fn new() -> Self {
        Self {
            seen: [0; MOTORS],
            heading: [0; MOTORS],
            closed: [None; AXES],
        }
    }

    /// Notes in which direction each motor has stepped since the last call.
    pub(crate) fn follow(&mut self, position: &[i32; MOTORS]) {
        let motors = self.seen.iter_mut().zip(&mut self.heading);
        for ((seen, heading), now) in motors.zip(position) {
            if now != seen {
                *heading = now.wrapping_sub(*seen).signum();
                *seen = *now;
            }
        }
    }
}
