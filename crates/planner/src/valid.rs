//! Checks whether motion can be planned: with a [`Config`], along a [`Move`], at [`Overrides`].

use crate::{Config, Curve, Feed, Move, Overrides};
use core::fmt;
use core::ops::RangeInclusive;

/// Allowed rates in mm/s, accelerations in mm/s² and arc tolerances in mm: every value that GRBL's
/// settings can have, and small enough that no `f32` overflows.
pub(crate) const ABOVE_ZERO: RangeInclusive<f32> = 1e-12..=1e10;
/// Allowed jerk in mm/s³ and junction deviation in mm.
const ZERO_OR_MORE: RangeInclusive<f32> = 0.0..=1e10;
/// Allowed longest segment in seconds. In longer ones the edges would not be exact.
const SEGMENT: RangeInclusive<f32> = 1e-6..=1e-3;
/// The slowest step timer, in counts a second: other parts count time in microseconds.
const SLOWEST_TIMER_HZ: u32 = 1_000_000;

/// The value of a [`Config`] with which nothing can be planned: not a number, infinite, or out of
/// range.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// This axis, counted from 0, has 0 steps/mm.
    StepsPerMm(usize),
    /// Highest rate of this axis, counted from 0: not within 10⁻¹² to 10¹⁰ mm/s.
    MaxRate(usize),
    /// Highest acceleration of this axis, counted from 0: not within 10⁻¹² to 10¹⁰ mm/s².
    Acceleration(usize),
    /// Not within 0 to 10¹⁰ mm/s³.
    Jerk,
    /// Not within 0 to 10¹⁰ Hz.
    Resonance,
    /// Not within 0 to 10¹⁰ mm.
    JunctionDeviation,
    /// Not within 10⁻¹² to 10¹⁰ mm.
    ArcTolerance,
    /// Below 1 MHz.
    Timer,
    /// Less than one count of the timer, or longer than the longest segment.
    ShortestTick,
    /// Not within 1 µs to 1 ms.
    LongestSegment,
    /// No room for a move.
    Moves,
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            Self::StepsPerMm(axis) => return write!(f, "axis {axis} has no steps/mm"),
            Self::MaxRate(axis) => return write!(f, "the rate of axis {axis} is not above 0 mm/s"),
            Self::Acceleration(axis) => {
                return write!(f, "the acceleration of axis {axis} is not above 0 mm/s²")
            }
            Self::Jerk => "the jerk is below 0 mm/s³",
            Self::Resonance => "the resonance is below 0 Hz",
            Self::JunctionDeviation => "the junction deviation is below 0 mm",
            Self::ArcTolerance => "the arc tolerance is not above 0 mm",
            Self::Timer => "the step timer is slower than 1 MHz",
            Self::ShortestTick => {
                "the shortest tick is no count of the step timer, or longer than a segment"
            }
            Self::LongestSegment => "the longest segment is not within 1 µs to 1 ms",
            Self::Moves => "there is no room for a move",
        };
        f.write_str(text)
    }
}

impl core::error::Error for ConfigError {}

impl<const AXES: usize> Config<AXES> {
    /// Checks that moves can be planned with these settings. [`crate::Planner::new`] asks.
    ///
    /// # Errors
    /// The first value that is not a number, infinite, or out of its range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        for (axis, scale) in self.steps_per_mm.iter().enumerate() {
            ensure(scale.nanos() > 0, ConfigError::StepsPerMm(axis))?;
        }
        for (axis, rate) in self.max_rate.iter().enumerate() {
            ensure(ABOVE_ZERO.contains(rate), ConfigError::MaxRate(axis))?;
        }
        for (axis, limit) in self.acceleration.iter().enumerate() {
            ensure(ABOVE_ZERO.contains(limit), ConfigError::Acceleration(axis))?;
        }
        let (jerk, deviation) = (&self.jerk, &self.junction_deviation);
        let tolerance = &self.arc_tolerance;
        ensure(ZERO_OR_MORE.contains(jerk), ConfigError::Jerk)?;
        let resonance = &self.resonance;
        ensure(ZERO_OR_MORE.contains(resonance), ConfigError::Resonance)?;
        ensure(
            ZERO_OR_MORE.contains(deviation),
            ConfigError::JunctionDeviation,
        )?;
        ensure(ABOVE_ZERO.contains(tolerance), ConfigError::ArcTolerance)?;
        ensure(self.timer_hz >= SLOWEST_TIMER_HZ, ConfigError::Timer)?;
        let segment = &self.longest_segment;
        ensure(SEGMENT.contains(segment), ConfigError::LongestSegment)?;
        let (tick, longest) = (self.shortest_tick.0, segment * self.timer_hz as f32);
        ensure(
            tick > 0 && tick as f32 <= longest,
            ConfigError::ShortestTick,
        )?;
        ensure(self.moves > 0, ConfigError::Moves)
    }
}

