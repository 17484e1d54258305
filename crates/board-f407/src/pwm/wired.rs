//! The channel of a board whose pins are compiled in: the compiler knows its registers and its
//! scale.
use super::{cycles, period, Mode};
use crate::{
    chip::Timer,
    gpio::Output,
    profile::{PowerPin, POWER_HZ, PROFILE},
    registers::{power_timer, Word},
};
use leadscrew_stepper::PowerScale;
use stm32f4::stm32f407::tim1;

const OUTPUT: &PowerPin = &PROFILE.power;
/// Counts in a period before the timer's clock is divided.
const CYCLES: u32 = {
    assert!(50 <= POWER_HZ && POWER_HZ <= 100_000);
    cycles(OUTPUT.timer, POWER_HZ)
};
/// The channel, from 0.
const CHANNEL: usize = {
    assert!(1 <= OUTPUT.channel && OUTPUT.channel <= 4);
    OUTPUT.channel as usize - 1
};

/// The channel of the power.
pub(crate) struct Channel;

impl Channel {
    pub(crate) const fn new() -> Self {
        Self
    }

    /// Its timer, and its number there, 0 to 3.
    pub(super) const fn place() -> (Timer, u8) {
        (OUTPUT.timer, CHANNEL as u8)
    }

    /// Its pin, and the pin's function.
    pub(super) const fn output() -> Option<(Output, u8)> {
        Some((OUTPUT.output, OUTPUT.function))
    }

    /// Counts in a period before the timer's clock is divided.
    pub(super) const fn cycles() -> u32 {
        CYCLES
    }

    pub(super) fn compare(&self) -> &'static tim1::CCR {
        power_timer(OUTPUT.timer).ccr(CHANNEL)
    }

    pub(super) const fn scale(&self) -> PowerScale {
        const SCALE: PowerScale = PowerScale::new(period(CYCLES));
        SCALE
    }

    /// Puts a mode into effect: two channels a register, of which the other is not in use.
    pub(super) fn begin(&self, mode: Mode) {
        let bits = (mode as u32) << (8 * (CHANNEL % 2) + 4);
        let timer = power_timer(OUTPUT.timer);
        if CHANNEL < 2 {
            timer.ccmr1_output().put(bits);
        } else {
            timer.ccmr2_output().put(bits);
        }
    }
}
