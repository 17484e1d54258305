//! Motors whose windings the board switches itself: there is no driver that counts steps.
//!
//! ```text
//!   on_timer --> StepPort: Windings --+--> WindingPort: the lines of each motor that steps
//!                                     +--> the board's own StepPort: timer, power, outputs
//! ```
//!
//! A step takes a motor to the next state of its table, or back to the one before. While the motor
//! does not step, its lines keep their state, so that it holds its place. [`Windings::energise`]
//! switches the current off, and on again in the same state.

use crate::{MotorMask, OutputChange, Power, StepPort, Ticks};

/// States of a motor's lines in the order of forward steps: bit *n* is line *n*, counted from 0.
pub type WindingTable<const STATES: usize> = [u8; STATES];

/// Half steps of a motor with five phases: from one state to the next a single line changes.
pub const FIVE_PHASE_HALF_STEPS: WindingTable<10> = [
    0b1_0011, 0b0_0011, 0b0_0111, 0b0_0110, 0b0_1110, 0b0_1100, 0b1_1100, 0b1_1000, 0b1_1001,
    0b1_0001,
];

/// Returns the index of a motor's state after a step: the next one of the table, or with a negative
/// step the one before. The last state and the first are neighbours.
///
/// ```
/// use leadscrew_stepper::next_state;
/// assert_eq!(next_state::<10>(9, false), 0);
/// assert_eq!(next_state::<10>(0, true), 9);
/// ```
#[must_use]
pub const fn next_state<const STATES: usize>(state: usize, negative: bool) -> usize {
    match negative {
        true => match state.checked_sub(1) {
            Some(before) => before,
            None => STATES.saturating_sub(1),
        },
        false if state + 1 < STATES => state + 1,
        false => 0,
    }
}

/// The lines of motors. Implemented by the board; called from the step interrupt, and at rest from
/// the main loop.
pub trait WindingPort {
    /// Puts out all lines of a motor at once: bit *n* is line *n*.
    fn put(&mut self, motor: usize, lines: u8);
}

/// A [`StepPort`] that switches windings. Everything except steps and directions goes to the
/// board's own `port`, whose step pins stay unused.
#[derive(Debug)]
pub struct Windings<P, W, const MOTORS: usize, const STATES: usize> {
    port: P,
    lines: W,
    table: &'static WindingTable<STATES>,
    /// The index in the table of each motor's state.
    states: [usize; MOTORS],
    negative: MotorMask,
    energised: bool,
}

impl<P, W, const MOTORS: usize, const STATES: usize> Windings<P, W, MOTORS, STATES>
where
    W: WindingPort,
{
    /// Motors without current, each at the first state of its table.
    pub const fn new(port: P, lines: W, table: &'static WindingTable<STATES>) -> Self {
        Self {
            port,
            lines,
            table,
            states: [0; MOTORS],
            negative: MotorMask::NONE,
            energised: false,
        }
    }

    /// Switches the current of all motors on, each in its present state of the table, or off. For
    /// `Board::enable_motors`, at rest.
    pub fn energise(&mut self, on: bool) {
        self.energised = on;
        for motor in 0..MOTORS {
            self.put(motor);
        }
    }

    /// Returns the board's own port.
    pub fn port(&mut self) -> &mut P {
        &mut self.port
    }

    fn put(&mut self, motor: usize) {
        let state = self
            .states
            .get(motor)
            .and_then(|state| self.table.get(*state));
        let lines = state.copied().filter(|_| self.energised);
        self.lines.put(motor, lines.unwrap_or(0));
    }
}

impl<P, W, const MOTORS: usize, const STATES: usize> StepPort for Windings<P, W, MOTORS, STATES>
where
    P: StepPort,
    W: WindingPort,
{
    fn step(&mut self, motors: MotorMask) {
        for (motor, state) in self.states.iter_mut().enumerate() {
            if motors.contains(motor) {
                *state = next_state::<STATES>(*state, self.negative.contains(motor));
            }
        }
        for motor in 0..MOTORS {
            if motors.contains(motor) {
                self.put(motor);
            }
        }
    }

    fn set_power(&mut self, power: Power) {
        self.port.set_power(power);
    }

    fn set_direction(&mut self, negative: MotorMask) {
        self.negative = negative;
    }

    fn change_outputs(&mut self, change: OutputChange) {
        self.port.change_outputs(change);
    }

    fn arm(&mut self, wait: Ticks) {
        self.port.arm(wait);
    }

    fn make_up(&mut self) -> bool {
        self.port.make_up()
    }

    fn rest(&mut self) {
        self.port.rest();
    }
}