/// The value of a [`Move`] with which it cannot be planned.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MoveError {
    /// The speed or the time asked for is not a number, infinite, or not above 0.
    Feed,
    /// The rounding is not within 0 to 10¹⁰ mm.
    Rounding,
    /// The radius or the acceleration of the arc is not within 10⁻¹² to 10¹⁰ mm or mm/s².
    Curve,
}

impl fmt::Display for MoveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Feed => "the feed of the move is not a number above 0",
            Self::Rounding => "the rounding of the move's target is below 0 mm",
            Self::Curve => "the arc of the move has no radius or no acceleration above 0",
        })
    }
}

impl core::error::Error for MoveError {}

impl<const AXES: usize> Move<AXES> {
    /// Checks that the move can be planned. [`crate::Planner::push`] asks.
    ///
    /// # Errors
    /// The first value that is not a number, infinite, or out of its range.
    pub fn validate(&self) -> Result<(), MoveError> {
        if let Feed::PerMinute(feed) | Feed::InverseTime(feed) = self.feed {
            if !is_positive(feed) {
                return Err(MoveError::Feed);
            }
        }
        if !ZERO_OR_MORE.contains(&self.rounding) {
            return Err(MoveError::Rounding);
        }
        match self.curve {
            Some(curve) if !curve.is_valid() => Err(MoveError::Curve),
            Some(_) | None => Ok(()),
        }
    }
}

/// Returns true if a number is above 0 and finite. One comparison tells: positive floats have the
/// order of their bits, 0 is the first of them, and infinity is the last.
fn is_positive(number: f32) -> bool {
    number.to_bits().wrapping_sub(1) < f32::INFINITY.to_bits() - 1
}

impl Curve {
    fn is_valid(&self) -> bool {
        ABOVE_ZERO.contains(&self.radius) && ABOVE_ZERO.contains(&self.acceleration)
    }
}

/// An override is not within its range: the feed's 1 to 200 %, the rapids' 1 to 100 %.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OverrideError;

impl fmt::Display for OverrideError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the feed override is not 1 to 200 %, or the rapid override not 1 to 100 %")
    }
}

impl core::error::Error for OverrideError {}

impl Overrides {
    /// Checks that moves can be planned at these shares. [`crate::Planner::set_overrides`] asks.
    ///
    /// # Errors
    /// A share is out of its range.
    pub fn validate(self) -> Result<(), OverrideError> {
        let feed = (1..=Self::HIGHEST_FEED).contains(&self.feed);
        ensure(feed && (1..=100).contains(&self.rapid), OverrideError)
    }
}

