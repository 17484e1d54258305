//! Ticks whose interval changes linearly, from the time that some steps take.
//!
//! A segment of `M` ticks, with the first interval `p` and the change `d` from one interval to the
//! next, reaches tick `k` after `p·k + d·k(k−1)/2`. It agrees with the profile in its middle (the
//! time `H` after `h` ticks) and at its end (the time `D` after `M` ticks):
//!
//! ```text
//!   d = 2·(D/M − H/h) / (M − h)        p = D/M − d·(M − 1)/2
//! ```
//!
//! Under constant acceleration `a` (steps/s²) at the speed `v` the time as a function of the step
//! has the third derivative `3a²/v⁵`. So over `T` seconds the quadratic is off by about
//! `0.024·T³·a²/v²`; [`longest`] solves that for `T`.
//!
//! Intervals have the 24 significant bits of an `f32`. The error of their rounding is known
//! exactly, in 2⁻³² counts, and is added to the next segment.

use crate::real::{min, rough_cube_root};
use core::num::NonZeroU16;
use leadscrew_stepper::{Interval, IntervalChange, Smoothing};

/// `0.25 µs / 0.024`: a segment may be off by a quarter of a microsecond.
const TOLERANCE: f32 = 0.25e-6 / 0.024;

/// The longest time (s), at most `most`, that a segment may take at the speed `v` (the lowest in
/// the segment, steps/s) and the acceleration `a` (steps/s², not 0).
pub(crate) fn longest(v: f32, a: f32, most: f32) -> f32 {
    let ratio = v / a;
    min(most, rough_cube_root(TOLERANCE * ratio * ratio))
}

/// The number of steps, at least 1, of a segment that lasts `most` seconds at most. It begins at
/// the speed `v` (steps/s) under the acceleration `a` (steps/s²).
pub(crate) fn steps(v: f32, a: f32, most: f32) -> u32 {
    let steps = if a > 0.0 {
        v * longest(v, a, most)
    } else if a < 0.0 {
        // A segment that brakes is slowest at its end.
        let slowest = v + a * longest(v, -a, most);
        let time = if slowest > 0.0 {
            longest(slowest, -a, most)
        } else {
            0.0
        };
        (v + 0.5 * a * time) * time
    } else {
        v * most
    };
    (steps as u32).max(1)
}

/// The longest tick that is not smoothed, seconds. Motors other than the dominant one step up to
/// half a tick too early or too late. 5 µs are allowed, half of a tick of 10 µs; the rest is for
/// ticks that are longer than the mean of their segment.
const FINE: f32 = 9e-6;

/// Evenness of a segment at constant speed. Below this value the speed changes, and half of an
/// eighth of a step may take longer than a sixteenth of the step's time; sixteenfold smoothing is
/// then allowed.
const EVEN: f32 = 1.0;

/// A coarser smoothing begins one segment after it was found to be needed. In that segment the
/// speed may grow by this factor ([`longest`]: 8 % at 10⁵ steps/s and 4·10⁶ steps/s²).
const GROWTH: f32 = 1.08;

/// The least smoothing that brings the steps of other motors within 5 µs, or within a sixteenth of
/// a step if that is more, of the true line. If ticks would be closer than `shortest_tick`, the
/// smoothing is less. The steps of the segment take `interval` seconds each in the mean.
///
/// `evenness` is the segment's lowest speed as a share of its mean one. It is 0 for a step out of
/// rest or into rest, whose shortest tick takes a quarter of the mean tick's time.
pub(crate) fn smoothing(interval: f32, shortest_tick: f32, evenness: f32) -> Smoothing {
    const LEVELS: [Smoothing; 3] = [Smoothing::None, Smoothing::Twofold, Smoothing::Fourfold];
    let shortest = if evenness < 0.5 {
        4.0 * shortest_tick
    } else {
        GROWTH * (2.0 - evenness) * shortest_tick
    };
    let mut tick = interval;
    for level in LEVELS {
        if tick <= FINE || 0.5 * tick < shortest {
            return level;
        }
        tick *= 0.5;
    }
    if tick <= FINE || 0.5 * tick < shortest || evenness >= EVEN {
        Smoothing::Eightfold
    } else {
        Smoothing::Sixteenfold
    }
}

