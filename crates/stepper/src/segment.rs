//! What the main loop hands to the step interrupt.

use crate::{Line, Power, PowerChange};
use core::num::NonZeroU16;
use fixed::types::{I32F32, U32F32};

/// Whole counts of the step timer. Its frequency is the planner's to know.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ticks(pub u32);

/// Time from one tick to the next, in counts of the step timer, in steps of 2⁻³².
pub type Interval = U32F32;

/// How much an [`Interval`] changes from one tick to the next.
pub type IntervalChange = I32F32;

/// The finest step smoothing: `2^4` ticks to a step of the dominant motor.
pub const MAX_SMOOTHING_LEVEL: u32 = 4;

/// Step smoothing: `2^level` ticks to a step of the dominant motor.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Smoothing {
    /// One tick a step.
    #[default]
    None = 0,
    /// Two ticks a step.
    Twofold = 1,
    /// Four ticks a step.
    Fourfold = 2,
    /// Eight ticks a step.
    Eightfold = 3,
    /// Sixteen ticks a step.
    Sixteenfold = 4,
}

impl Smoothing {
    /// Half a tick of a motor that takes `steps` in a line, in the tracer's units: sixteenths of a step over the line's
    /// step events.
    #[inline]
    pub(crate) const fn half_tick(self, steps: u32) -> u32 {
        (steps << (MAX_SMOOTHING_LEVEL - self.level())) >> 1
    }

    /// Base-2 logarithm of the ticks to a step, 0 to [`MAX_SMOOTHING_LEVEL`].
    pub const fn level(self) -> u32 {
        self as u32
    }
}

/// Digital outputs that change in step with the motion, one bit each.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Outputs(pub u16);

/// A run of ticks of one [`Line`], whose interval and power change linearly.
///
/// Made by the planner's segmenter (main loop), consumed by [`crate::Stepper`] (step interrupt).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Segment<const MOTORS: usize> {
    /// The line that begins with this segment; `None` where the one under way goes on.
    pub line: Option<Line<MOTORS>>,
    /// Ticks in this segment: step events times `2^smoothing`.
    pub ticks: NonZeroU16,
    /// Ticks to a step event.
    pub smoothing: Smoothing,
    /// The motors other than the dominant one step up to half a tick of this smoothing before their time, so that they
    /// are as often early as late. No finer than `smoothing`; coarser in the last segment before a coarser one: there
    /// the half tick that is to come is longer than one of its own.
    pub early: Smoothing,
    /// Time from the segment's start to its first tick.
    pub interval: Interval,
    /// What each further interval is longer than the one before.
    pub interval_change: IntervalChange,
    /// Power from the segment's start to its first tick.
    pub power: Power,
    /// What the power of each further interval is more than that of the one before.
    pub power_change: PowerChange,
    /// Synchronised outputs, set at the segment's start.
    pub outputs: Outputs,
    /// The power at rest, where motion comes to rest with this segment's last tick; `None` where more
    /// must follow: if nothing does, that is an underrun.
    pub at_rest: Option<Power>,
}

impl<const MOTORS: usize> Segment<MOTORS> {
    /// How long it takes, timer counts, rounded down: `p·n + d·n(n−1)/2`. Main loop.
    pub fn duration(&self) -> u32 {
        let ticks = u64::from(self.ticks.get());
        let first = (self.interval.to_bits() >> 16).saturating_mul(ticks) >> 16;
        let pairs = (ticks * (ticks - 1) / 2) as i64;
        let change = (self.interval_change.to_bits() >> 16).saturating_mul(pairs) >> 16;
        u32::try_from(first.saturating_add_signed(change)).unwrap_or(u32::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_levels_are_the_logarithms_of_the_ticks_to_a_step() {
        let all = [
            Smoothing::None,
            Smoothing::Twofold,
            Smoothing::Fourfold,
            Smoothing::Eightfold,
            Smoothing::Sixteenfold,
        ];
        assert_eq!(all.map(Smoothing::level), [0, 1, 2, 3, MAX_SMOOTHING_LEVEL]);
    }

    fn segment(ticks: u16, interval: u32, change: f64) -> Segment<1> {
        Segment {
            line: None,
            ticks: NonZeroU16::new(ticks).unwrap(),
            smoothing: Smoothing::None,
            early: Smoothing::None,
            interval: Interval::from_num(interval),
            interval_change: IntervalChange::from_num(change),
            power: Power::OFF,
            power_change: PowerChange::ZERO,
            outputs: Outputs(0),
            at_rest: None,
        }
    }

    #[test]
    fn a_segment_lasts_as_long_as_its_intervals_together() {
        assert_eq!(segment(4, 100, 0.0).duration(), 400);
        assert_eq!(segment(4, 100, 10.0).duration(), 460);
        assert_eq!(segment(4, 100, -10.5).duration(), 337);
        assert_eq!(segment(u16::MAX, u32::MAX, 0.0).duration(), u32::MAX);
    }
}