/// Returns `error`, unless `holds`.
fn ensure<E>(holds: bool, error: E) -> Result<(), E> {
    holds.then_some(()).ok_or(error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cartesian, PixelQueue, Planner, Queue, StepsPerMm};
    use leadscrew_stepper::Ticks;
    use std::vec::Vec;

    type TwoAxes = Config<2>;

    const NEVER: [f32; 5] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -1e-30];

    fn refused(change: impl Fn(&mut TwoAxes)) -> Option<ConfigError> {
        let mut config = TwoAxes::default();
        change(&mut config);
        let (mut queue, mut pixels) = (Queue::<2, 2, 4>::new(), PixelQueue::<4>::new());
        let made = Planner::new(config, Cartesian, &mut queue, &mut pixels).err();
        assert_eq!(config.validate().err(), made);
        made
    }

    #[test]
    fn a_planner_is_made_of_the_defaults_and_of_the_ends_of_all_ranges() {
        assert_eq!(refused(|_| {}), None);
        assert_eq!(refused(|config| config.jerk = 0.0), None);
        assert_eq!(refused(|config| config.junction_deviation = 0.0), None);
        assert_eq!(refused(|config| config.max_rate = [1e-12, 1e10]), None);
        assert_eq!(refused(|config| config.longest_segment = 1e-3), None);
    }

    #[test]
    fn a_value_that_is_no_number_infinite_or_negative_is_named() {
        for value in NEVER {
            let found: Vec<_> = [
                refused(|config| config.max_rate[1] = value),
                refused(|config| config.acceleration[0] = value),
                refused(|config| config.jerk = value),
                refused(|config| config.resonance = value),
                refused(|config| config.junction_deviation = value),
                refused(|config| config.arc_tolerance = value),
                refused(|config| config.longest_segment = value),
            ]
            .into_iter()
            .collect();
            let expected = [
                ConfigError::MaxRate(1),
                ConfigError::Acceleration(0),
                ConfigError::Jerk,
                ConfigError::Resonance,
                ConfigError::JunctionDeviation,
                ConfigError::ArcTolerance,
                ConfigError::LongestSegment,
            ];
            assert_eq!(found, expected.map(Some), "{value}");
        }
    }

    #[test]
    fn zero_is_refused_where_it_would_make_a_move_without_end() {
        let none = StepsPerMm::from_nanos(0);
        assert_eq!(
            refused(|config| config.steps_per_mm[1] = none),
            Some(ConfigError::StepsPerMm(1))
        );
        assert_eq!(
            refused(|config| config.max_rate[0] = 0.0),
            Some(ConfigError::MaxRate(0))
        );
        assert_eq!(
            refused(|config| config.acceleration[1] = 0.0),
            Some(ConfigError::Acceleration(1))
        );
        assert_eq!(
            refused(|config| config.timer_hz = 0),
            Some(ConfigError::Timer)
        );
        let no_tick = |config: &mut TwoAxes| config.shortest_tick = Ticks(0);
        assert_eq!(refused(no_tick), Some(ConfigError::ShortestTick));
        assert_eq!(refused(|config| config.moves = 0), Some(ConfigError::Moves));
    }

    #[test]
    fn a_planner_keeps_its_settings_where_others_are_refused() {
        let (mut queue, mut pixels) = (Queue::<2, 2, 4>::new(), PixelQueue::<4>::new());
        let config = TwoAxes {
            moves: 3,
            ..TwoAxes::default()
        };
        let mut planner = Planner::new(config, Cartesian, &mut queue, &mut pixels).unwrap();
        let bad = TwoAxes {
            jerk: f32::NAN,
            moves: 2,
            ..config
        };
        assert_eq!(planner.configure(bad), Err(ConfigError::Jerk));
        assert_eq!(
            *planner.config(),
            TwoAxes {
                pixels: 0,
                ..config
            }
        );
    }

    #[test]
    fn numbers_above_zero_and_finite_are_told_from_all_others() {
        for number in [1e-45, f32::MIN_POSITIVE, 1.0, f32::MAX] {
            assert!(is_positive(number) && !is_positive(-number), "{number}");
        }
        for number in NEVER.into_iter().chain([0.0, -0.0, -f32::NAN]) {
            assert!(!is_positive(number), "{number}");
        }
    }

    #[test]
    fn an_error_says_what_is_wrong_and_where() {
        let text = std::format!("{}", ConfigError::MaxRate(2));
        assert_eq!(text, "the rate of axis 2 is not above 0 mm/s");
    }
}
