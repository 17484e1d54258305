//! Slow pins by `embedded-hal`: drivers, spindle, coolant.

use crate::timed::Pwm;
use core::fmt;
use embedded_hal::digital::{ErrorType, OutputPin, PinState};
use embedded_hal::pwm::{self, SetDutyCycle};
use leadscrew_machine::board::{CoolantOutput, SpindleOutput};
use leadscrew_stepper::Power;

/// The slow outputs under a machine. Called by the main loop, never waiting. [`Outputs`] implements
/// it for pins; implement it yourself for a spindle on a bus, or for drivers with registers.
pub trait Actuators {
    /// The reason why an output cannot be set: the machine then stops and is locked.
    type Error: core::fmt::Debug;

    /// Makes the step interrupt come at once, by `NVIC::pend` or the like.
    fn pend_step_interrupt(&mut self);

    /// Enables or disables all motor drivers. `high` is the level of the pin: `on`, seen through
    /// `$4`.
    ///
    /// # Errors
    /// The pin cannot be set.
    fn enable_motors(&mut self, on: bool, high: bool) -> Result<(), Self::Error>;

    /// Sets direction and enable of the spindle.
    ///
    /// # Errors
    /// A pin cannot be set.
    fn set_spindle(&mut self, output: SpindleOutput) -> Result<(), Self::Error>;

    /// Sets the spindle's power: called if it has changed, in motion too.
    ///
    /// # Errors
    /// The PWM cannot be set.
    fn set_power(&mut self, power: Power) -> Result<(), Self::Error>;

    /// Sets the coolant valves.
    ///
    /// # Errors
    /// A pin cannot be set.
    fn set_coolant(&mut self, output: CoolantOutput) -> Result<(), Self::Error>;
}

/// The pins of drivers, spindle and coolant, each of which may be missing.
///
/// All pins have one type: a HAL's pins are made alike by its `erase`, `into_dyn_pin` or `degrade`.
pub struct Outputs<F, P, W = NoPwm> {
    start: F,
    enable: Option<P>,
    spindle: Option<P>,
    counter_clockwise: Option<P>,
    flood: Option<P>,
    mist: Option<P>,
    pwm: Pwm<W>,
}

impl<F: FnMut(), P: OutputPin> Outputs<F, P> {
    /// Takes the function that makes the step interrupt come at once (`NVIC::pend`), and the pin
    /// that enables the drivers by a low level, or by a high one with `$4=1`.
    pub fn new(start: F, enable: P) -> Self {
        Self {
            enable: Some(enable),
            ..Self::without_enable(start)
        }
    }

    /// As [`Outputs::new`], for drivers that are always on. Without any pin it is
    /// `Outputs::<_, NoPin>::without_enable(start)`.
    pub fn without_enable(start: F) -> Self {
        Self {
            start,
            enable: None,
            spindle: None,
            counter_clockwise: None,
            flood: None,
            mist: None,
            pwm: Pwm::new(NoPwm),
        }
    }

    /// Adds the spindle's PWM, which the main loop sets. A laser's PWM belongs to the step
    /// interrupt: [`crate::Steps::on_laser`].
    pub fn with_spindle<W: SetDutyCycle>(self, pwm: W) -> Outputs<F, P, W> {
        Outputs {
            pwm: Pwm::new(pwm),
            start: self.start,
            enable: self.enable,
            spindle: self.spindle,
            counter_clockwise: self.counter_clockwise,
            flood: self.flood,
            mist: self.mist,
        }
    }
}

impl<F, P, W> Outputs<F, P, W> {
    /// Adds the pin that is high while the spindle turns.
    #[must_use]
    pub fn with_spindle_enable(mut self, pin: P) -> Self {
        self.spindle = Some(pin);
        self
    }

    /// Adds the pin that is high while the spindle turns counter-clockwise (M4).
    #[must_use]
    pub fn with_spindle_direction(mut self, pin: P) -> Self {
        self.counter_clockwise = Some(pin);
        self
    }

    /// Adds the pin that is high while flood coolant flows (M8).
    #[must_use]
    pub fn with_flood(mut self, pin: P) -> Self {
        self.flood = Some(pin);
        self
    }

    /// Adds the pin that is high while mist coolant flows (M7); see `Dialect::mist`.
    #[must_use]
    pub fn with_mist(mut self, pin: P) -> Self {
        self.mist = Some(pin);
        self
    }
}

/// The reason why an output of [`Outputs`] cannot be set.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum OutputError<P, W> {
    /// A pin.
    Pin(P),
    /// The spindle's PWM.
    Pwm(W),
}

impl<P: fmt::Debug, W: fmt::Debug> fmt::Display for OutputError<P, W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pin(error) => write!(f, "an output pin cannot be set: {error:?}"),
            Self::Pwm(error) => write!(f, "the spindle's PWM cannot be set: {error:?}"),
        }
    }
}

impl<P: fmt::Debug, W: fmt::Debug> core::error::Error for OutputError<P, W> {}

impl<F, P, W> Actuators for Outputs<F, P, W>
where
    F: FnMut(),
    P: OutputPin,
    W: SetDutyCycle,
{
    type Error = OutputError<P::Error, W::Error>;

    fn pend_step_interrupt(&mut self) {
        (self.start)();
    }

    fn enable_motors(&mut self, _: bool, high: bool) -> Result<(), Self::Error> {
        put(&mut self.enable, high)
    }

    fn set_spindle(&mut self, output: SpindleOutput) -> Result<(), Self::Error> {
        // The direction first: a spindle must not start the wrong way.
        let back = output == SpindleOutput::CounterClockwise;
        put(&mut self.counter_clockwise, back)?;
        put(&mut self.spindle, output != SpindleOutput::Off)
    }

    fn set_power(&mut self, power: Power) -> Result<(), Self::Error> {
        self.pwm.set(power).map_err(OutputError::Pwm)
    }

    fn set_coolant(&mut self, output: CoolantOutput) -> Result<(), Self::Error> {
        put(&mut self.flood, output.flood)?;
        put(&mut self.mist, output.mist)
    }
}

fn put<P: OutputPin, W>(pin: &mut Option<P>, high: bool) -> Result<(), OutputError<P::Error, W>> {
    match pin {
        Some(pin) => pin
            .set_state(PinState::from(high))
            .map_err(OutputError::Pin),
        None => Ok(()),
    }
}

/// The type of a pin that is not there.
#[derive(Clone, Copy, Debug)]
pub enum NoPin {}

impl ErrorType for NoPin {
    type Error = core::convert::Infallible;
}

impl OutputPin for NoPin {
    fn set_low(&mut self) -> Result<(), Self::Error> {
        match *self {}
    }
    fn set_high(&mut self) -> Result<(), Self::Error> {
        match *self {}
    }
}

/// No spindle.
#[derive(Clone, Copy, Debug)]
pub struct NoPwm;

impl pwm::ErrorType for NoPwm {
    type Error = core::convert::Infallible;
}

impl SetDutyCycle for NoPwm {
    fn max_duty_cycle(&self) -> u16 {
        u16::MAX
    }
    fn set_duty_cycle(&mut self, _: u16) -> Result<(), Self::Error> {
        Ok(())
    }
}
