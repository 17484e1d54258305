//! Words that the main loop, the step interrupt and the switch interrupt share. The machine has
//! words of its own besides.
//!
//! ```text
//!  main loop --- orders: wiring, power --> step interrupt
//!            <-- power in motion, faults --
//!            <-- levels, faults ----------- switch interrupt
//! ```
//!
//! Loads and stores are enough. The main loop gives an order, the step interrupt clears it and
//! carries it out; the main loop never interrupts the step interrupt. Power is written by the main
//! loop at rest and by the step interrupt in motion. Every other word has one writer.

use crate::bell::Bell;
use crate::fault::Fault;
use core::sync::atomic::{AtomicBool, AtomicU16, AtomicU32, AtomicU8, Ordering};
use fixed::types::U1F31;
use leadscrew_machine::board::{PortConfig, Switches};
use leadscrew_machine::inputs::Inputs;
use leadscrew_stepper::{MotorMask, Power, Shared};

/// The bells of the tasks, which do not depend on the number of motors.
pub(crate) struct Bells {
    /// Wakes the main loop.
    pub(crate) machine: Bell,
    /// Wakes the sender of the serial line.
    pub(crate) wire: Bell,
    /// Set if the queue of the wire had no room for a byte.
    pub(crate) wire_is_full: AtomicBool,
}

/// See the module.
pub(crate) struct Words<const MOTORS: usize> {
    pub(crate) shared: Shared<MOTORS>,
    pub(crate) inputs: Inputs<MOTORS>,
    pub(crate) bells: Bells,
    ordered: AtomicBool,
    step_invert: AtomicU8,
    direction_invert: AtomicU8,
    pulse_us: AtomicU8,
    filter_us: AtomicU32,
    /// The bits of the share of full power.
    power: AtomicU32,
    /// The inputs that are low. All words of an empty memory are 0: it takes no room in a program's
    /// image.
    low: AtomicU16,
    faults: [AtomicBool; Fault::ALL.len()],
}

impl<const MOTORS: usize> Words<MOTORS> {
    pub(crate) const fn new() -> Self {
        Self {
            shared: Shared::new(),
            inputs: Inputs::new(),
            bells: Bells {
                machine: Bell::new(),
                wire: Bell::new(),
                wire_is_full: AtomicBool::new(false),
            },
            ordered: AtomicBool::new(false),
            step_invert: AtomicU8::new(0),
            direction_invert: AtomicU8::new(0),
            pulse_us: AtomicU8::new(0),
            filter_us: AtomicU32::new(0),
            power: AtomicU32::new(0),
            low: AtomicU16::new(0),
            faults: [const { AtomicBool::new(false) }; Fault::ALL.len()],
        }
    }

    /// Orders a wiring. Main loop, at rest.
    pub(crate) fn order_wiring(&self, wiring: &PortConfig) {
        let (steps, directions) = (wiring.step_invert.bits(), wiring.direction_invert.bits());
        self.step_invert.store(steps, Ordering::Relaxed);
        self.direction_invert.store(directions, Ordering::Relaxed);
        self.pulse_us.store(wiring.pulse_us, Ordering::Relaxed);
        self.filter_us.store(wiring.filter_us, Ordering::Relaxed);
        self.ordered.store(true, Ordering::Release);
    }

    /// Orders a power. Main loop.
    pub(crate) fn order_power(&self, power: Power) {
        self.note_power(power);
        self.ordered.store(true, Ordering::Release);
    }

    /// Notes the power that motion has. Step interrupt.
    pub(crate) fn note_power(&self, power: Power) {
        self.power.store(power.share().to_bits(), Ordering::Relaxed);
    }

    /// The power that was ordered or noted last. Any context.
    pub(crate) fn power(&self) -> Power {
        Power::from_share(U1F31::from_bits(self.power.load(Ordering::Relaxed)))
    }

