//! Step and direction pins, and the timers behind them.

use crate::clock::{self, Alarm};
use crate::register::Register;
use core::sync::atomic::{AtomicBool, AtomicU32, AtomicU8, Ordering::Relaxed};
use leadscrew_machine::board::PortConfig;
use leadscrew_stepper::{MotorMask, OutputChange, Power, StepPort, Ticks};

/// Rings at the next tick.
pub(crate) const TICK: Alarm = Alarm(0x4003_0000);
/// Rings at the end of a pulse.
pub(crate) const PULSE: Alarm = Alarm(0x4003_1000);

const PORT_D: u32 = 0x4000_7000;
const PORT_E: u32 = 0x4002_4000;
const MOTORS: u32 = 0b111;
const ENABLE: u32 = 1 << 3;

/// A store at `base + 4 * mask` changes the pins of `mask` and no others (data sheet, GPIO data
/// register).
const fn pins(base: u32, mask: u32) -> Register {
    Register::at(base, mask << 2)
}

/// Motors whose step pin is low in a pulse.
static STEP_INVERT: AtomicU8 = AtomicU8::new(0);
static DIRECTION_INVERT: AtomicU8 = AtomicU8::new(0);
/// How long a pulse lasts, counts.
static PULSE_COUNTS: AtomicU32 = AtomicU32::new(10 * 50);
/// Directions that wait for the end of the pulse.
static NEGATIVE: AtomicU8 = AtomicU8::new(0);
static PULSING: AtomicBool = AtomicBool::new(false);

/// Makes the pins outputs, drivers off. Once.
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

/// Puts the wiring into effect. Main loop, at rest.
pub(crate) fn configure(port: &PortConfig) {
    STEP_INVERT.store(port.step_invert.bits(), Relaxed);
    DIRECTION_INVERT.store(port.direction_invert.bits(), Relaxed);
    PULSE_COUNTS.store(u32::from(port.pulse_us) * (clock::HZ / 1_000_000), Relaxed);
    PULSE.ring_in(1); // pins go to their levels
}

/// Drivers are enabled by a low level. Main loop.
pub(crate) fn enable_motors(on: bool) {
    pins(PORT_E, ENABLE).write(if on { 0 } else { ENABLE });
}

/// Ends a pulse; directions that have waited for that follow. Interrupt of the second timer, as
/// high as that of the first.
pub(crate) fn on_pulse_end() {
    pins(PORT_E, MOTORS).write(STEP_INVERT.load(Relaxed).into());
    PULSING.store(false, Relaxed);
    write_directions();
}

fn write_directions() {
    let levels = NEGATIVE.load(Relaxed) ^ DIRECTION_INVERT.load(Relaxed);
    pins(PORT_D, MOTORS).write(levels.into());
}

/// What the step interrupt drives.
pub(crate) struct Port {
    /// The tick that rings next, or is being handled: a place in [`clock::count`].
    due: u64,
}

impl Port {
    pub(crate) const fn new() -> Self {
        Self { due: 0 }
    }

    /// Motion begins: ticks count from now.
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

    fn arm(&mut self, wait: Ticks) -> bool {
        self.due += u64::from(wait.0);
        let now = clock::count();
        TICK.ring_in(self.due.saturating_sub(now));
        self.due < now
    }

    fn rest(&mut self) {
        TICK.silence();
    }
}
