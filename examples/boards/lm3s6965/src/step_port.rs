//! Step and direction pins, and their timers.

use crate::clock::{self, Alarm};
use crate::register::Register;
use core::sync::atomic::{AtomicBool, AtomicU32, AtomicU8, Ordering::Relaxed};
use leadscrew_machine::board::PortConfig;
use leadscrew_stepper::{MotorMask, OutputChange, Power, StepPort, Ticks};

/// The timer of the next tick.
pub(crate) const TICK: Alarm = Alarm(0x4003_0000);
/// The timer that ends a pulse.
pub(crate) const PULSE: Alarm = Alarm(0x4003_1000);

const PORT_D: u32 = 0x4000_7000;
const PORT_E: u32 = 0x4002_4000;
const MOTORS: u32 = 0b111;
const ENABLE: u32 = 1 << 3;

/// The data register that changes only the pins of `mask`: it is at `base + 4 * mask` (data sheet,
/// GPIO data register).
const fn pins(base: u32, mask: u32) -> Register {
    Register::at(base, mask << 2)
}

/// The motors whose step pin is low in a pulse.
static STEP_INVERT: AtomicU8 = AtomicU8::new(0);
static DIRECTION_INVERT: AtomicU8 = AtomicU8::new(0);
/// The length of a pulse, counts.
static PULSE_COUNTS: AtomicU32 = AtomicU32::new(10 * 50);
/// The directions, which wait for the end of a pulse.
static NEGATIVE: AtomicU8 = AtomicU8::new(0);
static PULSING: AtomicBool = AtomicBool::new(false);

/// Makes the pins outputs, with the drivers off. Called once.
pub(crate) fn start() {
    const DIRECTION: u32 = 0x400;
    const DIGITAL: u32 = 0x51C;
    for (port, outputs) in [(PORT_D, MOTORS), (PORT_E, MOTORS | ENABLE)] {
        pins(port, outputs).write(outputs & ENABLE);
        Register::at(port, DIRECTION).set(outputs);
        Register::at(port, DIGITAL).set(outputs);
    }
    TICK.start();
    PULSE.start();
}

/// Applies the settings of the pins. Called by the main loop, at rest.
pub(crate) fn configure(port: &PortConfig) {
    STEP_INVERT.store(port.step_invert.bits(), Relaxed);
    DIRECTION_INVERT.store(port.direction_invert.bits(), Relaxed);
    PULSE_COUNTS.store(u32::from(port.pulse_us) * (clock::HZ / 1_000_000), Relaxed);
    PULSE.ring_in(1); // the pins go to their new levels
}

/// Switches the motor drivers, which a low level enables. Called by the main loop.
pub(crate) fn enable_motors(on: bool) {
    pins(PORT_E, ENABLE).write(if on { 0 } else { ENABLE });
}

/// Ends a pulse, and sets directions that have waited for its end. Called by the interrupt of the
/// second timer, which has the same priority as the first.
pub(crate) fn on_pulse_end() {
    pins(PORT_E, MOTORS).write(STEP_INVERT.load(Relaxed).into());
    PULSING.store(false, Relaxed);
    write_directions();
}

fn write_directions() {
    let levels = NEGATIVE.load(Relaxed) ^ DIRECTION_INVERT.load(Relaxed);
    pins(PORT_D, MOTORS).write(levels.into());
}

/// The pins and the timer, as the step interrupt uses them.
pub(crate) struct Port {
    /// The tick that comes next, or is being handled: an instant of [`clock::count`].
    due: u64,
}

impl Port {
    pub(crate) const fn new() -> Self {
        Self { due: 0 }
    }

    /// Begins motion: ticks are counted from now.
    pub(crate) fn begin(&mut self) {
        self.due = clock::count();
    }
}

impl StepPort for Port {
    fn step(&mut self, motors: MotorMask) {
        PULSING.store(true, Relaxed);
        let levels = motors.bits() ^ STEP_INVERT.load(Relaxed);
        pins(PORT_E, motors.bits().into()).write(levels.into());
        PULSE.ring_in(PULSE_COUNTS.load(Relaxed).into());
    }

    fn set_direction(&mut self, negative: MotorMask) {
        NEGATIVE.store(negative.bits(), Relaxed);
        if !PULSING.load(Relaxed) {
            write_directions();
        }
    }

    fn change_outputs(&mut self, _: OutputChange) {}

    fn set_power(&mut self, _: Power) {}

    fn arm(&mut self, wait: Ticks) {
        self.due += u64::from(wait.0);
        TICK.ring_in(self.due.saturating_sub(clock::count()));
    }

    fn make_up(&mut self) -> bool {
        // A tick whose instant had passed rings at once.
        self.due < clock::count()
    }

    fn rest(&mut self) {
        TICK.silence();
    }
}
