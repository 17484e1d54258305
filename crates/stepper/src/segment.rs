//! The work that the main loop hands to the step interrupt: lines, which are straight moves counted
//! in motor steps, and segments, which tell when their steps come and at which power.

use crate::OutputChange;
use core::fmt;
use core::num::{NonZeroU16, NonZeroU32};
use fixed::types::{I1F31, I32F32, U1F31, U32F32};

/// The largest number of motors that a [`MotorMask`] can name.
pub const MAX_MOTORS: usize = 8;

/// A set of motors: bit *m* stands for motor *m* (bit 0 is X if axes and motors coincide).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotorMask(u8);

impl MotorMask {
    /// No motor.
    pub const NONE: Self = Self(0);

    /// All eight motors.
    pub const ALL: Self = Self(u8::MAX);

    /// Makes a set from its bits.
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// Returns the set's bits.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Makes a set of the one motor `motor`; empty if `motor` is not below [`MAX_MOTORS`].
    pub const fn only(motor: usize) -> Self {
        if motor < MAX_MOTORS {
            Self(1 << motor)
        } else {
            Self::NONE
        }
    }

    /// Returns true if the set is empty.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Returns true if `motor` is in the set.
    pub const fn contains(self, motor: usize) -> bool {
        motor < MAX_MOTORS && self.0 >> motor & 1 == 1
    }

    /// Returns the motors that are in either set.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Returns the motors of this set that are not in `other`.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }
}

/// The largest number of step events of one line. The tracer counts up to sixteen times this number
/// (the finest smoothing) in 30 bits.
pub const MAX_STEP_EVENTS: u32 = (1 << (30 - MAX_SMOOTHING_LEVEL)) - 1;

/// A straight move as motor steps: the number and the direction of each motor's steps.
///
/// The motor with the most steps is the *dominant* one; it steps at every step event.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Line<const MOTORS: usize> {
    steps: [u32; MOTORS],
    step_events: NonZeroU32,
    direction: MotorMask,
}

/// The reason why a move cannot be a [`Line`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LineError {
    /// No motor steps.
    NoSteps,
    /// A motor would take more than [`MAX_STEP_EVENTS`] steps.
    TooLong,
}

impl fmt::Display for LineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoSteps => "the move is shorter than one step",
            Self::TooLong => "the move has too many steps",
        })
    }
}

impl core::error::Error for LineError {}

impl<const MOTORS: usize> Line<MOTORS> {
    /// Makes the line that moves each motor by its signed number of steps.
    ///
    /// # Errors
    /// [`LineError`] if no motor steps, or one has too many steps.
    pub fn new(delta: [i32; MOTORS]) -> Result<Self, LineError> {
        let steps = delta.map(i32::unsigned_abs);
        let most = steps.iter().copied().max().unwrap_or(0);
        let step_events = NonZeroU32::new(most).ok_or(LineError::NoSteps)?;
        if most > MAX_STEP_EVENTS {
            return Err(LineError::TooLong);
        }
        Ok(Self {
            steps,
            step_events,
            direction: negative(delta),
        })
    }

    /// Returns the steps that each motor takes.
    pub const fn steps(&self) -> &[u32; MOTORS] {
        &self.steps
    }

    /// Returns the steps of the dominant motor, 1 to [`MAX_STEP_EVENTS`].
    pub const fn step_events(&self) -> NonZeroU32 {
        self.step_events
    }

    /// Returns the motors that turn in the negative direction.
    pub const fn direction(&self) -> MotorMask {
        self.direction
    }

    /// Returns the rest of this line after `taken` step events, the last of which was in a segment
    /// with this `early`; `None` if nothing is left.
    ///
    /// Called from the main loop, for motion that goes on after another line came between
    /// (parking).
    pub fn rest(&self, taken: u32, early: Early) -> Option<Self> {
        let left = NonZeroU32::new(self.step_events.get().checked_sub(taken)?)?;
        let mut steps = self.steps;
        let early = early.in_whole_events();
        for motor in &mut steps {
            *motor -= taken_of(*motor, self.step_events, taken, early);
        }
        Some(Self {
            steps,
            step_events: left,
            direction: self.direction,
        })
    }
}

/// A line, and the tracer's state at its start. The main loop computes the state, so that the tick
/// which takes the line only copies it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LineStart<const MOTORS: usize> {
    line: Line<MOTORS>,
    /// The distance of each motor from its first step, less 1, in the tracer's units (see
    /// [`Early::of`]).
    left: [u32; MOTORS],
}

impl<const MOTORS: usize> LineStart<MOTORS> {
    /// Makes the start of `line`. The dominant motor begins a whole step before its first step. The
    /// others begin half a step before their first steps, less the `early` of the line's first
    /// segment. Called from the main loop.
    pub fn new(line: Line<MOTORS>, early: Early) -> Self {
        let early = early.in_whole_events();
        let events = line.step_events.get();
        let full = events << MAX_SMOOTHING_LEVEL;
        let left = line.steps.map(|steps| match steps == events {
            true => full - 1,
            false => full / 2 - early.of(steps) - 1,
        });
        Self { line, left }
    }

    /// Returns the line.
    pub const fn line(&self) -> &Line<MOTORS> {
        &self.line
    }

    pub(crate) const fn left(&self) -> &[u32; MOTORS] {
        &self.left
    }
}

