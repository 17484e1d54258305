//! The interface between step generation and hardware.

use crate::{MotorMask, OutputChange, Power, Ticks};

/// Pins and timer of the step interrupt. Implemented by the board and by the simulator.
///
/// All methods are called from the step interrupt, in the order in which they stand here;
/// [`set_power`](StepPort::set_power) alone is also called by [`start`](crate::start), and after
/// [`arm`](StepPort::arm) if a segment came late. Each interrupt calls the methods that have
/// something to change, and ends with [`StepPort::make_up`] or [`StepPort::rest`]. No method may
/// wait or fail.
pub trait StepPort {
    /// Raises the step pins of `motors` at once; `motors` is never empty and names only motors of
    /// the machine. Makes sure that the pins fall again after the pulse width that is set, or
    /// later: a pulse that is still high is made longer, not shorter.
    fn step(&mut self, motors: MotorMask);

    /// Sets laser or spindle power until further notice. Called right after the steps with which
    /// the power changes, at a start, at rest, and at every tick while a motor is locked or the
    /// laser is held off.
    fn set_power(&mut self, power: Power);

    /// Sets the direction pins for the steps to come: the motors in `negative` turn in the negative
    /// direction, all others in the positive one. Called when a motor reverses, and when motion
    /// starts.
    ///
    /// Takes effect when the present pulse has ended, or at once if there is none, so that a driver
    /// sees the old direction for the whole of the last pulse.
    fn set_direction(&mut self, negative: MotorMask);

    /// Asks for the next interrupt `wait` after the instant at which this one was *due*, so that
    /// latency does not add up.
    fn arm(&mut self, wait: Ticks);

    /// Changes the synchronised outputs. Outputs that `change` does not name stay as they are.
    /// Called when a segment begins, mostly with nothing to change.
    fn change_outputs(&mut self, change: OutputChange);

    /// Makes the next interrupt come at once if the instant that [`StepPort::arm`] asked for has
    /// passed without an interrupt. (A timer that compares for equality misses such an instant.)
    /// Returns whether the instant has passed. Called in each interrupt that has armed the next
    /// one.
    fn make_up(&mut self) -> bool;

    /// Stops the timer: no interrupt comes until the main loop starts it again.
    fn rest(&mut self);
}
