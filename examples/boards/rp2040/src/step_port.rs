//! Step and direction pins, and their alarms.
#![allow(unsafe_code)]

use crate::clock::{count, timer};
use core::sync::atomic::{AtomicBool, AtomicU32, AtomicU8, Ordering::Relaxed};
use leadscrew_machine::board::PortConfig;
use leadscrew_stepper::{MotorMask, OutputChange, Power, StepPort, Ticks};
use rp2040_hal::pac;

/// The numbers of the first of three step pins, and of the first of three direction pins.
const STEPS: u32 = 2;
const DIRECTIONS: u32 = 5;
const MOTORS: u8 = 0b111;

/// Alarm 0: the next tick. Alarm 1: the end of a pulse.
const TICK: u32 = 1 << 0;
const PULSE: u32 = 1 << 1;

static STEP_INVERT: AtomicU8 = AtomicU8::new(0);
static DIRECTION_INVERT: AtomicU8 = AtomicU8::new(0);
/// The length of a pulse, µs.
static PULSE_US: AtomicU32 = AtomicU32::new(10);
/// The directions, which wait for the end of a pulse.
static NEGATIVE: AtomicU8 = AtomicU8::new(0);
static PULSING: AtomicBool = AtomicBool::new(false);

/// Enables the interrupts of both alarms. Called once.
pub(crate) fn start() {
    // SAFETY: the bits belong to our alarms.
    timer().inte().write(|w| unsafe { w.bits(TICK | PULSE) });
}

/// Applies the settings of the pins. Called by the main loop, at rest.
pub(crate) fn configure(port: &PortConfig) {
    STEP_INVERT.store(port.step_invert.bits(), Relaxed);
    DIRECTION_INVERT.store(port.direction_invert.bits(), Relaxed);
    PULSE_US.store(port.pulse_us.into(), Relaxed);
    end_pulse_in(1); // the pins go to their new levels
}

/// Makes the step interrupt come at once. Called by the main loop.
pub(crate) fn pend() {
    rtic::pend(pac::Interrupt::TIMER_IRQ_0);
}

/// Ends a pulse, and sets directions that have waited for its end.
pub(crate) fn on_pulse_end() {
    // SAFETY: writing the bit clears the alarm's flag.
    timer().intr().write(|w| unsafe { w.bits(PULSE) });
    put(STEPS, MOTORS, STEP_INVERT.load(Relaxed));
    PULSING.store(false, Relaxed);
    write_directions();
}

fn end_pulse_in(microseconds: u32) {
    let end = count().wrapping_add(microseconds + 1);
    // SAFETY: any value is a valid instant.
    timer().alarm1().write(|w| unsafe { w.bits(end) });
}

fn write_directions() {
    put(
        DIRECTIONS,
        MOTORS,
        NEGATIVE.load(Relaxed) ^ DIRECTION_INVERT.load(Relaxed),
    );
}

/// Sets the pins of `mask`, counted from pin `first`, to `levels`.
fn put(first: u32, mask: u8, levels: u8) {
    let high = u32::from(levels & mask) << first;
    let low = u32::from(!levels & mask) << first;
    // SAFETY: stores that change these pins and no others; `board::start` has made them outputs.
    unsafe {
        let sio = &*pac::SIO::ptr();
        sio.gpio_out_set().write(|w| w.bits(high));
        sio.gpio_out_clr().write(|w| w.bits(low));
    }
}

/// The pins and the alarm, as the step interrupt uses them.
pub(crate) struct Port {
    /// The tick that comes next, or is being handled.
    due: u32,
}

impl Port {
    pub(crate) const fn new() -> Self {
        Self { due: 0 }
    }

    /// Begins motion: ticks are counted from now.
    pub(crate) fn begin(&mut self) {
        self.due = count();
    }

    /// Clears the flag of the tick that is being handled. Either the alarm has set the flag, or the
    /// code for a late tick.
    pub(crate) fn acknowledge(&mut self) {
        // SAFETY: the bits belong to our alarm.
        unsafe {
            timer().intf().modify(|r, w| w.bits(r.bits() & !TICK));
            timer().intr().write(|w| w.bits(TICK));
        }
    }
}

impl StepPort for Port {
    fn step(&mut self, motors: MotorMask) {
        PULSING.store(true, Relaxed);
        put(
            STEPS,
            motors.bits(),
            motors.bits() ^ STEP_INVERT.load(Relaxed),
        );
        end_pulse_in(PULSE_US.load(Relaxed));
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
        self.due = self.due.wrapping_add(wait.0);
        // SAFETY: any value is a valid instant.
        timer().alarm0().write(|w| unsafe { w.bits(self.due) });
    }

    fn make_up(&mut self) -> bool {
        // The alarm compares for equality: an instant that has passed would match only after 71
        // minutes.
        let late = count().wrapping_sub(self.due).cast_signed() >= 0;
        if late {
            // SAFETY: the bit belongs to our alarm.
            timer()
                .intf()
                .modify(|r, w| unsafe { w.bits(r.bits() | TICK) });
        }
        late
    }

    fn rest(&mut self) {
        // SAFETY: writing the bit disarms the alarm.
        timer().armed().write(|w| unsafe { w.bits(TICK) });
    }
}