/// The steps that a motor with `steps` in `events` has made after the first `taken` step events. As
/// in the tracer, this is the whole number nearest to the motor's share at a time `early` later.
fn taken_of(steps: u32, events: NonZeroU32, taken: u32, early: Early) -> u32 {
    if steps == events.get() {
        return taken;
    }
    let full = u64::from(events.get()) << MAX_SMOOTHING_LEVEL;
    let way = u64::from(steps << MAX_SMOOTHING_LEVEL) * u64::from(taken);
    ((way + u64::from(early.of(steps)) + full / 2) / full) as u32
}

fn negative<const MOTORS: usize>(delta: [i32; MOTORS]) -> MotorMask {
    delta
        .iter()
        .enumerate()
        .filter(|(_, steps)| **steps < 0)
        .fold(MotorMask::NONE, |mask, (motor, _)| {
            mask.with(MotorMask::only(motor))
        })
}

/// Whole counts of the step timer. The planner knows the timer's frequency.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ticks(pub u32);

/// Time from one tick to the next, in counts of the step timer, with a resolution of 2⁻³² counts.
pub type Interval = U32F32;

/// The change of an [`Interval`] from one tick to the next.
pub type IntervalChange = I32F32;

/// A run of ticks of one [`crate::Line`], whose interval and power change linearly.
///
/// Made by the planner's segmenter (main loop), consumed by [`crate::Stepper`] (step interrupt).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Segment<const MOTORS: usize> {
    /// The line that begins with this segment; `None` if the present line goes on.
    pub line: Option<LineStart<MOTORS>>,
    /// Ticks in this segment: step events times `2^smoothing`; 1 in a part of a step event.
    pub ticks: NonZeroU16,
    /// Ticks to a step event.
    pub smoothing: Smoothing,
    /// The motors that advance in a part of a step event. A step event may be divided into parts of
    /// one tick each, so that each motor steps when it is due; each motor advances in one of the
    /// parts. [`MotorMask::ALL`] in all other segments.
    pub motors: MotorMask,
    /// True if a step event ends with this segment: of the parts of a step event only the last one
    /// ends it.
    pub ends_event: bool,
    /// The time by which motors other than the dominant one step early: half a tick of `smoothing`.
    /// In the last segment before a coarser smoothing it is half a tick of the coarser smoothing,
    /// because motors have to be that early when the coarser smoothing begins. [`Early::of_a_part`]
    /// in parts.
    pub early: Early,
    /// Time from the segment's start to its first tick.
    pub interval: Interval,
    /// The amount by which each further interval is longer than the one before.
    pub interval_change: IntervalChange,
    /// Power from the segment's start to its first tick.
    pub power: Power,
    /// The amount by which each further interval has more power than the one before.
    pub power_change: PowerChange,
    /// The outputs that change at the segment's start.
    pub outputs: OutputChange,
    /// The power at rest, if motion comes to rest with this segment's last tick. `None` if another
    /// segment has to follow. A missing segment is then an underrun.
    pub at_rest: Option<Power>,
}

impl<const MOTORS: usize> Segment<MOTORS> {
    /// Returns the number of step events that end in this segment.
    pub fn step_events(&self) -> u32 {
        if self.ends_event {
            u32::from(self.ticks.get()) >> self.smoothing.level()
        } else {
            0
        }
    }

    /// Returns the time that this segment takes, timer counts, rounded down: `p·n + d·n(n−1)/2`.
    /// Main loop.
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

/// The change of [`Power`] from one tick to the next.
pub type PowerChange = I1F31;

/// Turns a [`Power`] into the compare value of a PWM timer.
///
/// The scale is twice the timer's period. A share has 31 bits after the point, so the upper 32 bits
/// of `share · scale` are the compare value: nothing has to be shifted.
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
    /// No power: the output is off.
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

    /// Returns the share of full power, 0 to 1.
    pub const fn share(self) -> U1F31 {
        U1F31::from_bits(self.missing.cast_unsigned().wrapping_add(FULL_BITS))
    }

    /// Returns the compare value for a PWM timer whose period has the scale `scale`, rounded down:
    /// 0 is off, the period is full.
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
    /// Returns the base-2 logarithm of the ticks to a step, 0 to [`MAX_SMOOTHING_LEVEL`].
    pub const fn level(self) -> u32 {
        self as u32
    }
}

/// The time by which motors other than the dominant one step early: half a tick, or not at all.
///
/// A motor can step only at a tick. A motor that is half a tick early steps at the tick nearest to
/// its due time; otherwise it would step at the first tick after its due time.
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

    /// Makes motors early by half a tick of `smoothing`.
    pub const fn half_a_tick(smoothing: Smoothing) -> Self {
        Self {
            bits: 1 << (MAX_SMOOTHING_LEVEL - smoothing.level()),
        }
    }

    /// Returns the same earliness, for a segment that is a part of a step event.
    #[must_use]
    pub const fn of_a_part(self) -> Self {
        Self {
            bits: self.bits | PART,
        }
    }

    /// Returns true if this is the earliness of a part of a step event.
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

    /// Returns the byte: the earliness in 32nds of a step event in the lower seven bits, the flag
    /// of a part in the highest.
    pub const fn bits(self) -> u8 {
        self.bits
    }

    /// The distance that a motor with `steps` in the line advances in the time by which it is
    /// early. The tracer's unit of distance is a sixteenth of a step, divided by the line's step
    /// events.
    #[inline]
    pub(crate) const fn of(self, steps: u32) -> u32 {
        (steps * self.bits as u32) >> 1
    }
}

#[cfg(test)]
mod tests;
