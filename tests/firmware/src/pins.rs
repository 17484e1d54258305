//! The wiring of the firmware's default profile, copied from the wiring table in
//! `crates/board-f407/README.md`: the pins are checked against that table, not against the
//! firmware's own source.
use leadscrew_f407emu::{Pin, SerialLine, SerialPort};

/// Frequency of the board's crystal in Hz.
pub(crate) const CRYSTAL_HZ: u32 = 8_000_000;
/// CPU clock in Hz once the firmware has set it.
pub(crate) const CPU_HZ: u64 = 168_000_000;
/// CPU cycles in a count of the step timer.
pub(crate) const CYCLES_PER_COUNT: u64 = 2;
/// The serial line under test.
pub(crate) const LINE: SerialLine = SerialLine {
    port: SerialPort::Usart2,
    output: Pin::new('A', 2),
    input: Pin::new('A', 3),
};
/// Step pins of X, Y, Z.
pub(crate) const STEP: [Pin; 3] = [Pin::new('E', 7), Pin::new('E', 8), Pin::new('E', 9)];
/// Direction pins of X, Y, Z; high is negative.
pub(crate) const DIRECTION: [Pin; 3] = [Pin::new('E', 10), Pin::new('E', 11), Pin::new('E', 12)];
/// The timer and channel whose matches are the ticks of motion.
pub(crate) const TICK: (u8, u8) = (2, 1);
/// The timer and channel whose matches end the time of the switches' filter.
pub(crate) const SETTLED: (u8, u8) = (5, 2);
/// Number of the step timer's interrupt (TIM2).
pub(crate) const STEP_IRQ: u8 = 28;
/// Number of the interrupt that ends a pulse (TIM11).
pub(crate) const PULSE_IRQ: u8 = 26;
/// Limit switches of X, Y, Z: low when closed.
pub(crate) const LIMIT: [Pin; 3] = [Pin::new('E', 4), Pin::new('E', 5), Pin::new('E', 6)];
/// Probe, door, reset and feed hold: low when closed.
pub(crate) const PROBE: Pin = Pin::new('C', 1);
pub(crate) const DOOR: Pin = Pin::new('C', 2);
pub(crate) const RESET: Pin = Pin::new('C', 8);
pub(crate) const HOLD: Pin = Pin::new('C', 9);
/// Cycle start: high when pressed.
pub(crate) const START: Pin = Pin::new('A', 0);
/// The time for which an input must keep its level before it is accepted, s.
pub(crate) const FILTER_SECONDS: f64 = 200e-6;
/// Outputs: spindle on, spindle counter-clockwise, flood and mist coolant.
pub(crate) const SPINDLE: Pin = Pin::new('D', 13);
pub(crate) const REVERSE: Pin = Pin::new('D', 14);
pub(crate) const FLOOD: Pin = Pin::new('D', 15);
pub(crate) const MIST: Pin = Pin::new('D', 11);
/// Enable of all motors: low enables.
pub(crate) const ENABLE: Pin = Pin::new('E', 13);
/// Power of laser or spindle, a PWM.
pub(crate) const POWER: Pin = Pin::new('D', 12);
