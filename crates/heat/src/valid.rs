//! Configurations with which heat would not be watched are refused.

use crate::heater::{HeaterConfig, Limits};
use crate::sensor::Sensor;
use crate::HeatConfig;
use core::fmt;

/// A configuration with which heat would not be watched, or not regulated.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum ConfigError {
    /// The reference voltage is above 0 V.
    Reference,
    /// `nozzle` and `bed` are numbers of heaters.
    NoSuchHeater,
    /// The values of this heater's sensor are numbers above 0; the offset may be any number.
    Sensor(usize),
    /// The temperatures of this heater ascend: `coldest` below 0 °C or above, then 0 °C and `most`,
    /// then `hottest`; `extrusion` is a number.
    Temperatures(usize),
    /// This heater's `patience` and `answer` are above 0.
    Answer(usize),
    /// This heater's `hysteresis` is above 0 K, and at most its `band`.
    Band(usize),
}

impl ConfigError {
    /// Returns the number of the heater that is wrong, if it is one of them.
    pub const fn heater(self) -> Option<usize> {
        match self {
            Self::Reference | Self::NoSuchHeater => None,
            Self::Sensor(heater)
            | Self::Temperatures(heater)
            | Self::Answer(heater)
            | Self::Band(heater) => Some(heater),
        }
    }

    /// Returns the expected values, for people.
    pub const fn expected(self) -> &'static str {
        match self {
            Self::Reference => "expected a reference voltage above 0 V",
            Self::NoSuchHeater => "expected `nozzle` and `bed` to be numbers of heaters",
            Self::Sensor(_) => "expected a sensor whose values are above 0",
            Self::Temperatures(_) => "expected `coldest`, `most` and `hottest` in ascending order",
            Self::Answer(_) => "expected `patience` and `answer` above 0",
            Self::Band(_) => "expected `hysteresis` above 0, and at most `band`",
        }
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(heater) = self.heater() {
            write!(f, "heater {heater}: ")?;
        }
        f.write_str(self.expected())
    }
}

impl core::error::Error for ConfigError {}

fn ensure(is_met: bool, error: ConfigError) -> Result<(), ConfigError> {
    match is_met {
        true => Ok(()),
        false => Err(error),
    }
}

/// Returns true if a value is a number above 0. NaN is not.
fn is_positive(value: f32) -> bool {
    value > 0.0 && value.is_finite()
}

impl Sensor {
    fn is_valid(self) -> bool {
        match self {
            Self::Linear { offset, gain } => offset.is_finite() && is_positive(gain),
            Self::Thermistor { r25, beta, pull_up } => {
                [r25, beta, pull_up].map(is_positive) == [true; 3]
            }
        }
    }
}

impl Limits {
    fn ascend(&self) -> bool {
        let ascend = self.coldest < self.most && self.most < self.hottest;
        let bounds = [self.coldest, self.hottest, self.extrusion];
        ascend && is_positive(self.most) && bounds.iter().all(|bound| bound.is_finite())
    }
}

impl HeaterConfig {
    fn validate(&self, heater: usize) -> Result<(), ConfigError> {
        let Limits {
            patience,
            answer,
            band,
            ..
        } = self.limits;
        ensure(self.sensor.is_valid(), ConfigError::Sensor(heater))?;
        ensure(self.limits.ascend(), ConfigError::Temperatures(heater))?;
        let answers = patience > 0 && is_positive(answer);
        ensure(answers, ConfigError::Answer(heater))?;
        let watched = is_positive(self.hysteresis) && self.hysteresis <= band && band.is_finite();
        ensure(watched, ConfigError::Band(heater))
    }
}

impl HeatConfig {
    /// Checks the extension's configuration and its heaters' configurations. [`crate::Heat::new`]
    /// calls this method.
    ///
    /// # Errors
    /// A value with which a heater would not be watched.
    pub fn validate(&self, heaters: &[HeaterConfig]) -> Result<(), ConfigError> {
        ensure(is_positive(self.reference), ConfigError::Reference)?;
        let named = [Some(self.nozzle).filter(|_| !heaters.is_empty()), self.bed];
        let exist = named
            .into_iter()
            .flatten()
            .all(|heater| heater < heaters.len());
        ensure(exist, ConfigError::NoSuchHeater)?;
        let mut numbered = heaters.iter().enumerate();
        numbered.try_for_each(|(number, heater)| heater.validate(number))
    }
}