/// A linear interval, in counts of the step timer.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Linear {
    pub(crate) first: f32,
    pub(crate) change: f32,
}

impl Linear {
    /// Even ticks that take `duration` counts in all.
    pub(crate) fn even(duration: f32, ticks: f32) -> Self {
        Self {
            first: duration / ticks,
            change: 0.0,
        }
    }

    /// Ticks that take `duration` counts in all, and of which the first `middle` take `half`
    /// counts.
    pub(crate) fn through(half: f32, middle: f32, duration: f32, ticks: f32) -> Self {
        let mean = duration / ticks;
        let change = 2.0 * (mean - half / middle) / (ticks - middle);
        Self {
            first: mean - 0.5 * change * (ticks - 1.0),
            change,
        }
    }

    /// The last of `ticks` intervals.
    pub(crate) fn last(self, ticks: f32) -> f32 {
        self.first + self.change * (ticks - 1.0)
    }
}

/// The error of rounding so far, in 2⁻³² counts, which is added to the next segment.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Carry(i64);

impl Carry {
    /// Rounds `linear` so that the segment, which takes `duration` counts, ends at the right time:
    /// errors of earlier segments are made up for.
    pub(crate) fn round(
        &mut self,
        linear: Linear,
        ticks: NonZeroU16,
        duration: f32,
    ) -> (Interval, IntervalChange) {
        let change = signed_bits(linear.change);
        self.settle(bits(linear.first), change, ticks, bits(duration))
    }

    /// Rounds even ticks of a cruise, of which `2^level` take `interval` (2⁻³² counts).
    pub(crate) fn round_cruise(
        &mut self,
        interval: u64,
        level: u32,
        ticks: NonZeroU16,
    ) -> (Interval, IntervalChange) {
        let duration = interval.wrapping_mul(u64::from(ticks.get() >> level));
        self.settle(interval >> level, 0, ticks, duration)
    }

    /// One tick that is due after `duration` counts. It makes up for the whole error so far, but
    /// comes after `shortest` counts at the earliest. If it is late, the next one makes up for it.
    pub(crate) fn tick(&mut self, duration: f32, shortest: f32) -> Interval {
        let due = bits(duration).saturating_add_signed(self.0);
        let made = due.max(bits(shortest));
        self.0 = due.wrapping_sub(made) as i64;
        Interval::from_bits(made)
    }

    /// Returns true if the error is too small to change `ticks` equal ticks.
    pub(crate) fn is_below(self, ticks: NonZeroU16) -> bool {
        self.0.unsigned_abs() < u64::from(ticks.get())
    }

    /// Returns how late the segments so far are, counts (less than 2¹⁵), rounded down to 2⁻¹⁶
    /// counts.
    pub(crate) const fn late(self) -> f32 {
        (-self.0 >> 16) as i32 as f32 / 65_536.0
    }

    /// Makes up for the error so far in a segment, and notes the new one. The segment is to take
    /// `duration`; its ticks begin with the interval `first` and grow by `change` each. All in
    /// 2⁻³² counts.
    pub(crate) fn settle(
        &mut self,
        first: u64,
        change: i64,
        ticks: NonZeroU16,
        duration: u64,
    ) -> (Interval, IntervalChange) {
        let count = i64::from(ticks.get());
        // At most half a count of the error is spread over the ticks, so one 32-bit division is
        // enough.
        let owed = self.0.clamp(i32::MIN.into(), i32::MAX.into()) as i32 / i32::from(ticks.get());
        let first = first.saturating_add_signed(owed.into());
        let made = (first as i64)
            .wrapping_mul(count)
            .wrapping_add(change.wrapping_mul(count * (count - 1) / 2));
        self.0 = self.0.wrapping_add((duration as i64).wrapping_sub(made));
        // A wait beyond the range of the timer was cut short: there is nothing to make up for.
        if self.0.unsigned_abs() > LARGEST_CARRY {
            self.0 = 0;
        }
        (
            Interval::from_bits(first),
            IntervalChange::from_bits(change),
        )
    }
}

