//! Motors without drivers: the board switches the lines of their windings. A step puts a motor's
//! lines to the next state of [`FIVE_PHASE_HALF_STEPS`]. Each motor gets one store, one after the
//! other.
//!
//! `$2` has nothing to invert: a line is high when current flows. `$3` turns a motor the other way
//! round.
use crate::{chip::Bank, fast_memory::placed, profile::MOTORS, profile::PROFILE};
use core::sync::atomic::{AtomicBool, AtomicU32, AtomicU8, Ordering::Relaxed};
use leadscrew_stepper::{next_state, MotorMask, FIVE_PHASE_HALF_STEPS};

const STATES: usize = FIVE_PHASE_HALF_STEPS.len();

/// The port of each motor's lines. `Board::check` has seen that they are on one port.
const BANKS: [Bank; MOTORS] = {
    let mut banks = [Bank::A; MOTORS];
    let mut motor = 0;
    while motor < MOTORS {
        banks[motor] = PROFILE.motors[motor].lines[0].bank;
        motor += 1;
    }
    banks
};

// SAFETY of the section: it is memory that `fast_memory` has zeroed before anything reads it.
placed! { ".bss.ccm.lines";
    /// The word for the port of each motor in each state.
    static WORDS: [[AtomicU32; STATES]; MOTORS] =
        [const { [const { AtomicU32::new(0) }; STATES] }; MOTORS];
}
placed! { ".bss.ccm.states";
    /// The state of each motor.
    static AT: [AtomicU8; MOTORS] = [const { AtomicU8::new(0) }; MOTORS];
}
placed! { ".bss.ccm.turns";
    /// The motors that go back to the state before.
    static BACK: AtomicU8 = AtomicU8::new(0);
}
placed! { ".bss.ccm.inverted";
    /// The motors that `$3` inverts.
    static INVERTED: AtomicU8 = AtomicU8::new(0);
}
placed! { ".bss.ccm.energised";
    /// True if current flows.
    static ENERGISED: AtomicBool = AtomicBool::new(false);
}

/// The word that puts out a motor's lines; bit *n* of `lines` is line *n*.
fn word(motor: usize, lines: u8) -> u32 {
    let pins = PROFILE.motors.get(motor).map(|pins| pins.lines);
    let pins = pins.iter().flatten().enumerate();
    pins.fold(0, |word, (line, pin)| {
        word | pin.word(lines >> line & 1 == 1)
    })
}

/// Makes the table. `inverted` are the motors that turn the other way. Main loop, at rest.
pub(super) fn fill(_: MotorMask, inverted: MotorMask) {
    INVERTED.store(inverted.bits(), Relaxed);
    for (motor, words) in WORDS.iter().enumerate() {
        for (word_of, lines) in words.iter().zip(FIVE_PHASE_HALF_STEPS) {
            word_of.store(word(motor, lines), Relaxed);
        }
    }
}

/// Switches the current of all motors on, each in its state, or off. Main loop.
pub(crate) fn energise(on: bool) {
    ENERGISED.store(on, Relaxed);
    for (motor, at) in AT.iter().enumerate() {
        // A tick in between may step the motor. Then the older state must not stay.
        loop {
            let state = at.load(Relaxed);
            match on {
                true => put(motor, state),
                false => BANKS[motor].write(word(motor, 0)),
            }
            if at.load(Relaxed) == state {
                break;
            }
        }
    }
}

/// Takes these motors to their next states.
pub(super) fn step(motors: MotorMask) {
    let back = MotorMask::from_bits(BACK.load(Relaxed));
    for (motor, at) in AT.iter().enumerate() {
        if motors.contains(motor) {
            let state = usize::from(at.load(Relaxed));
            let state = next_state::<STATES>(state, back.contains(motor)) as u8; // below 10
            at.store(state, Relaxed);
            if ENERGISED.load(Relaxed) {
                put(motor, state);
            }
        }
    }
}

/// Puts out a motor's lines in a state.
fn put(motor: usize, state: u8) {
    // Within the table: a state is below its length, and the compiler sees it.
    let word = &WORDS[motor][usize::from(state) % STATES];
    BANKS[motor].write(word.load(Relaxed));
}

/// Notes the directions of all motors for their next steps.
pub(super) fn set_direction(negative: MotorMask) {
    BACK.store(negative.bits() ^ INVERTED.load(Relaxed), Relaxed);
}

/// Does nothing: a step is no pulse.
pub(super) fn end_pulse() {}
