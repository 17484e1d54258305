//! The build of a motion without G-code, checked before anything moves.

use crate::config::{RATES, SLOWEST_TIMER_HZ};
use core::fmt;
use leadscrew_machine::board::PortConfig;
use leadscrew_machine::config::Squaring;
use leadscrew_machine::inputs::InputConfig;
use leadscrew_planner::{Config, ConfigError, Coordinate, StepsPerMm};
use leadscrew_stepper::{MotorMask, Ticks};

/// The facts that a [`crate::Motion`] has to know of its machine.
///
/// ```
/// use leadscrew::MotionConfig;
///
/// let config = MotionConfig::new()
///     .timer_hz(1_000_000)
///     .with_steps_per_mm([80.0, 80.0])
///     .with_max_speed_mm_s([200.0, 200.0])
///     .with_acceleration_mm_s2([2000.0, 2000.0])
///     .with_travel_mm([[0.0, 300.0], [0.0, 200.0]]);
/// assert!(config.validate().is_ok());
/// ```
#[derive(Clone, Copy, PartialEq, Debug)]
#[must_use]
pub struct MotionConfig<const AXES: usize> {
    planned: Config<AXES>,
    steps_per_mm: [f32; AXES],
    steps_per_second: u32,
    travel: Option<[[f32; 2]; AXES]>,
    pub(crate) wiring: PortConfig,
    pub(crate) inputs: InputConfig,
    pub(crate) homing: HomingConfig,
}

/// How axes find their switches.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct HomingConfig {
    /// Towards a switch, and back off it, mm/s.
    pub(crate) fast: f32,
    /// Towards a switch the second time, mm/s.
    pub(crate) slow: f32,
    /// How far an axis goes back off its switch, mm.
    pub(crate) pull_off: f32,
    /// How far apart the switches of an axis with two motors may be.
    pub(crate) squaring: Squaring,
}

impl<const AXES: usize> MotionConfig<AXES> {
    /// Begins with Grbl's defaults: 250 steps/mm, 500 mm/min, 10 mm/s², pulses of 10 µs, 20 000
    /// steps a second at most; homing at 500 and 25 mm/min, 1 mm back off the switch, and closed
    /// switches are low; no travel, and no frequency yet.
    pub fn new() -> Self {
        Self {
            planned: Config {
                timer_hz: 0,
                ..Config::default()
            },
            steps_per_mm: [250.0; AXES],
            steps_per_second: 20_000,
            travel: None,
            wiring: PortConfig {
                pulse_us: 10,
                ..PortConfig::default()
            },
            inputs: InputConfig::default(),
            homing: HomingConfig {
                fast: 500.0 / 60.0,
                slow: 25.0 / 60.0,
                pull_off: 1.0,
                squaring: Squaring::GRBL,
            },
        }
    }

    /// Sets the counts of the step timer in a second, at least 100 000.
    pub fn timer_hz(mut self, hz: u32) -> Self {
        self.planned.timer_hz = hz;
        self
    }

    /// Sets the steps of each axis's motor to a millimetre, above 0.
    pub fn with_steps_per_mm(mut self, steps: [f32; AXES]) -> Self {
        self.steps_per_mm = steps;
        self
    }

    /// Sets the highest speed of each axis, mm/s, above 0.
    pub fn with_max_speed_mm_s(mut self, speed: [f32; AXES]) -> Self {
        self.planned.max_rate = speed;
        self
    }

    /// Sets the highest acceleration of each axis, mm/s², above 0.
    pub fn with_acceleration_mm_s2(mut self, acceleration: [f32; AXES]) -> Self {
        self.planned.acceleration = acceleration;
        self
    }

    /// Sets the highest jerk along the path, mm/s³; 0 for no limit.
    pub fn with_jerk_mm_s3(mut self, jerk: f32) -> Self {
        self.planned.jerk = jerk;
        self
    }

    /// Sets the frequency of a vibration that motion along the path does not set off, Hz; 0 for
    /// none. Below 10 Hz it is only weakened.
    pub fn with_resonance_hz(mut self, frequency: f32) -> Self {
        self.planned.resonance = frequency;
        self
    }