/// Sixteen counts: more than rounding a segment can lose, unless it is longer than 2³¹ counts.
const LARGEST_CARRY: u64 = 16 << 32;

/// `counts` as a number of 2⁻³² counts, exact; `u64::MAX` if it does not fit.
pub(crate) fn bits(counts: f32) -> u64 {
    let whole = counts as u32;
    let rest = (counts - whole as f32) * TWO_32;
    u64::from(whole) << 32 | u64::from(rest as u32)
}

/// As [`bits`], with a sign.
fn signed_bits(counts: f32) -> i64 {
    let magnitude = bits(counts.abs()).min(i64::MAX as u64) as i64;
    if counts < 0.0 {
        -magnitude
    } else {
        magnitude
    }
}

const TWO_32: f32 = 4_294_967_296.0;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_segment_lasts_no_longer_than_asked_for() {
        assert_eq!(longest(1e5, 1e3, 1e-3), 1e-3);
        assert_eq!(steps(20e3, 0.0, 1e-3), 20);
        assert_eq!(steps(20e3, 0.0, 475e-6), 9);
        assert_eq!(steps(5.0, 0.0, 1e-3), 1);
    }

    #[test]
    fn near_rest_a_segment_is_one_step() {
        assert_eq!(steps(0.0, 1e6, 1e-3), 1);
        assert_eq!(steps(100.0, -1e6, 1e-3), 1);
    }

    #[test]
    fn smoothing_is_no_finer_than_needed_and_never_too_fast() {
        let level = |interval| smoothing(interval, 4e-6, 1.0).level();
        assert_eq!(level(9e-6), 0);
        assert_eq!(level(9.1e-6), 1);
        assert_eq!(level(20e-6), 2);
        assert_eq!(level(40e-6), 3);
        assert_eq!(smoothing(9.1e-6, 6e-6, 1.0).level(), 0); // half of it would be too short
        assert_eq!(level(1e-3), 3);
        assert_eq!(smoothing(1e-3, 100e-6, 0.4).level(), 1);
        assert_eq!(smoothing(1e-3, 4e-6, 0.0).level(), 4);
    }

    #[test]
    fn counts_become_bits_exactly_or_saturate() {
        assert_eq!(bits(1.5), 3 << 31);
        assert_eq!(signed_bits(-0.25), -(1 << 30));
        assert_eq!(bits(1e12), u64::MAX);
        assert_eq!(bits(-1.0), 0);
    }

    proptest! {
        /// However segments are rounded, their sum stays within a count of the sum of their
        /// durations.
        #[test]
        fn rounding_never_adds_up(pieces in prop::collection::vec((2u16..300, 300.0f32..3e4, -0.2f32..0.2), 1..200)) {
            let mut carry = Carry::default();
            let (mut due, mut made) = (0u64, 0u64);
            for (ticks, mean, bend) in pieces {
                let (count, middle) = (f32::from(ticks), f32::from(ticks / 2));
                let duration = mean * count;
                let linear = Linear::through(mean * middle * (1.0 + bend / count), middle, duration, count);
                let (first, change) = carry.round(linear, NonZeroU16::new(ticks).unwrap(), duration);
                due += bits(duration);
                let n = i128::from(ticks);
                made += (i128::from(first.to_bits()) * n + i128::from(change.to_bits()) * (n * (n - 1) / 2)) as u64;
                prop_assert!(due.abs_diff(made) < 4 << 32, "{} counts", due.abs_diff(made) >> 32);
            }
        }
    }
}
