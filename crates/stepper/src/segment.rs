//! Segments: the main loop makes them, the step interrupt plays them.

use crate::{Early, LineStart, MotorMask, OutputChange, Power, PowerChange, Smoothing};
use core::num::NonZeroU16;
use fixed::types::{I32F32, U32F32};

/// Whole counts of the step timer. The planner knows the timer's frequency.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ticks(pub u32);

/// Time from one tick to the next, in counts of the step timer, with a resolution of 2⁻³² counts.
pub type Interval = U32F32;

/// How much an [`Interval`] changes from one tick to the next.
pub type IntervalChange = I32F32;

/// A run of ticks of one [`crate::Line`], whose interval and power change linearly.
///
/// Made by the planner's segmenter (main loop), consumed by [`crate::Stepper`] (step interrupt).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Segment<const MOTORS: usize> {
    /// The line that begins with this segment; `None` where the present line goes on.
    pub line: Option<LineStart<MOTORS>>,
    /// Ticks in this segment: step events times `2^smoothing`; 1 in a part of a step event.
    pub ticks: NonZeroU16,
    /// Ticks to a step event.
    pub smoothing: Smoothing,
    /// The motors that advance in a part of a step event. A step event may be divided into parts of
    /// one tick each, so that each motor steps when it is due; each motor advances in one of the
    /// parts. [`MotorMask::ALL`] in all other segments.
    pub motors: MotorMask,
    /// Whether a step event ends with this segment: of the parts of a step event only the last one
    /// ends it.
    pub ends_event: bool,
    /// How early motors other than the dominant one step: half a tick of `smoothing`. In the last
    /// segment before a coarser smoothing it is half a tick of the coarser smoothing, because
    /// motors have to be that early when it begins. [`Early::of_a_part`] in parts.
    pub early: Early,
    /// Time from the segment's start to its first tick.
    pub interval: Interval,
    /// How much longer each further interval is than the one before.
    pub interval_change: IntervalChange,
    /// Power from the segment's start to its first tick.
    pub power: Power,
    /// How much more power each further interval has than the one before.
    pub power_change: PowerChange,
    /// The outputs that change at the segment's start.
    pub outputs: OutputChange,
    /// The power at rest, if motion comes to rest with this segment's last tick. `None` if another
    /// segment has to follow; its absence is an underrun.
    pub at_rest: Option<Power>,
}

impl<const MOTORS: usize> Segment<MOTORS> {
    /// Step events that end in this segment.
    pub fn step_events(&self) -> u32 {
        if self.ends_event {
            u32::from(self.ticks.get()) >> self.smoothing.level()
        } else {
            0
        }
    }

    /// How long this segment takes, timer counts, rounded down: `p·n + d·n(n−1)/2`. Main loop.
    pub fn duration(&self) -> u32 {
        let ticks = u64::from(self.ticks.get());
        let first = ((self.interval.to_bits() >> 16) * ticks) >> 16; // 48 bits by 16
        let pairs = (ticks * (ticks - 1) / 2) as i64;
        let change = (self.interval_change.to_bits() >> 16).saturating_mul(pairs) >> 16;
        u32::try_from(first.saturating_add_signed(change)).unwrap_or(u32::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(ticks: u16, interval: u32, change: f64) -> Segment<1> {
        Segment {
            line: None,
            ticks: NonZeroU16::new(ticks).unwrap(),
            smoothing: Smoothing::None,
            motors: MotorMask::ALL,
            ends_event: true,
            early: Early::NOT,
            interval: Interval::from_num(interval),
            interval_change: IntervalChange::from_num(change),
            power: Power::OFF,
            power_change: PowerChange::ZERO,
            outputs: OutputChange::NONE,
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
