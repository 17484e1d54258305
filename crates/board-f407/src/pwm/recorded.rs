//! The channel of a board whose pins are in its record. Its registers are looked up when a
//! [`Channel`] is made; code that often sets power keeps one ready.
use super::{cycles, period, Mode};
use crate::{
    chip::Timer,
    gpio::Output,
    profile,
    registers::{PowerRegisters, Word},
};
use leadscrew_stepper::PowerScale;
use stm32f4::stm32f407::tim1;

/// The channel of the power.
pub(crate) struct Channel {
    registers: PowerRegisters,
    /// The first bit of its mode in the register.
    shift: u8,
    scale: PowerScale,
}

impl Channel {
    pub(crate) fn new() -> Self {
        let (timer, number) = Self::place();
        Self {
            registers: PowerRegisters::new(timer, number),
            shift: 8 * (number % 2) + 4,
            scale: PowerScale::new(period(Self::cycles())),
        }
    }

    /// Its timer, and its number there, 0 to 3.
    pub(super) fn place() -> (Timer, u8) {
        profile::power_channel()
    }

    /// Its pin, and the pin's function; none if there is no record.
    pub(super) fn output() -> Option<(Output, u8)> {
        profile::power_output()
    }

    /// Counts in a period before the timer's clock is divided.
    pub(super) fn cycles() -> u32 {
        let (timer, _) = Self::place();
        cycles(timer, profile::power_hz())
    }

    pub(super) fn compare(&self) -> &'static tim1::CCR {
        self.registers.compare
    }

    pub(super) fn scale(&self) -> PowerScale {
        self.scale
    }

    /// Puts a mode into effect.
    pub(super) fn begin(&self, mode: Mode) {
        self.registers.modes.put((mode as u32) << self.shift);
    }
}
