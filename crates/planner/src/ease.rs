//! The jerk limit: how long the plan is averaged, and the acceleration that this leaves.
//!
//! The tool's place is the mean of the plan's places in the last time `T`. The acceleration of the
//! plan changes by `2·a` at most, so the acceleration of the tool changes no faster than `2·a/T`.
//!
//! The mean over a whole number of a vibration's periods is 0. So motion along the path does not
//! set off a vibration of the frequency `f` if `T` is a multiple of `1/f`.

use crate::built::{Jerk, JERK};
use crate::real::{max, min, norm2, sqrt};

/// The most ways of the plan, from place to place, that are remembered: as many as the core coupled
/// memory of a board with four motors and a record has room for.
pub(crate) const PLACES: usize = if JERK { 112 } else { 0 };

/// The longest way from place to place, units: 16 bits, less what rounding may add.
const LONGEST_WAY: f32 = 65_000.0;

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
    /// Units of a way in a mm, a power of two: some nanometres each.
    per_mm: f32,
    pub(crate) built: Jerk,
}

impl Ease {
    /// The average that keeps `jerk` (mm/s³) and does not set off a vibration of the frequency
    /// `resonance` (Hz); 0 for neither; `None` if both are 0. `rates` (mm/s) and `accelerations`
    /// (mm/s²) are those of the axes, and `finest` is the most steps in a mm.
    ///
    /// A jerk so low that the time would be more than [`PLACES`] places keeps the longest time, and
    /// a lower acceleration. A frequency so low keeps the longest time, too.
    pub(crate) fn new<const AXES: usize>(
        jerk: f32,
        resonance: f32,
        rates: &[f32; AXES],
        accelerations: &[f32; AXES],
        finest: f32,
    ) -> Option<Self> {
        let built = Jerk::FOUND?;
        if jerk <= 0.0 && resonance <= 0.0 {
            return None;
        }
        let jerk = if jerk > 0.0 { jerk } else { f32::INFINITY };
        let fastest = rates.iter().copied().fold(0.0, max);
        let strongest = accelerations.iter().copied().fold(0.0, max);
        let wanted = min(strongest, SHARE * sqrt(jerk * fastest));
        let longest = PLACES as f32 * LONGEST;
        let least = max(min(2.0 * wanted / jerk, longest), SHORTEST);
        let seconds = min(whole_periods(least, longest, resonance), longest);
        let places = ((seconds / LONGEST) as usize + 1).clamp(2, PLACES);
        let between = seconds / places as f32;
        // The most units with which the longest way from place to place fits. A step has to be more
        // than a unit, also if the speed has to be bounded for that.
        let fits = LONGEST_WAY / (sqrt(norm2(rates)) * between);
        Some(Self {
            seconds,
            places,
            between,
            acceleration: min(wanted, 0.5 * jerk * seconds),
            per_mm: max(power_of_two(fits), power_of_two(2.0 * finest)),
            built,
        })
    }

    /// The highest speed along the path, mm/s.
    pub(crate) fn rate(&self) -> f32 {
        LONGEST_WAY / (self.between * self.per_mm)
    }

    /// The length of a way of `mm`, units.
    pub(crate) fn units(&self, mm: f32) -> u64 {
        ((mm * self.per_mm) as u64).max(1)
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

/// The shortest time of `least` or more that is a whole number of periods of a frequency; less if
/// that would be more than `longest`, but a period at least.
fn whole_periods(least: f32, longest: f32, frequency: f32) -> f32 {
    if frequency <= 0.0 {
        return least;
    }
    let down = |seconds: f32| (seconds * frequency) as u32;
    let up = down(least) + u32::from(down(least) as f32 / frequency < least);
    up.min(down(longest)).max(1) as f32 / frequency
}

/// The greatest power of two that is not above `value`, from 2⁸ to 2³⁰.
fn power_of_two(value: f32) -> f32 {
    const EXPONENT: u32 = 0xFF << 23;
    f32::from_bits(value.clamp(256.0, 1_073_741_824.0).to_bits() & EXPONENT)
}
