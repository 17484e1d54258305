//! The tables of a board whose pins are in its record: room for a port and a word for each motor.
//! If motors share a port, their bits are in one word, and the last places stay unused.
use crate::{
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
    /// The number of ports in use.
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

    /// Takes the ports of the motors' pins, each once, in the order in which they come first.
    /// Returns the pins with the places of their ports.
    fn take_ports(&self, pins: impl Iterator<Item = Option<Pin>>) -> Vec<Placed, MOTORS> {
        let (mut placed, mut count) = (Vec::<Placed, MOTORS>::new(), 0);
        for (motor, pin) in (0..).zip(pins) {
            let Some(pin) = pin else {
                continue;
            };
            let known = placed.iter().find(|other| other.pin.bank == pin.bank);
            let place = known.map_or(count, |other| other.place);
            if let (None, Some(port)) = (known, self.ports.get(place)) {
                port.set(pin.bank);
                count += 1;
            }
            // There are no more pins than motors.
            let _ = placed.push(Placed { motor, place, pin });
        }
        self.count.store(count as u8, Relaxed);
        placed
    }
}

/// A motor's pin.
struct Placed {
    motor: u8,
    /// The place of its port in the table.
    place: usize,
    pin: Pin,
}

/// Makes the words that put the pins of the motors in `of` to a level: high for those in `high`.
fn fill_words(words: &Words, pins: &[Placed], of: u8, high: u8) {
    for (place, word) in words.iter().enumerate() {
        let mut bits = 0;
        for Placed { motor, pin, .. } in pins.iter().filter(|pin| pin.place == place) {
            if of >> motor & 1 == 1 {
                bits |= pin.word(high >> motor & 1 == 1);
            }
        }
        word.store(bits, Relaxed);
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
    let (low, reversed) = (steps.bits(), directions.bits());
    let motors = profile::motors();
    let step = TABLES.steps.take_ports(motors.iter().map(|motor| motor.0));
    let direction = &TABLES.directions;
    let turn = direction.take_ports(motors.iter().map(|motor| motor.1));
    let tables = TABLES.steps.words.iter().zip(&direction.words);
    for (set, (stepping, negative)) in (0u8..).zip(tables) {
        fill_words(stepping, &step, set, !low);
        fill_words(negative, &turn, u8::MAX, set ^ reversed);
    }
    fill_words(&TABLES.pulse_end, &step, u8::MAX, low);
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
