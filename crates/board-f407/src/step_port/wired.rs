//! The tables of a board whose pins are compiled in: for each set of motors, a word for each port
//! with step pins, and for each port with direction pins.
use crate::{
    chip::Bank,
    fast_memory::placed,
    gpio::Pin,
    profile::{banks, index_of, MOTORS, PROFILE},
};
use core::{
    array::from_fn,
    sync::atomic::{AtomicU32, Ordering::Relaxed},
};
use leadscrew_stepper::MotorMask;

/// Sets of motors.
const SETS: usize = 1 << MOTORS;
const STEP_PINS: [Pin; MOTORS] = {
    let mut pins = [PROFILE.motors[0].step; MOTORS];
    let mut motor = 0;
    while motor < MOTORS {
        pins[motor] = PROFILE.motors[motor].step;
        motor += 1;
    }
    pins
};
const DIRECTION_PINS: [Pin; MOTORS] = {
    let mut pins = [PROFILE.motors[0].direction; MOTORS];
    let mut motor = 0;
    while motor < MOTORS {
        pins[motor] = PROFILE.motors[motor].direction;
        motor += 1;
    }
    pins
};
const STEP_BANKS: ([Bank; MOTORS], usize) = banks(STEP_PINS);
const DIRECTION_BANKS: ([Bank; MOTORS], usize) = banks(DIRECTION_PINS);

/// The words for each set of motors, one a port. Written by the main loop at rest, read by the step
/// interrupt.
struct Words<const BANKS: usize>([[AtomicU32; BANKS]; SETS]);

impl<const BANKS: usize> Words<BANKS> {
    const fn new() -> Self {
        Self([const { [const { AtomicU32::new(0) }; BANKS] }; SETS])
    }

    /// Puts the words for `motors` on the ports.
    #[inline(always)]
    fn write(&self, banks: &[Bank; MOTORS], motors: MotorMask) {
        // Within the table: bits beyond the motors are masked off, and the compiler sees it.
        let words = &self.0[usize::from(motors.bits()) % SETS];
        for (bank, word) in banks.iter().zip(words) {
            bank.write(word.load(Relaxed));
        }
    }

    /// Makes the table. For each set of motors, `level` returns the level of each pin, from the
    /// motor's number and whether it is in the set. `None` leaves the pin alone.
    fn fill(
        &self,
        pins: &[Pin; MOTORS],
        banks: &[Bank; MOTORS],
        level: impl Fn(usize, bool) -> Option<bool>,
    ) {
        for (set, words) in (0u8..).zip(&self.0) {
            let set = MotorMask::from_bits(set);
            for (bank, word) in words.iter().enumerate() {
                let here = |(motor, pin): (usize, &Pin)| {
                    let high = level(motor, set.contains(motor))?;
                    (index_of(banks, MOTORS, pin.bank) == bank).then(|| pin.word(high))
                };
                let all = pins.iter().enumerate().filter_map(here);
                word.store(all.fold(0, |word, pin| word | pin), Relaxed);
            }
        }
    }
}

// SAFETY of the section: it is memory that `fast_memory` has zeroed before anything reads it.
placed! { ".bss.ccm.steps";
    static STEPS: Words<{ STEP_BANKS.1 }> = Words::new();
}
placed! { ".bss.ccm.directions";
    static DIRECTIONS: Words<{ DIRECTION_BANKS.1 }> = Words::new();
}
placed! { ".bss.ccm.pulse_end";
    /// Words that end a pulse, one a port.
    static PULSE_END: [AtomicU32; STEP_BANKS.1] = [const { AtomicU32::new(0) }; STEP_BANKS.1];
}

/// Makes the tables. `steps` are the motors whose step pulses are low, `directions` are those whose
/// direction pin is low for the negative direction. Main loop, at rest.
pub(super) fn fill(steps: MotorMask, directions: MotorMask) {
    STEPS.fill(&STEP_PINS, &STEP_BANKS.0, |motor, stepping| {
        stepping.then(|| !steps.contains(motor))
    });
    DIRECTIONS.fill(&DIRECTION_PINS, &DIRECTION_BANKS.0, |motor, negative| {
        Some(negative != directions.contains(motor))
    });
    let ends: [u32; STEP_BANKS.1] = from_fn(|bank| {
        let here = STEP_PINS
            .iter()
            .enumerate()
            .filter(|(_, pin)| index_of(&STEP_BANKS.0, STEP_BANKS.1, pin.bank) == bank);
        here.fold(0, |word, (motor, pin)| {
            word | pin.word(steps.contains(motor))
        })
    });
    for (word, end) in PULSE_END.iter().zip(ends) {
        word.store(end, Relaxed);
    }
}

/// Puts the step pins of these motors to the level of a pulse.
#[inline(always)]
pub(super) fn step(motors: MotorMask) {
    STEPS.write(&STEP_BANKS.0, motors);
}

/// Puts out the directions of all motors.
#[inline(always)]
pub(super) fn set_direction(negative: MotorMask) {
    DIRECTIONS.write(&DIRECTION_BANKS.0, negative);
}

/// Puts all step pins to the level between pulses.
#[inline(always)]
pub(super) fn end_pulse() {
    for (bank, word) in STEP_BANKS.0.iter().zip(&PULSE_END) {
        bank.write(word.load(Relaxed));
    }
}
