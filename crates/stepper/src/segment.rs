//! Segments: the main loop makes them, the step interrupt plays them. Their parts: intervals, power,
//! and step smoothing, which is more ticks than steps where steps are slow.

use crate::{LineStart, MotorMask, OutputChange};
use core::num::NonZeroU16;
use fixed::types::{I1F31, I32F32, U1F31, U32F32};

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

/// Output power as a share of full power, 0 to 1 in steps of 2⁻³¹.
///
/// *Full* is defined outside this crate, by `$30` and the PWM timer's period.
///
/// Stored as power minus full power, -2³¹ to 0. The processor's saturating addition stops at the
/// lower end; a positive sum shows that the upper end was passed.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub struct Power {
    missing: i32,
}

/// How much [`Power`] changes from one tick to the next.
pub type PowerChange = I1F31;

/// Turns a [`Power`] into the compare value of a PWM timer.
///
/// It is twice the timer's period. A share has 31 bits after the point, so the upper 32 bits of the
/// product of both are the compare value: nothing has to be shifted.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PowerScale(u32);

impl PowerScale {
    /// Makes the scale of a timer of `period` counts.
    pub const fn new(period: u16) -> Self {
        Self((period as u32) << 1)
    }
}

/// The bits of full power.
const FULL_BITS: u32 = U1F31::ONE.to_bits();

impl Power {
    /// Output off.
    pub const OFF: Self = Self { missing: i32::MIN };
    /// Full power.
    pub const FULL: Self = Self { missing: 0 };

    /// Makes a power from a share of full power; more than full is full.
    pub fn from_share(share: U1F31) -> Self {
        let missing = share.to_bits().wrapping_sub(FULL_BITS).cast_signed();
        Self {
            missing: missing.min(0),
        }
    }

    /// The share of full power, 0 to 1.
    pub const fn share(self) -> U1F31 {
        U1F31::from_bits(self.missing.cast_unsigned().wrapping_add(FULL_BITS))
    }

    /// The compare value for a PWM timer whose period has the scale `scale`, rounded down: 0 is
    /// off, the period is full.
    ///
    /// Called from the step interrupt: one widening multiplication.
    #[inline]
    pub const fn level(self, scale: PowerScale) -> u32 {
        ((self.share().to_bits() as u64 * scale.0 as u64) >> 32) as u32
    }

    /// This power after one more tick. Stays within 0 to 1.
    #[must_use]
    #[inline]
    pub(crate) fn changed_by(self, change: PowerChange) -> Self {
        Self {
            missing: self.missing.saturating_add(change.to_bits()).min(0),
        }
    }
}

impl Default for Power {
    fn default() -> Self {
        Self::OFF
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for Power {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "{=u32}/2^31", self.share().to_bits());
    }
}

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
    /// Base-2 logarithm of the ticks to a step, 0 to [`MAX_SMOOTHING_LEVEL`].
    pub const fn level(self) -> u32 {
        self as u32
    }
}

/// How early motors other than the dominant one step: half a tick, so that they are early as often
/// as late; or not at all.
///
/// The same byte also tells whether the segment is a part of a step event. So the tick that loads a
/// segment needs one comparison to see whether anything is unusual.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Early {
    /// The earliness in 32nds of a step event, and the flag [`PART`].
    bits: u8,
}

/// Set in a part of a step event.
const PART: u8 = 0x80;

impl Early {
    /// Not early: for step events in parts, in which each motor steps exactly when it is due.
    pub const NOT: Self = Self { bits: 0 };

    /// Early by half a tick of `smoothing`.
    pub const fn half_a_tick(smoothing: Smoothing) -> Self {
        Self {
            bits: 1 << (MAX_SMOOTHING_LEVEL - smoothing.level()),
        }
    }

    /// The same earliness, for a segment that is a part of a step event.
    #[must_use]
    pub const fn of_a_part(self) -> Self {
        Self {
            bits: self.bits | PART,
        }
    }

    /// Whether it belongs to a part of a step event.
    pub const fn is_of_a_part(self) -> bool {
        self.bits & PART != 0
    }

    /// The same earliness, for a segment of whole step events.
    #[must_use]
    pub(crate) const fn in_whole_events(self) -> Self {
        Self {
            bits: self.bits & !PART,
        }
    }

    /// The byte: the earliness in 32nds of a step event in the lower seven bits, the flag of a part
    /// in the highest.
    pub const fn bits(self) -> u8 {
        self.bits
    }

    /// The distance that a motor with `steps` in the line advances in that time, in the tracer's
    /// units: a sixteenth of a step, divided by the line's step events.
    #[inline]
    pub(crate) const fn of(self, steps: u32) -> u32 {
        (steps * self.bits as u32) >> 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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

    #[test]
    fn full_power_is_the_whole_period_and_off_is_nothing() {
        assert_eq!(Power::FULL.level(PowerScale::new(8400)), 8400);
        assert_eq!(
            Power::FULL.level(PowerScale::new(u16::MAX)),
            u32::from(u16::MAX)
        );
        assert_eq!(Power::OFF.level(PowerScale::new(8400)), 0);
    }

    #[test]
    fn a_change_never_leaves_the_range() {
        let step = PowerChange::from_num(0.75);
        assert_eq!(Power::OFF.changed_by(-step), Power::OFF);
        assert_eq!(Power::FULL.changed_by(step), Power::FULL);
        assert_eq!(Power::OFF.changed_by(step).level(PowerScale::new(100)), 75);
    }

    #[test]
    fn more_than_full_is_full() {
        assert_eq!(Power::from_share(U1F31::MAX), Power::FULL);
        assert_eq!(Power::from_share(U1F31::ZERO), Power::default());
    }

    proptest! {
        /// Compares with sums of 64 bits, which cannot overflow.
        #[test]
        fn a_change_is_an_addition_kept_within_the_range(share in 0u32..=1 << 31, change: i32) {
            let power = Power::from_share(U1F31::from_bits(share));
            prop_assert_eq!(power.share().to_bits(), share);
            let sum = i64::from(share) + i64::from(change);
            let changed = power.changed_by(PowerChange::from_bits(change));
            prop_assert_eq!(i64::from(changed.share().to_bits()), sum.clamp(0, 1 << 31));
        }
    }

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

    #[test]
    fn early_is_half_a_tick() {
        let of = |smoothing| Early::half_a_tick(smoothing).of(10);
        assert_eq!(of(Smoothing::None), 80);
        assert_eq!(of(Smoothing::Eightfold), 10);
        assert_eq!(of(Smoothing::Sixteenfold), 5);
        assert_eq!(Early::NOT.of(10), 0);
    }
}
