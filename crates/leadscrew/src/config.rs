//! A machine's build, checked before anything moves.

use core::fmt;
use leadscrew_machine::board::Duration;
use leadscrew_machine::config::{
    AxisKind, AxisMask, Dialect, MachineConfig, Options, Squaring, SwitchRules,
};
use leadscrew_machine::settings::values::Entry;
use leadscrew_machine::step_timing::StepTiming;
use leadscrew_machine::valid::ConfigError;

/// The build of a machine: what no setting changes. Give at least [`Config::timer_hz`].
///
/// ```
/// use leadscrew::Config;
///
/// let config = Config::<3>::new().timer_hz(1_000_000).with_steps_per_second(20_000);
/// assert!(config.validate().is_ok());
///
/// let error = Config::<3>::new().validate().unwrap_err();
/// assert!(error.to_string().contains("Config::timer_hz"));
/// ```
#[derive(Clone, Copy, PartialEq, Debug)]
#[must_use]
pub struct Config<const AXES: usize> {
    pub(crate) machine: MachineConfig<AXES>,
    steps_per_second: u32,
}

/// The slowest step timer, Hz: a pulse's width is counted in it.
pub(crate) const SLOWEST_TIMER_HZ: u32 = 100_000;

/// The rates that a board may have, steps a second.
pub(crate) const RATES: core::ops::RangeInclusive<u32> = 3_000..=500_000;

impl<const AXES: usize> Config<AXES> {
    /// Begins with linear axes, Grbl's settings, 20 000 steps a second at most, and no frequency
    /// yet.
    pub const fn new() -> Self {
        let mut machine = MachineConfig::new();
        machine.timer_hz = 0;
        Self {
            machine,
            steps_per_second: 20_000,
        }
        .with_steps_per_second(20_000)
    }

    /// Sets the counts of the step timer in a second, at least 100 000.
    pub const fn timer_hz(mut self, hz: u32) -> Self {
        self.machine.timer_hz = hz;
        self
    }

    /// Sets how fast the board can step, 3 000 to 500 000 steps a second: faster motion is capped.
    /// Begin low; the machine says when ticks come late. [`Config::with_step_timing`] has more to
    /// set.
    pub const fn with_steps_per_second(mut self, rate: u32) -> Self {
        self.steps_per_second = rate;
        let ns = 1_000_000_000 / if rate == 0 { 1 } else { rate };
        self.machine.step_timing = StepTiming {
            tick_ns: ns,
            motor_ns: 0,
            line_ns: ns,
            pulse_end_ns: if ns / 4 < 3_000 { ns / 4 } else { 3_000 },
            setup_ns: 1_000,
            shortest_pulse_us: 1,
        };
        self
    }

    /// Sets the times of making steps, in place of [`Config::with_steps_per_second`].
    pub const fn with_step_timing(mut self, timing: StepTiming) -> Self {
        self.steps_per_second = *RATES.start();
        self.machine.step_timing = timing;
        self
    }

    /// Sets the kind of each axis: linear, rotary, an extruder, or absent.
    pub const fn with_axes(mut self, axes: [AxisKind; AXES]) -> Self {
        self.machine.axes = axes;
        self
    }

    /// Sets the settings of a new machine that differ from Grbl's defaults.
    pub const fn with_defaults(mut self, defaults: &'static [Entry]) -> Self {
        self.machine.defaults = defaults;
        self
    }

    /// Sets the axes that home together, in the order in which they home; 0 for the rest.
    pub const fn with_homing(mut self, cycles: [AxisMask; 4]) -> Self {
        self.machine.homing_cycles = cycles;
        self
    }

    /// Sets the options that Grbl fixes when it is compiled: door, parking, single-axis homing.
    pub const fn with_options(mut self, options: Options) -> Self {
        self.machine.options = options;
        self
    }

    /// Sets the words of programs that not every machine knows. A mist valve is one of them.
    pub const fn with_dialect(mut self, dialect: Dialect) -> Self {
        self.machine.dialect = dialect;
        self
    }