    /// Sets how fast corners are passed: how far the circle that sets a corner's speed stays away
    /// from it, mm.
    pub fn with_junction_deviation_mm(mut self, deviation: f32) -> Self {
        self.planned.junction_deviation = deviation;
        self
    }

    /// Sets how far a chord may stay away from its arc, mm, above 0.
    pub fn with_arc_tolerance_mm(mut self, tolerance: f32) -> Self {
        self.planned.arc_tolerance = tolerance;
        self
    }

    /// Sets the lowest and the highest place of each axis, mm: no move leads beyond them.
    pub fn with_travel_mm(mut self, travel: [[f32; 2]; AXES]) -> Self {
        self.travel = Some(travel);
        self
    }

    /// Sets how fast the board can step, 3 000 to 500 000 steps a second: faster motion is capped.
    pub fn with_steps_per_second(mut self, rate: u32) -> Self {
        self.steps_per_second = rate;
        self
    }

    /// Sets the least width of a step pulse, µs.
    pub fn with_pulse_us(mut self, width: u8) -> Self {
        self.wiring.pulse_us = width;
        self
    }

    /// Sets the motors whose step pin is low in a pulse, and those whose direction pin is low in
    /// the negative direction.
    pub fn with_inverted(mut self, steps: MotorMask, directions: MotorMask) -> Self {
        self.wiring.step_invert = steps;
        self.wiring.direction_invert = directions;
        self
    }

    /// Sets the speeds at which an axis goes towards its switch: the first time, which is also how
    /// fast it comes back off, and the second time, mm/s, above 0.
    pub fn with_homing_mm_s(mut self, first: f32, second: f32) -> Self {
        (self.homing.fast, self.homing.slow) = (first, second);
        self
    }

    /// Sets how far an axis comes back off its switch, mm, above 0.
    pub fn with_pull_off_mm(mut self, way: f32) -> Self {
        self.homing.pull_off = way;
        self
    }

    /// Sets how far apart the switches of an axis with two motors may be.
    pub fn with_squaring(mut self, squaring: Squaring) -> Self {
        self.homing.squaring = squaring;
        self
    }

    /// Makes a limit switch that closes stop motion before the next step, which is a fault. Without
    /// this, limit switches are for homing only.
    pub fn with_hard_limits(mut self) -> Self {
        self.inputs.hard_limits = true;
        self
    }

    /// Sets whether closed limit switches are high, and whether a probe that touches is.
    pub fn with_closed_high(mut self, limits: bool, probe: bool) -> Self {
        (self.inputs.limits_invert, self.inputs.probe_invert) = (limits, probe);
        self
    }

    /// Sets how long a switch has to keep a new level before it is believed, µs.
    pub fn with_switch_filter_us(mut self, time: u32) -> Self {
        self.wiring.filter_us = time;
        self
    }

    /// Makes a high level enable the drivers, in place of a low one.
    pub fn with_drivers_enabled_high(mut self) -> Self {
        self.wiring.enable_invert = true;
        self
    }

    /// Checks the build. [`crate::motion()`] does so.
    ///
    /// # Errors
    /// The first value with which nothing can be planned.
    pub fn validate(&self) -> Result<(), MotionConfigError> {
        self.travel()?;
        let HomingConfig {
            fast,
            slow,
            pull_off,
            ..
        } = self.homing;
        let is_length = |value: f32| value > 0.0 && value.is_finite();
        if !is_length(fast) || !is_length(slow) {
            return Err(MotionConfigError::HomingSpeed);
        }
        if !is_length(pull_off) {
            return Err(MotionConfigError::PullOff);
        }
        Ok(self.planner(usize::MAX)?.validate()?)
    }

