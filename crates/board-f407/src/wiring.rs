//! Which pin does what: the one file to edit for another board.
//!
//! | pin | signal |
//! |---|---|
//! | PE7, PE8, PE9 | step X, Y, Z |
//! | PE10, PE11, PE12 | direction X, Y, Z, high is negative |
//! | PD12 | power (PWM), the green LED of the STM32F4-Discovery |
//! | PA0 | start of the demonstration, its blue button |
use leadscrew_stepper::MotorMask;

/// Motors that the board drives.
pub(crate) const MOTORS: usize = 3;
/// Frequency of the power's PWM in Hz: 8400 levels.
pub(crate) const POWER_HZ: u32 = 10_000;

/// Number of the pin that steps the first motor; those of the others follow.
const FIRST_STEP_PIN: u32 = 7;
/// Number of the direction pin of the first motor; those of the others follow.
const FIRST_DIRECTION_PIN: u32 = 10;
/// A bit for each motor.
const ALL: u32 = (1 << MOTORS) - 1;

// Words for the port's set/reset register: bit *n* raises pin *n*, bit *n* + 16 lowers it.

/// Lowers all step pins.
pub(crate) const STEP_END: u32 = STEP_PINS << 16;
/// The step pins, a bit each, as the port's output register has them.
pub(crate) const STEP_PINS: u32 = ALL << FIRST_STEP_PIN;

/// Raises the step pins of `motors`, all of which are below [`MOTORS`]: one shift, since the pins are neighbours.
#[inline]
pub(crate) const fn step_word(motors: MotorMask) -> u32 {
    (motors.bits() as u32) << FIRST_STEP_PIN
}

/// The word for all direction pins: high for the motors of `negative`, low for the others.
pub(crate) fn direction_word(negative: MotorMask) -> u32 {
    let high = u32::from(negative.bits()) & ALL;
    let low = !high & ALL;
    (high | low << 16) << FIRST_DIRECTION_PIN
}
