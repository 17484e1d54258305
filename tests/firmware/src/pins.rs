//! The wiring of the firmware's default profile, as its wiring table has it (`crates/board-f407/README.md`): what is
//! seen at the pins is held against that table, not against the firmware's own source.
use leadscrew_f407emu::{Pin, SerialPort};

/// Frequency of the board's crystal in Hz.
pub(crate) const CRYSTAL_HZ: u32 = 8_000_000;
/// CPU clock in Hz once the firmware has set it.
pub(crate) const CPU_HZ: u64 = 168_000_000;
/// CPU cycles in a count of the step timer.
pub(crate) const CYCLES_PER_COUNT: u64 = 2;
/// The serial line under test.
pub(crate) const LINE: SerialPort = SerialPort::Usart2;
/// Step pins of X, Y, Z.
pub(crate) const STEP: [Pin; 3] = [Pin::new('E', 7), Pin::new('E', 8), Pin::new('E', 9)];
/// Direction pins of X, Y, Z; high is negative.
pub(crate) const DIRECTION: [Pin; 3] = [Pin::new('E', 10), Pin::new('E', 11), Pin::new('E', 12)];
/// Timer and channel whose matches are the ticks of motion.
pub(crate) const TICK: (u8, u8) = (2, 1);
/// Number of the step timer's interrupt.
pub(crate) const STEP_IRQ: u8 = 28;
/// Power of laser or spindle, a PWM.
pub(crate) const POWER: Pin = Pin::new('D', 12);