    /// Takes an order, if there is one. Step interrupt.
    pub(crate) fn take_order(&self) -> Option<(Pulse, Power)> {
        if !self.ordered.load(Ordering::Acquire) {
            return None;
        }
        self.ordered.store(false, Ordering::Relaxed);
        let mask = |bits: &AtomicU8| MotorMask::from_bits(bits.load(Ordering::Relaxed));
        let pulse = Pulse {
            step_invert: mask(&self.step_invert),
            direction_invert: mask(&self.direction_invert),
            pulse_us: self.pulse_us.load(Ordering::Relaxed),
        };
        Some((pulse, self.power()))
    }

    /// The time for which a switch has to keep a level, µs. Switch interrupt.
    pub(crate) fn filter_us(&self) -> u32 {
        self.filter_us.load(Ordering::Relaxed)
    }

    /// Keeps the levels of the switches. Switch interrupt.
    pub(crate) fn set_levels(&self, switches: &Switches) {
        self.low.store(!packed(switches), Ordering::Relaxed);
    }

    /// The levels of the switches. Any context.
    pub(crate) fn levels(&self) -> Switches {
        let levels = !self.low.load(Ordering::Relaxed);
        let is_high = |bit: u32| levels >> bit & 1 == 1;
        Switches {
            limits: MotorMask::from_bits(levels.to_le_bytes()[0]),
            probe: is_high(8),
            reset: is_high(9),
            hold: is_high(10),
            start: is_high(11),
            door: is_high(12),
        }
    }

    /// Notes a fault, and stops motion before the next step. Each fault has one context.
    pub(crate) fn fail(&self, fault: Fault) {
        if let Some(word) = self.faults.get(fault as usize) {
            word.store(true, Ordering::Release);
        }
        self.shared.set_stop(true);
        self.bells.machine.ring();
    }

    /// The first fault since power-up. Main loop.
    pub(crate) fn fault(&self) -> Option<Fault> {
        let mut faults = Fault::ALL.iter().zip(&self.faults);
        let found = faults.find(|(_, word)| word.load(Ordering::Acquire));
        found.map(|(fault, _)| *fault)
    }
}

/// The pulses and the polarity that the settings ask for.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Pulse {
    /// Motors whose step pin is low in a pulse (`$2`).
    pub step_invert: MotorMask,
    /// Motors whose direction pin is low in the negative direction (`$3`).
    pub direction_invert: MotorMask,
    /// Least width of a pulse, µs (`$0`).
    pub pulse_us: u8,
}

/// The levels as bits: limits in the lower byte, the others above it.
fn packed(switches: &Switches) -> u16 {
    let buttons = [
        switches.probe,
        switches.reset,
        switches.hold,
        switches.start,
        switches.door,
    ];
    let bits = (8..).zip(buttons).map(|(bit, high)| u16::from(high) << bit);
    bits.fold(u16::from(switches.limits.bits()), |all, bit| all | bit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_switch_has_a_place_of_its_own_in_the_word() {
        let words = Words::<3>::new();
        assert_eq!(words.levels(), Switches::OPEN);
        let closed: [fn(&mut Switches); 7] = [
            |s| s.limits = MotorMask::from_bits(0xFE),
            |s| s.limits = MotorMask::from_bits(0x7F),
            |s| s.probe = false,
            |s| s.reset = false,
            |s| s.hold = false,
            |s| s.start = false,
            |s| s.door = false,
        ];
        for close in closed {
            let mut switches = Switches::OPEN;
            close(&mut switches);
            words.set_levels(&switches);
            assert_eq!(words.levels(), switches);
        }
    }

    #[test]
    fn an_order_is_taken_once_and_has_the_newest_power() {
        let words = Words::<3>::new();
        assert_eq!(words.take_order(), None);
        words.order_power(Power::FULL);
        words.order_wiring(&PortConfig {
            pulse_us: 7,
            ..PortConfig::default()
        });
        let (pulse, power) = words.take_order().unwrap();
        assert_eq!((pulse.pulse_us, power), (7, Power::FULL));
        assert_eq!(words.take_order(), None);
    }
}
