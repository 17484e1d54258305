//! The pins of heaters, of their sensors, of their supply, of faults that other devices report, and
//! of a fan.
//!
//! ADC1 converts the sensors one after the other, as its injected group: up to four, each with a
//! result register of its own (RM0090 section 13.3.3). A conversion takes 492 clocks of 21 MHz,
//! 23 µs. A reading comes from the conversion of the period before, so it is 100 ms old.
use crate::{
    clock,
    profile::{HEATER_FAULT, PROFILE, SENSORS},
    registers::{converter, converters, Word},
};
use leadscrew_heat::HeatPort;
use leadscrew_machine::board::Instant;

/// The channels of the sensors, and how many they are, as JSQR takes them: the last channel stands
/// in the fourth place (section 13.13.12).
const SEQUENCE: u32 = {
    let (mut word, mut place) = ((SENSORS.len() as u32 - 1) << 20, 0);
    while place < SENSORS.len() {
        let (_, channel) = SENSORS[place];
        word |= (channel as u32) << (5 * (4 - SENSORS.len() + place));
        place += 1;
    }
    word
};
/// The longest sampling time for all channels (sections 13.13.4 and 13.13.5): a thermistor's
/// divider is slow.
const LONGEST: (u32, u32) = (0x07FF_FFFF, 0x3FFF_FFFF);
/// Microseconds from the converter's start to its first reading; 3 are enough (data sheet, table
/// 67).
const STABLE_US: u32 = 10;
/// The largest result.
const FULL: f32 = 4095.0;

/// The heaters of the board.
pub(crate) struct HeatPins;

impl HeatPins {
    /// Switches the converter on and begins a first reading. Before the interrupts are on.
    pub(crate) fn new() -> Self {
        for (pin, _) in SENSORS {
            pin.make_analog();
        }
        if let Some(fault) = HEATER_FAULT {
            fault.pin.make_input(fault.pull);
        }
        converters().ccr().write(|w| w.adcpre().div4());
        converter().cr1().write(|w| w.scan().enabled());
        converter().smpr1().put(LONGEST.0);
        converter().smpr2().put(LONGEST.1);
        converter().jsqr().put(SEQUENCE);
        converter().cr2().write(|w| w.adon().enabled());
        cortex_m::asm::delay(STABLE_US * (clock::CPU_HZ / 1_000_000));
        read_all();
        Self
    }
}

fn read_all() {
    converter()
        .cr2()
        .write(|w| w.adon().enabled().jswstart().start());
}

impl HeatPort for HeatPins {
    fn begin(&mut self, _: Instant) {
        read_all();
    }

    fn sensor(&mut self, heater: usize) -> f32 {
        let result = match heater {
            0 => converter().jdr1().read().bits(),
            1 => converter().jdr2().read().bits(),
            2 => converter().jdr3().read().bits(),
            _ => converter().jdr4().read().bits(),
        };
        result as f32 / FULL
    }

    fn heat(&mut self, heater: usize, on: bool) {
        if let Some(output) = PROFILE.heaters.get(heater) {
            output.switch(on);
        }
    }

    fn supply(&mut self, on: bool) {
        if let Some(relay) = PROFILE.heater_supply {
            relay.switch(on);
        }
    }

    fn external_fault(&mut self) -> bool {
        HEATER_FAULT.is_some_and(|input| !input.level())
    }

    fn fan(&mut self, power: u8) {
        if let Some(fan) = PROFILE.fan {
            fan.switch(power > 0);
        }
    }
}
