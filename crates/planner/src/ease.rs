//! The jerk limit: how long the plan is averaged, and the acceleration that this leaves.
//!
//! The tool's place is the mean of the plan's places in the last time `T`. The acceleration of the
//! plan changes by `2·a` at most, so the acceleration of the tool changes no faster than `2·a/T`.
//!
//! If the plan kept one speed for `T` between rising and falling, half of `T` would do. But a hold
//! would then have to wait. In a prototype that saved 6 % of the time.
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
    /// The average that keeps `jerk` (mm/s³) and sets off no vibration of the frequency `resonance`
    /// (Hz). 0 stands for no limit and for no vibration; both together give `None`.
    ///
    /// `rates` has the highest speed of each axis, mm/s. `accelerations` has the highest
    /// acceleration of each axis, mm/s². The finest axis has `finest` steps/mm.
    ///
    /// [`PLACES`] bound the time. A lower jerk keeps the longest time, and has a lower acceleration.
    /// A lower frequency keeps the longest time, too: its vibration is weakened only.
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

/// The shortest time of at least `least` seconds that is a whole number of periods of a frequency
/// (Hz); if that is more than `longest` seconds, the longest such time within them, or one period.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_is_whole_periods_and_keeps_the_jerk() {
        let longest = PLACES as f32 * LONGEST;
        for jerk in [0.0, 500.0, 5e3, 5e4, 1e6] {
            for frequency in [9.5, 12.0, 25.0, 40.0, 99.9, 333.0, 5000.0] {
                let ease = Ease::new(jerk, frequency, &[100.0; 3], &[3000.0; 3], 250.0).unwrap();
                let periods = ease.seconds * frequency;
                let context = (jerk, frequency, periods);
                assert!(
                    (periods - (periods + 0.5).floor()).abs() < 1e-3,
                    "{context:?}"
                );
                assert!(periods > 0.5 && ease.seconds <= longest, "{context:?}");
                assert!(ease.seconds >= 0.99 * SHORTEST, "{context:?}");
                let kept = 2.0 * ease.acceleration <= 1.0001 * jerk * ease.seconds;
                assert!(jerk <= 0.0 || kept, "{context:?}");
                // Without a jerk limit: one period, or as many as the shortest time takes.
                let least = if jerk > 0.0 {
                    longest
                } else {
                    1.0 / frequency + SHORTEST
                };
                assert!(ease.seconds <= least, "{context:?}");
            }
        }
    }

    #[test]
    fn a_frequency_too_low_keeps_the_longest_time_and_none_of_both_has_no_average() {
        let ease = |jerk, frequency| Ease::new(jerk, frequency, &[100.0], &[3000.0], 250.0);
        assert_eq!(ease(0.0, 0.0), None);
        let longest = PLACES as f32 * LONGEST;
        assert_eq!(ease(0.0, 2.0).map(|ease| ease.seconds), Some(longest));
        assert_eq!(ease(500.0, 2.0).map(|ease| ease.seconds), Some(longest));
    }
}
