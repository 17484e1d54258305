//! The functions that the step interrupt needs of a board, beyond pins.

use crate::words::Pulse;
use leadscrew_stepper::StepPort;

/// Pins and timer of the step interrupt, for [`crate::Steps::on_port`]: a [`StepPort`] that also knows
/// when it was due. All methods are called from the step interrupt.
pub trait Port: StepPort {
    /// Puts polarity and pulse width into effect, as soon as the present pulse ends. Called at rest.
    fn configure(&mut self, pulse: &Pulse);

    /// Begins motion: the present count is the instant of the first tick.
    fn begin(&mut self);

    /// Ends the pulse if its end is due. Returns whether the tick is due. A port whose interrupt
    /// comes for ticks only returns `true`.
    fn is_due(&mut self) -> bool {
        true
    }

    /// Asks for the interrupt that comes next, if [`Port::is_due`] has returned `false`, and at
    /// rest.
    fn wait(&mut self) {}

    /// Ends the present pulse: called by [`crate::Stepping::pulse_end`], for a port with a timer for it.
    fn end_pulse(&mut self) {}
}
