//! Axes whose steps are too coarse to tell a direction.
//!
//! ```text
//!   exact    o-----o-----o-----o-----o      an axis of 5 steps/mm beside one of 1280
//!   rounded  o-----o-----o-----o     |
//!                               \____o      one step of the coarse axis
//! ```
//!
//! A move's direction comes from its rounded steps, as the motors make them. Beside an axis with
//! fine steps, a coarse one makes that direction jump from move to move, and with it the speed of
//! the fine axis, which can tell. So the ways of coarse axes are the exact ones. Their steps come
//! when they are due, at most half a step off, as all steps do.

use crate::config::Limits;
use crate::path::short::STEPS;
use crate::real::{max, min};

/// Steps are coarse if they are more than this many times as long as the finest steps of the move.
const UNEVEN: f32 = 16.0;

/// An exact way is within this many half steps of the rounded one. (More is the way from a rest
/// half-way between two steps, or a way that the window cannot tell.)
const NEAR: f32 = 4.0;

/// The share of an axis that moves along it alone.
const WHOLE: f32 = 127.0;

impl<const AXES: usize> Limits<AXES> {
    /// Returns true if some axis has coarse steps beside another one.
    pub(crate) fn are_uneven(half_step: &[f32; AXES]) -> bool {
        let finest = half_step.iter().copied().fold(f32::INFINITY, min);
        half_step.iter().any(|step| *step > UNEVEN * finest)
    }

    /// Puts the exact ways of coarse axes in place of their rounded ones, mm. Returns whether the
    /// coarsest axis is one of them. A fine axis moves even if its way is less than a step: when a
    /// curve turns back on it, the coarse axis goes on at the same speed.
    pub(crate) fn straighten(&self, ways: &mut [f32; AXES], exact: &[f32; AXES]) -> bool {
        let mut finest = f32::INFINITY;
        for ((way, exact), half_step) in ways.iter().zip(exact).zip(&self.half_step) {
            if (*way != 0.0 || *exact != 0.0) && *half_step < finest {
                finest = *half_step;
            }
        }
        let mut is_coarsest = false;
        let axes = ways.iter_mut().zip(exact).zip(&self.half_step);
        for (axis, ((way, exact), half_step)) in axes.enumerate() {
            let is_near = (*exact - *way).abs() <= NEAR * half_step;
            if *half_step > UNEVEN * finest && is_near {
                *way = *exact;
                is_coarsest |= axis == self.coarsest;
            }
        }
        is_coarsest
    }

    /// The square of the length below which a move has too few steps to give a direction, mm², on
    /// a machine with uneven axes: by the coarsest steps that are not coarse beside the finest ones
    /// of the move. `ways`: of its axes, mm.
    pub(crate) fn uneven_short2(&self, ways: &[f32; AXES]) -> f32 {
        let moving = || {
            let axes = ways.iter().zip(&self.half_step);
            axes.filter(|(way, _)| **way != 0.0).map(|(_, step)| *step)
        };
        let finest = moving().fold(f32::INFINITY, min);
        let plain = moving().filter(|step| *step <= UNEVEN * finest);
        let length = 2.0 * STEPS as f32 * plain.fold(0.0, max);
        length * length
    }

    /// A component of a direction as [`PlannedMove::coarse`](crate::moves::PlannedMove::coarse)
    /// has it. It is never too small, so that the axis keeps its limit.
    pub(crate) fn share(component: f32) -> i8 {
        let share = (component.abs() * WHOLE) as i8;
        match component {
            0.0 => 0,
            ..0.0 => -share.saturating_add(1),
            _ => share.saturating_add(1),
        }
    }

    /// Puts a share of [`Limits::share`] into a tangent divided by the acceleration of each axis.
    pub(crate) fn put_share(&self, share: i8, tangent: &mut [f32; AXES]) {
        let per_acceleration = self.per_acceleration.get(self.coarsest);
        let axis = tangent.get_mut(self.coarsest).zip(per_acceleration);
        if let Some((component, per_acceleration)) = axis {
            *component = f32::from(share) / WHOLE * per_acceleration;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Config, StepsPerMm, NANOS_PER_MM};

    fn limits(steps_per_mm: [i64; 3]) -> Limits<3> {
        Limits::new(&Config {
            steps_per_mm: steps_per_mm.map(|steps| StepsPerMm::from_nanos(steps * NANOS_PER_MM)),
            ..Config::default()
        })
    }

    #[test]
    fn only_the_ways_of_axes_that_are_coarse_beside_one_that_moves_become_exact() {
        let coarse = limits([5, 100, 1600]);
        let mut ways = [0.2, 0.1, 0.1];
        assert!(coarse.straighten(&mut ways, &[0.11, 0.104, 0.100_3]));
        assert_eq!(ways, [0.11, 0.1, 0.1]);
        let mut ways = [0.0, 0.1, 0.0];
        assert!(coarse.straighten(&mut ways, &[0.09, 0.104, 0.0]));
        assert_eq!(ways, [0.09, 0.1, 0.0]);
        let mut alone = [0.2, 0.0, 0.0];
        assert!(!coarse.straighten(&mut alone, &[0.11, 0.0, 0.0]));
        assert_eq!(alone, [0.2, 0.0, 0.0]);
        let mut beside_less_than_a_step = [0.2, 0.0, 0.0];
        assert!(coarse.straighten(&mut beside_less_than_a_step, &[0.11, 0.0, 0.000_3]));
        assert_eq!(beside_less_than_a_step, [0.11, 0.0, 0.0]);
        let mut far = [0.2, 0.0, 1.0];
        assert!(!coarse.straighten(&mut far, &[-1999.8, 0.0, 1.0]));
        assert_eq!(far, [0.2, 0.0, 1.0]);
    }

    #[test]
    fn a_share_is_never_too_small() {
        for x in -1000..=1000 {
            let component = x as f32 / 1000.0;
            let share = Limits::<3>::share(component);
            let found = f32::from(share) / WHOLE;
            assert!(found.abs() >= component.abs() && found * component >= 0.0);
            assert!(found.abs() <= component.abs() + 0.008);
        }
    }

    #[test]
    fn even_scales_are_those_up_to_sixteen_times_as_coarse() {
        for (scales, uneven) in [([80, 80, 1280], false), ([10, 80, 400], true)] {
            assert_eq!(limits(scales).is_uneven, uneven);
        }
    }
}
