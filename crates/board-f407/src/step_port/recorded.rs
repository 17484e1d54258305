//! The tables of a board whose pins are in its record: room for a port and a word for each motor.
//! Where motors share a port, their bits are in one word, and the last places stay unused.
use crate::{
    chip::Bank,
    fast_memory::placed,
    gpio::{AnyPort, Pin},
    profile::{self, MOTORS},
};
use core::sync::atomic::{AtomicU32, AtomicU8, Ordering::Relaxed};
use heapless::Vec;
use leadscrew_stepper::MotorMask;

/// Sets of motors.
const SETS: usize = 1 << MOTORS;

type Words = [AtomicU32; MOTORS];

const NO_WORDS: Words = [const { AtomicU32::new(0) }; MOTORS];

/// Ports, and their words for each set of motors. The main loop writes them at rest, the step
/// interrupt reads them.
struct Table {
    /// Ports in use.
    count: AtomicU8,
    ports: [AnyPort; MOTORS],
    words: [Words; SETS],
}

impl Table {
    const fn new() -> Self {
        Self {
            count: AtomicU8::new(0),
            ports: [const { AnyPort::new() }; MOTORS],
            words: [const { NO_WORDS }; SETS],
        }
    }

    /// Puts the words for `motors` on the ports.
    #[inline(always)] // and `put`: the step interrupt must reach no code in flash (`xtask thumb`)
    fn write(&self, motors: MotorMask) {
        // Within the table: bits beyond the motors are masked off, and the compiler sees it.
        self.put(&self.words[usize::from(motors.bits()) % SETS]);
    }

    #[inline(always)]
    fn put(&self, words: &Words) {
        let count = self.count.load(Relaxed);
        for ((port, word), place) in self.ports.iter().zip(words).zip(1..) {
            // Without a port, the first word is 0, which changes no pin.
            port.write(word.load(Relaxed));
            if place >= count {
                return;
            }
        }
    }

    /// Makes the table. For each set of motors, `level` returns the level of each pin, from the
    /// motor's number and whether it is in the set. `None` leaves the pin alone.
    fn fill(&self, pins: &Pins, level: impl Fn(usize, bool) -> Option<bool>) {
        let banks = banks(pins);
        for (port, bank) in self.ports.iter().zip(&banks) {
            port.set(*bank);
        }
        self.count.store(banks.len() as u8, Relaxed);
        for (set, words) in (0u8..).zip(&self.words) {
            let set = MotorMask::from_bits(set);
            fill_words(words, pins, &banks, |motor| {
                level(motor, set.contains(motor))
            });
        }
    }
}

/// A pin of each motor.
type Pins = [Option<Pin>; MOTORS];

/// The ports of pins, each once, in the order in which they come first.
fn banks(pins: &Pins) -> Vec<Bank, MOTORS> {
    let mut banks = Vec::new();
    for pin in pins.iter().flatten() {
        if !banks.contains(&pin.bank) {
            // There are no more ports than pins.
            let _ = banks.push(pin.bank);
        }
    }
    banks
}

/// Makes one word for each port.
fn fill_words(words: &Words, pins: &Pins, banks: &[Bank], level: impl Fn(usize) -> Option<bool>) {
    for (bank, word) in banks.iter().zip(words) {
        let bits = pins.iter().enumerate().filter_map(|(motor, pin)| {
            let here = pin.filter(|pin| pin.bank == *bank)?;
            level(motor).map(|high| here.word(high))
        });
        word.store(bits.fold(0, |word, pin| word | pin), Relaxed);
    }
}

/// All words that go to the ports, in one static: the interrupts load its address once.
struct Tables {
    steps: Table,
    directions: Table,
    /// Words that end a pulse, for the ports of `steps`.
    pulse_end: Words,
}

// SAFETY of the section: it is memory that `fast_memory` has zeroed before anything reads it.
placed! { ".bss.ccm.tables";
    static TABLES: Tables = Tables {
        steps: Table::new(),
        directions: Table::new(),
        pulse_end: NO_WORDS,
    };
}

/// Makes the tables. `steps` are the motors whose step pulses are low, `directions` are those whose
/// direction pin is low for the negative direction. Main loop, at rest.
pub(super) fn fill(steps: MotorMask, directions: MotorMask) {
    let motors = profile::motors();
    let (step, direction) = (motors.map(|motor| motor.0), motors.map(|motor| motor.1));
    TABLES.steps.fill(&step, |motor, stepping| {
        stepping.then(|| !steps.contains(motor))
    });
    TABLES.directions.fill(&direction, |motor, negative| {
        Some(negative != directions.contains(motor))
    });
    fill_words(&TABLES.pulse_end, &step, &banks(&step), |motor| {
        Some(steps.contains(motor))
    });
}

/// Puts the step pins of these motors to the level of a pulse.
#[inline(always)]
pub(super) fn step(motors: MotorMask) {
    TABLES.steps.write(motors);
}

/// Puts out the directions of all motors.
#[inline(always)]
pub(super) fn set_direction(negative: MotorMask) {
    TABLES.directions.write(negative);
}

/// Puts all step pins to the level between pulses.
#[inline(always)]
pub(super) fn end_pulse() {
    TABLES.steps.put(&TABLES.pulse_end);
}