    /// Sets the rules of limit switches.
    pub const fn with_rules(mut self, rules: SwitchRules) -> Self {
        self.machine.rules = rules;
        self
    }

    /// Sets how an axis with two motors is squared.
    pub const fn with_squaring(mut self, squaring: Squaring) -> Self {
        self.machine.squaring = squaring;
        self
    }

    /// Sets the delays of spindle and coolant after the safety door was closed, an hour at most.
    pub const fn with_delays(mut self, spindle: Duration, coolant: Duration) -> Self {
        self.machine.spindle_delay = spindle;
        self.machine.coolant_delay = coolant;
        self
    }

    /// Takes over a build whole, with its timer and timing.
    pub const fn of(machine: MachineConfig<AXES>) -> Self {
        Self {
            machine,
            steps_per_second: *RATES.start(),
        }
    }

    /// Checks the build. [`crate::new`] does so.
    ///
    /// # Errors
    /// The first value with which no machine can be built.
    pub fn validate(&self) -> Result<(), Error> {
        if self.machine.timer_hz < SLOWEST_TIMER_HZ {
            return Err(Error::TimerHz(self.machine.timer_hz));
        }
        if !RATES.contains(&self.steps_per_second) {
            return Err(Error::StepsPerSecond(self.steps_per_second));
        }
        Ok(self.machine.validate()?)
    }
}

impl<const AXES: usize> Default for Config<AXES> {
    fn default() -> Self {
        Self::new()
    }
}

/// The reason why there is no machine: what is wrong, where, and how to mend it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Error {
    /// The step timer has this frequency, Hz: none was given, or it is too slow.
    TimerHz(u32),
    /// A board cannot make this number of steps a second.
    StepsPerSecond(u32),
    /// Another value of the build.
    Build(ConfigError),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TimerHz(0) => f.write_str(
                "Config::timer_hz: it is not set; give the counts of the step timer in a second",
            ),
            Self::TimerHz(hz) => write!(
                f,
                "Config::timer_hz: {hz} Hz cannot time a pulse; let the step timer count \
                 {SLOWEST_TIMER_HZ} Hz or more"
            ),
            Self::StepsPerSecond(rate) => write!(
                f,
                "Config::with_steps_per_second: {rate}; give {} to {}",
                RATES.start(),
                RATES.end()
            ),
            Self::Build(error) => write!(f, "Config: {error}"),
        }
    }
}

impl core::error::Error for Error {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Build(error) => Some(error),
            Self::TimerHz(_) | Self::StepsPerSecond(_) => None,
        }
    }
}

impl From<ConfigError> for Error {
    fn from(error: ConfigError) -> Self {
        Self::Build(error)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use core::error::Error as _;
    use std::string::ToString;

    #[test]
    fn each_fault_of_a_build_names_its_call_and_a_value_that_works() {
        let good = Config::<3>::new().timer_hz(1_000_000);
        assert_eq!(good.validate(), Ok(()));
        let table = [
            (Config::new(), "timer_hz: it is not set"),
            (good.timer_hz(50_000), "100000 Hz or more"),
            (good.with_steps_per_second(0), "0; give 3000 to 500000"),
            (good.with_steps_per_second(1_000_000), "give 3000 to 500000"),
            (
                good.with_axes([AxisKind::Absent; 3]),
                "Config: axes: X, Y and Z have to be there",
            ),
        ];
        for (config, words) in table {
            let error = config.validate().unwrap_err();
            assert!(error.to_string().contains(words), "{error}");
        }
        assert!(Error::Build(ConfigError::Axes).source().is_some());
    }

    #[test]
    fn a_rate_within_the_range_is_one_that_the_machine_takes() {
        for rate in [3_000, 20_000, 100_000, 500_000] {
            let config = Config::<3>::new().timer_hz(72_000_000);
            assert_eq!(config.with_steps_per_second(rate).validate(), Ok(()));
        }
    }
}
