//! The jerk limit: how long the plan is averaged, and the acceleration that this leaves.
//!
//! The tool is where the plan was in the mean of the last time `T`. The acceleration of the plan
//! changes by `2·a` at most, so the acceleration of the tool changes no faster than `2·a/T`.

use crate::real::{max, min, sqrt};
use crate::Config;

/// The most places of the plan that are remembered.
pub(crate) const PLACES: usize = 128;

/// The longest time from one place to the next, seconds: a segment is as long.
const LONGEST: f32 = 0.95e-3;

/// The shortest time over which the plan is averaged, seconds.
const SHORTEST: f32 = 1.5e-3;

/// The acceleration over the root of jerk and speed.
///
/// From rest to the speed `F` motion takes `F/a + T`, with `T = 2·a/J`. That is shortest for
/// `a = √(J·F/2)`. Small changes of speed take less time with a smaller `T`.
const SHARE: f32 = 0.5;

/// The average over the plan. Everything is derived from the settings.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Ease {
    /// The time over which the plan is averaged, seconds.
    pub(crate) seconds: f32,
    /// The number of places in that time.
    pub(crate) places: usize,
    /// The time from one place to the next, seconds.
    pub(crate) between: f32,
    /// The highest acceleration of the plan along the path, mm/s².
    pub(crate) acceleration: f32,
}

impl Ease {
    /// The average that keeps the jerk of `config`; `None` without a jerk limit.
    ///
    /// A jerk so low that the time would be more than [`PLACES`] places keeps the longest time, and
    /// a lower acceleration.
    pub(crate) fn new<const AXES: usize>(config: &Config<AXES>) -> Option<Self> {
        let jerk = config.jerk;
        if jerk <= 0.0 {
            return None;
        }
        let fastest = config.max_rate.iter().copied().fold(0.0, max);
        let strongest = config.acceleration.iter().copied().fold(0.0, max);
        let wanted = min(strongest, SHARE * sqrt(jerk * fastest));
        let longest = PLACES as f32 * LONGEST;
        let seconds = max(min(2.0 * wanted / jerk, longest), SHORTEST);
        let places = ((seconds / LONGEST) as usize + 1).clamp(2, PLACES);
        Some(Self {
            seconds,
            places,
            between: seconds / places as f32,
            acceleration: min(wanted, 0.5 * jerk * seconds) * crate::config::MARGIN,
        })
    }

    /// The way that the plan goes in half of the time at the speed `v` (mm/s), mm.
    pub(crate) fn half(&self, v: f32) -> f32 {
        0.5 * self.seconds * v
    }

    /// The way to the mean place of an acceleration out of rest, mm.
    pub(crate) fn rise(&self) -> f32 {
        self.acceleration * self.seconds * self.seconds / 6.0
    }
}
