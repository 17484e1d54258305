//! Checks whether a machine can be built with a [`MachineConfig`].

use crate::board::Duration;
use crate::config::{AxisKind, MachineConfig, ParkingConfig, Squaring};
use crate::interpreter::axes::WITHOUT_EXTRUDER;
use crate::step_timing::TimingError;
use core::fmt;
use leadscrew_planner as planner;

/// The longest delay after the safety door was closed: an hour.
const LONGEST_DELAY: Duration = Duration::from_ticks(3_600_000_000);

/// The fastest rate of parking, mm/min, and the farthest place, mm.
const MOST: f32 = 2e9;

/// The value of a [`MachineConfig`] with which no machine can be built.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// The kinds of the axes: one of the first three is absent or an extruder, an axis comes after
    /// an absent one, or there is more than one extruder.
    Axes,
    /// A time of making steps.
    StepTiming(TimingError),
    /// A line may have no character.
    LineLength,
    /// The queue of a serial line takes no byte.
    ReceiveSize,
    /// Spindle or coolant delay: longer than an hour.
    Delay,
    /// The allowed distance of two switches, as a share or in mm: not a number, or below 0.
    Squaring,
    /// The way back from a switch: not a number, or below 0.
    BackOff,
    /// The axis to park is none of the machine's.
    ParkingAxis,
    /// A place, distance or rate of parking: not a number, a rate that is not above 0, or a
    /// distance below 0.
    Parking,
    /// Nothing can be planned.
    Planner(planner::ConfigError),
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Axes => {
                "axes: X, Y and Z have to be there, absent axes are the last ones, and one axis \
                 at most is an extruder"
            }
            Self::StepTiming(error) => return error.fmt(f),
            Self::LineLength => "line_length: a line has to have a character",
            Self::ReceiveSize => "receive_size: a serial line has to take a byte",
            Self::Delay => "spindle_delay and coolant_delay: an hour at most",
            Self::Squaring => "squaring: a share or a distance is not 0 or more",
            Self::BackOff => "rules.back_off_mm: it is not 0 or more",
            Self::ParkingAxis => "options.parking.axis: the machine has no such axis",
            Self::Parking => "options.parking: a rate is not above 0, or a place is no number",
            Self::Planner(error) => return error.fmt(f),
        })
    }
}

impl core::error::Error for ConfigError {}

impl From<planner::ConfigError> for ConfigError {
    fn from(error: planner::ConfigError) -> Self {
        Self::Planner(error)
    }
}

impl<const AXES: usize> MachineConfig<AXES> {
    /// Checks the values that do not depend on settings. [`crate::machine::Machine::new`] asks;
    /// the planner then checks the rest.
    ///
    /// # Errors
    /// The first value with which no machine can be built.
    pub fn validate(&self) -> Result<(), ConfigError> {
        ensure(are_axes(&self.axes), ConfigError::Axes)?;
        let timing = self.step_timing.validate();
        timing.map_err(ConfigError::StepTiming)?;
        ensure(self.line_length > 0, ConfigError::LineLength)?;
        ensure(self.receive_size > 0, ConfigError::ReceiveSize)?;
        let delay = self.spindle_delay.max(self.coolant_delay);
        ensure(delay <= LONGEST_DELAY, ConfigError::Delay)?;
        ensure(self.squaring.is_valid(), ConfigError::Squaring)?;
        ensure(is_distance(self.rules.back_off_mm), ConfigError::BackOff)?;
        let Some(parking) = self.options.parking else {
            return Ok(());
        };
        let parks = parking.axis < AxisKind::count(&self.axes);
        ensure(parks, ConfigError::ParkingAxis)?;
        ensure(parking.is_valid(), ConfigError::Parking)
    }
}

impl Squaring {
    fn is_valid(&self) -> bool {
        [self.tolerance, self.least_mm, self.most_mm].map(is_distance) == [true; 3]
    }
}

impl ParkingConfig {
    fn is_valid(&self) -> bool {
        let rates = [self.rate, self.pull_out_rate];
        self.target_mm.abs() <= MOST
            && is_distance(self.pull_out_mm)
            && rates.iter().all(|rate| *rate > 0.0 && *rate <= MOST)
    }
}

/// Returns true if `mm` is a number, and 0 or more.
fn is_distance(mm: f32) -> bool {
    (0.0..=MOST).contains(&mm)
}

/// Returns true if a machine can have axes of these kinds in this order. [`AxisKind`] has the rules.
fn are_axes<const AXES: usize>(axes: &[AxisKind; AXES]) -> bool {
    let further = |kind: &AxisKind| matches!(kind, AxisKind::Extruder | AxisKind::Absent);
    let count = axes.iter().filter(|kind| **kind == AxisKind::Extruder);
    AXES > 0
        && count.count() <= 1
        && !axes.iter().take(WITHOUT_EXTRUDER).any(further)
        && axes
            .iter()
            .skip_while(|kind| **kind != AxisKind::Absent)
            .all(|kind| *kind == AxisKind::Absent)
}

/// Returns `error`, unless `holds`.
fn ensure(holds: bool, error: ConfigError) -> Result<(), ConfigError> {
    holds.then_some(()).ok_or(error)
}