    /// The travel in exact numbers.
    pub(crate) fn travel(&self) -> Result<Option<[[Coordinate; 2]; AXES]>, MotionConfigError> {
        let Some(travel) = self.travel else {
            return Ok(None);
        };
        let mut exact = [[Coordinate::ZERO; 2]; AXES];
        for (axis, (exact, ends)) in exact.iter_mut().zip(travel).enumerate() {
            match ends.map(Coordinate::from_mm) {
                [Some(low), Some(high)] if low <= high => *exact = [low, high],
                _ => return Err(MotionConfigError::Travel(axis)),
            }
        }
        Ok(Some(exact))
    }

    /// The planner's build, for a queue of `moves`.
    pub(crate) fn planner(&self, moves: usize) -> Result<Config<AXES>, MotionConfigError> {
        let mut planned = self.planned;
        let (hz, rate) = (planned.timer_hz, self.steps_per_second);
        if hz < SLOWEST_TIMER_HZ {
            return Err(MotionConfigError::TimerHz(hz));
        }
        // A pulse, and as long a time before the next one.
        let most = (500_000 / u32::from(self.wiring.pulse_us.max(1))).min(*RATES.end());
        if !(*RATES.start()..=most).contains(&rate) {
            return Err(MotionConfigError::StepsPerSecond { rate, most });
        }
        planned.shortest_tick = Ticks(hz.div_ceil(rate));
        planned.moves = moves;
        for (axis, (exact, steps)) in planned
            .steps_per_mm
            .iter_mut()
            .zip(self.steps_per_mm)
            .enumerate()
        {
            // The same exact number of 10⁻⁹ as a place in mm has.
            let nanos = Coordinate::from_mm(steps).map(Coordinate::nanos);
            match nanos.filter(|nanos| *nanos > 0) {
                Some(nanos) => *exact = StepsPerMm::from_nanos(nanos),
                None => return Err(MotionConfigError::StepsPerMm(axis)),
            }
        }
        Ok(planned)
    }
}

impl<const AXES: usize> Default for MotionConfig<AXES> {
    fn default() -> Self {
        Self::new()
    }
}

/// The reason why there is no motion: what is wrong, where, and how to mend it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum MotionConfigError {
    /// The step timer has this frequency, Hz: none was given, or it is too slow.
    TimerHz(u32),
    /// A rate that the board or its pulses do not allow.
    StepsPerSecond {
        /// The rate that was asked for.
        rate: u32,
        /// The highest one with this width of pulses.
        most: u32,
    },
    /// The steps per mm of this axis are no number above 0.
    StepsPerMm(usize),
    /// The travel of this axis has no two places in order.
    Travel(usize),
    /// A speed of homing is no number above 0.
    HomingSpeed,
    /// The way back off a switch is no number above 0.
    PullOff,
    /// Another value.
    Planner(ConfigError),
}

impl fmt::Display for MotionConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("MotionConfig::")?;
        match self {
            Self::TimerHz(hz) => {
                write!(
                    f,
                    "timer_hz: {hz}; give the step timer's counts in a second, {SLOWEST_TIMER_HZ} or \
                     more"
                )
            }
            Self::StepsPerSecond { rate, most } => write!(
                f,
                "with_steps_per_second: {rate}; give {} to {most}, or shorter pulses",
                RATES.start()
            ),
            Self::StepsPerMm(axis) => {
                write!(f, "with_steps_per_mm: axis {axis}; give a number above 0")
            }
            Self::Travel(axis) => {
                write!(
                    f,
                    "with_travel_mm: axis {axis}; give the lowest place, then the highest"
                )
            }
            Self::HomingSpeed => f.write_str("with_homing_mm_s: give two numbers above 0"),
            Self::PullOff => f.write_str("with_pull_off_mm: give a number above 0"),
            Self::Planner(error) => write!(f, "validate: {error}"),
        }
    }
}

impl core::error::Error for MotionConfigError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Planner(error) => Some(error),
            Self::TimerHz(_)
            | Self::StepsPerSecond { .. }
            | Self::StepsPerMm(_)
            | Self::Travel(_)
            | Self::HomingSpeed
            | Self::PullOff => None,
        }
    }
}

impl From<ConfigError> for MotionConfigError {
    fn from(error: ConfigError) -> Self {
        Self::Planner(error)
    }
}
