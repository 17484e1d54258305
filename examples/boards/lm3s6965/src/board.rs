//! The board that the machine runs on: three motors and a serial line; no spindle, no coolant, no
//! switches.

use crate::{handlers, step_port, uart};
use leadscrew_machine::board::{
    Board, ChannelId, CoolantOutput, Instant, PortConfig, SpindleOutput, Switches,
};
use leadscrew_stepper::Power;

/// The board as the main loop uses it.
pub(crate) struct Lm3s(());

impl Lm3s {
    pub(crate) const fn new() -> Self {
        Self(())
    }
}

impl Board for Lm3s {
    fn start_stepping(&mut self, now: Instant) -> Instant {
        handlers::pend_step();
        now
    }
    fn write(&mut self, _: ChannelId, bytes: &[u8]) -> usize {
        uart::write(bytes)
    }
    fn switches(&self) -> Switches {
        Switches::OPEN
    }
    fn enable_motors(&mut self, on: bool) {
        step_port::enable_motors(on);
    }
    fn set_spindle(&mut self, _: SpindleOutput) {}
    fn set_power(&mut self, _: Power) {}
    fn set_coolant(&mut self, _: CoolantOutput) {}
    fn configure(&mut self, port: &PortConfig) {
        step_port::configure(port);
    }
}
