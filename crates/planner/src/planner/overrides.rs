//! Changes of overrides, carried through the queue a few moves at a time.

use super::one_move::{cap, nominal};
use super::Planner;
use crate::{Kinematics, OverrideError, Overrides};

/// The most moves that one call of [`Planner::renew`] plans under a jerk limit: the limits of each
/// depend on many moves near it.
const EASED: usize = 4;

impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Returns the overrides in force.
    pub const fn overrides(&self) -> Overrides {
        self.overrides
    }

    /// Changes the overrides and begins to plan the queued moves anew, from the first one on.
    ///
    /// The running move follows at the next [`crate::Segmenter::next`], the others with
    /// [`Planner::renew`].
    ///
    /// # Errors
    /// [`Overrides::validate`] refuses them; those in force stay.
    pub fn set_overrides(&mut self, overrides: Overrides) -> Result<(), OverrideError> {
        overrides.validate()?;
        if overrides == self.overrides {
            return Ok(());
        }
        self.overrides = overrides;
        let last = self.queue.last_settled();
        self.nominal_before = last.map(|last| nominal(overrides, last));
        self.queue.begin_renewal();
        self.renew();
        self.revision = self.revision.wrapping_add(1);
        Ok(())
    }

    /// Returns true if some queued moves still have limits of earlier overrides.
    pub const fn is_renewing(&self) -> bool {
        self.queue.is_renewing()
    }

    /// Carries a change of overrides to a few more of the queued moves. Returns whether more of
    /// them are left.
    ///
    /// All limits are kept meanwhile. The moves that are left keep the speed asked for before the
    /// change. Until no move is left, none can be queued: for 1024 moves that takes at most 65
    /// calls. [`Planner::push`] and [`crate::Segmenter::next`] call this too. One call plans a
    /// block of moves at most, 16 in the usual queue (4 moves under a jerk limit), because a `Machine::poll` may call it for
    /// each segment that it makes.
    pub fn renew(&mut self) -> bool {
        self.is_renewing() && self.renew_block()
    }

    /// Plans the next block of moves anew; returns whether more are left. A function of its own:
    /// [`Planner::renew`], called for each segment and each line, hardly ever has anything to do.
    fn renew_block(&mut self) -> bool {
        let (overrides, unit) = (self.overrides, self.limits.unit);
        let most = match self.limits.ease() {
            Some(_) => EASED,
            None => usize::MAX,
        };
        let (queue, axis_limits) = self.parts();
        queue.renew(&axis_limits, most, |before, planned| {
            let before = before.map(|before| nominal(overrides, before));
            cap(unit, before, nominal(overrides, planned), planned.corner)
        });
        self.queue.is_renewing()
    }
}
