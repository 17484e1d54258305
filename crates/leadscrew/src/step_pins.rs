//! Step and direction pins by `embedded-hal`.

use embedded_hal::digital::{OutputPin, PinState};
use leadscrew_stepper::MotorMask;

/// The step and the direction pins of all motors. Called from the step interrupt.
///
/// [`StepDir`] sets pin after pin: with a usual HAL, the last of three rises some 100 ns after the
/// first. Implement this trait with one store to a port's register if pins must rise together.
pub trait StepPins {
    /// The reason why a pin cannot be set.
    type Error: core::fmt::Debug;

    /// Sets the step pins of the motors in `of` to their `levels`: a motor in `levels` is high. The
    /// other pins stay as they are.
    ///
    /// # Errors
    /// A pin cannot be set: the machine stops and is locked.
    fn set_steps(&mut self, of: MotorMask, levels: MotorMask) -> Result<(), Self::Error>;

    /// Sets all direction pins: a motor in `levels` is high.
    ///
    /// # Errors
    /// As [`StepPins::set_steps`].
    fn set_directions(&mut self, levels: MotorMask) -> Result<(), Self::Error>;
}

/// A step and a direction pin for each motor, in the order of the motors. A HAL's pins that have
/// types of their own are made alike by its `erase`, `into_dyn_pin` or `degrade`.
pub struct StepDir<S, D, const MOTORS: usize> {
    pins: [(S, D); MOTORS],
}

impl<S: OutputPin, D: OutputPin<Error = S::Error>, const MOTORS: usize> StepDir<S, D, MOTORS> {
    /// Takes the pins, which are outputs: `(step, direction)` of each motor.
    pub const fn new(pins: [(S, D); MOTORS]) -> Self {
        Self { pins }
    }
}

impl<S: OutputPin, D: OutputPin<Error = S::Error>, const MOTORS: usize> StepPins
    for StepDir<S, D, MOTORS>
{
    type Error = S::Error;

    fn set_steps(&mut self, of: MotorMask, levels: MotorMask) -> Result<(), S::Error> {
        for (motor, (step, _)) in self.pins.iter_mut().enumerate() {
            if of.contains(motor) {
                step.set_state(PinState::from(levels.contains(motor)))?;
            }
        }
        Ok(())
    }

    fn set_directions(&mut self, levels: MotorMask) -> Result<(), S::Error> {
        for (motor, (_, direction)) in self.pins.iter_mut().enumerate() {
            direction.set_state(PinState::from(levels.contains(motor)))?;
        }
        Ok(())
    }
}
