//! One straight move, counted in motor steps, for Bresenham's tracer; and sets of motors.

use crate::{Early, MAX_SMOOTHING_LEVEL};
use core::fmt;
use core::num::NonZeroU32;

/// The largest number of motors that a [`MotorMask`] can name.
pub const MAX_MOTORS: usize = 8;

/// A set of motors: bit *m* stands for motor *m* (bit 0 is X where axes and motors coincide).
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

    /// Makes a set of the one motor `motor`; empty where `motor` is not below [`MAX_MOTORS`].
    pub const fn only(motor: usize) -> Self {
        if motor < MAX_MOTORS {
            Self(1 << motor)
        } else {
            Self::NONE
        }
    }

    /// Whether the set is empty.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether `motor` is in the set.
    pub const fn contains(self, motor: usize) -> bool {
        motor < MAX_MOTORS && self.0 >> motor & 1 == 1
    }

    /// The motors that are in either set.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The motors of this set that are not in `other`.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }
}

/// The largest number of step events of one line: the tracer's counters hold this number
/// at the finest smoothing in 30 bits.
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
    /// [`LineError`] where no motor steps, or one has too many steps.
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

    /// Steps that each motor takes.
    pub const fn steps(&self) -> &[u32; MOTORS] {
        &self.steps
    }

    /// Steps of the dominant motor, 1 to [`MAX_STEP_EVENTS`].
    pub const fn step_events(&self) -> NonZeroU32 {
        self.step_events
    }

    /// The motors that turn in the negative direction.
    pub const fn direction(&self) -> MotorMask {
        self.direction
    }

    /// The rest of this line after `taken` step events, the last of which was in a segment with
    /// this `early`; `None` where nothing is left.
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
    /// The distance of each motor from its first step, less 1, in the tracer's units.
    left: [u32; MOTORS],
}

impl<const MOTORS: usize> LineStart<MOTORS> {
    /// Makes the start of `line`. The dominant motor begins a whole step before its first step, the
    /// others half a step before theirs, less the `early` of the line's first segment. Called from
    /// the main loop.
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

    /// The line.
    pub const fn line(&self) -> &Line<MOTORS> {
        &self.line
    }

    pub(crate) const fn left(&self) -> &[u32; MOTORS] {
        &self.left
    }
}

/// The steps that a motor with `steps` in `events` has made after the first `taken` step events. As
/// in the tracer, it is the whole number nearest to the motor's share half a tick later.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Smoothing;

    #[test]
    fn a_motor_beyond_the_last_is_in_no_set() {
        assert_eq!(MotorMask::only(MAX_MOTORS), MotorMask::NONE);
        assert!(!MotorMask::from_bits(0xFF).contains(MAX_MOTORS));
    }

    #[test]
    fn with_and_without_undo_each_other() {
        let xz = MotorMask::only(0).with(MotorMask::only(2));
        assert_eq!(xz.bits(), 0b101);
        assert_eq!(xz.without(MotorMask::only(2)), MotorMask::only(0));
    }

    #[test]
    fn the_motor_with_the_most_steps_is_dominant() {
        let line = Line::new([3, -7, 0]).unwrap();
        assert_eq!(line.step_events().get(), 7);
        assert_eq!(line.direction(), MotorMask::only(1));
    }

    #[test]
    fn no_steps_and_too_many_steps_are_refused() {
        assert_eq!(Line::new([0, 0]), Err(LineError::NoSteps));
        assert_eq!(Line::new([i32::MIN, 0]), Err(LineError::TooLong));
        assert!(Line::new([MAX_STEP_EVENTS as i32]).is_ok());
    }

    #[test]
    fn the_rest_of_a_line_and_what_was_taken_make_the_line() {
        let line = Line::new([100, -37, 100, 1]).unwrap();
        let rest = line
            .rest(41, Early::half_a_tick(Smoothing::Sixteenfold))
            .unwrap();
        assert_eq!(rest.steps(), &[59, 37 - 15, 59, 1]);
        assert_eq!(rest.direction(), line.direction());
        assert_eq!(line.rest(100, Early::NOT), None);
        assert_eq!(line.rest(101, Early::NOT), None);
    }
}
