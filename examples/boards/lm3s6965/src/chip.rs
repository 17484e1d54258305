//! The chip: clock, pins, timers and UART0. Addresses and bits are those of the LM3S6965's data
//! sheet.
//!
//! One 50 MHz count serves both steps and the main loop: SysTick counts down 24 bits, and its
//! exception counts how often it wraps around. A one-shot timer raises an interrupt when an instant
//! of this count has come. Timer 0 started anew for each tick would lose the time until its start.

use crate::vectors::Interrupt;
use core::convert::Infallible;
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::peripheral::{scb::SystemHandler, NVIC};
use embedded_hal::digital::{ErrorType, OutputPin};
use leadscrew::{Alarm, Instant};

/// The counts in a second.
pub(crate) const HZ: u32 = 50_000_000;

const RCC: Register = Register(0x400F_E060);
const RCGC1: Register = Register(0x400F_E104);
const RCGC2: Register = Register(0x400F_E108);
const SYST_CSR: Register = Register(0xE000_E010);
const SYST_RVR: Register = Register(0xE000_E014);
const SYST_CVR: Register = Register(0xE000_E018);
const ICSR: Register = Register(0xE000_ED04);

const PORT_A: u32 = 0x4000_4000;
const PORT_D: u32 = 0x4000_7000;
const PORT_E: u32 = 0x4002_4000;
const UART_0: u32 = 0x4000_C000;

/// Step and direction of X, Y, Z.
pub(crate) const MOTORS: [(Pin, Pin); 3] = [
    (Pin(PORT_E, 1), Pin(PORT_D, 1)),
    (Pin(PORT_E, 2), Pin(PORT_D, 2)),
    (Pin(PORT_E, 4), Pin(PORT_D, 4)),
];
/// Enables the drivers, low.
pub(crate) const ENABLE: Pin = Pin(PORT_E, 8);

const STEP_TIMER: OneShot = OneShot(0x4003_0000);
pub(crate) const MAIN_LOOP: OneShot = OneShot(0x4003_2000);

/// The number of times that SysTick has wrapped around.
static ROUNDS: AtomicU32 = AtomicU32::new(0);
const LAST: u32 = 0x00FF_FFFF;

/// Starts clocks, pins, timers and UART. Called once.
pub(crate) fn start() {
    // The 8 MHz crystal, the PLL's 200 MHz divided by 4.
    RCC.write(3 << 23 | 1 << 22 | 0xE << 6);
    RCGC1.write(1 | 0b101 << 16); // UART 0, timers 0 and 2
    RCGC2.write(1 | 1 << 3 | 1 << 4); // ports A, D, E
    let _ = RCGC2.read(); // three cycles pass before a port may be touched
    SYST_RVR.write(LAST);
    SYST_CVR.write(0);
    SYST_CSR.write(0b111);

    const DIRECTION: u32 = 0x400;
    const DIGITAL: u32 = 0x51C;
    Register(PORT_E + (8 << 2)).write(8); // the drivers are off
    for (port, outputs) in [(PORT_D, 7), (PORT_E, 15)] {
        Register(port + DIRECTION).write(outputs);
        Register(port + DIGITAL).write(outputs);
    }
    Register(PORT_A + 0x420).write(3); // PA0 and PA1 belong to the UART
    Register(PORT_A + DIGITAL).write(3);
    // 115 200 baud: 50 MHz / (16 * 115 200) = 27 + 8/64; 8 bits, FIFO, both ways.
    for (offset, value) in [(0x24, 27), (0x28, 8), (0x2C, 7 << 4), (0x30, 0x301)] {
        Register(UART_0 + offset).write(value);
    }
    Register(UART_0 + 0x38).write(RECEIVED);
    STEP_TIMER.start();
    MAIN_LOOP.start();
}

/// Lets interrupts come: the step timer's above all others.
#[allow(unsafe_code)]
pub(crate) fn enable_interrupts() {
    // SAFETY: nobody else sets priorities, no critical section depends on them, and the handlers
    // have what they need.
    unsafe {
        let mut core = cortex_m::Peripherals::steal();
        core.SCB.set_priority(SystemHandler::SysTick, 1 << 5); // the upper three bits count
        core.NVIC.set_priority(Interrupt::Uart0, 2 << 5);
        core.NVIC.set_priority(Interrupt::Timer2A, 2 << 5);
        for interrupt in [Interrupt::Timer0A, Interrupt::Timer2A, Interrupt::Uart0] {
            NVIC::unmask(interrupt);
        }
    }
}

/// SysTick has wrapped around. Called by its exception.
pub(crate) fn on_round() {
    let rounds = ROUNDS.load(Ordering::Relaxed);
    ROUNDS.store(rounds.wrapping_add(1), Ordering::Relaxed);
}

/// The counts since the start. Any context.
fn count() -> u64 {
    loop {
        let rounds = ROUNDS.load(Ordering::Relaxed);
        let low = LAST - SYST_CVR.read();
        // A round whose exception is pending is not counted yet; a low count comes after it.
        let waiting = ICSR.read() & 1 << 26 != 0 && low < LAST / 2;
        if rounds == ROUNDS.load(Ordering::Relaxed) {
            return (u64::from(rounds) + u64::from(waiting)) << 24 | u64::from(low);
        }
    }
}

/// The time for the machine. Main loop.
pub(crate) fn now() -> Instant {
    Instant::from_ticks(count() / u64::from(HZ / 1_000_000))
}

/// Wakes the main loop at `instant`. Main loop.
pub(crate) fn wake_at(instant: Instant) {
    let left = instant.ticks().saturating_sub(now().ticks());
    MAIN_LOOP.ring_in((left as u32).saturating_mul(HZ / 1_000_000));
}

/// The step timer.
pub(crate) struct StepTimer;

impl Alarm for StepTimer {
    fn count(&self) -> u32 {
        count() as u32
    }
    fn ring_at(&mut self, at: u32) {
        let left = at.wrapping_sub(self.count()).cast_signed().max(1);
        STEP_TIMER.ring_in(left.cast_unsigned());
    }
    fn silence(&mut self) {
        STEP_TIMER.silence();
    }
}

/// A one-shot timer of 32 bits at the core's clock.
pub(crate) struct OneShot(u32);

impl OneShot {
    fn start(&self) {
        for (offset, value) in [(0x0C, 0), (0x00, 0), (0x04, 1), (0x18, 1)] {
            Register(self.0 + offset).write(value);
        }
    }
    /// Raises one interrupt, `counts` from now, in place of an earlier one.
    fn ring_in(&self, counts: u32) {
        self.silence();
        Register(self.0 + 0x28).write(counts.max(1));
        Register(self.0 + 0x0C).write(1);
    }
    /// Stops the timer, and clears its flag.
    pub(crate) fn silence(&self) {
        Register(self.0 + 0x0C).write(0);
        Register(self.0 + 0x24).write(1);
    }
}

/// An output: the base of its port, and its bit.
pub(crate) struct Pin(u32, u32);

impl ErrorType for Pin {
    type Error = Infallible;
}
impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        // The address says which pins of the port change.
        Register(self.0 + (self.1 << 2)).write(0);
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        Register(self.0 + (self.1 << 2)).write(self.1);
        Ok(())
    }
}

const RECEIVED: u32 = 1 << 4 | 1 << 6;
const FLAGS: Register = Register(UART_0 + 0x18);

/// The next received byte. Called by the UART's interrupt.
pub(crate) fn received() -> Option<u8> {
    Register(UART_0 + 0x44).write(RECEIVED);
    let is_empty = FLAGS.read() & 1 << 4 != 0;
    (!is_empty).then(|| Register(UART_0).read() as u8)
}

/// Returns true if the UART takes a byte to send.
pub(crate) fn has_room() -> bool {
    FLAGS.read() & 1 << 5 == 0
}

/// Sends a byte, for which there is room.
pub(crate) fn send(byte: u8) {
    Register(UART_0).write(byte.into());
}

/// A register of the chip, by its address: only constants of this file name one.
#[derive(Clone, Copy)]
struct Register(u32);

#[allow(unsafe_code)]
impl Register {
    fn read(self) -> u32 {
        // SAFETY: the constants of this file name registers of the chip, which are aligned words.
        unsafe { (self.0 as *const u32).read_volatile() }
    }
    fn write(self, value: u32) {
        // SAFETY: as in `read`. A store to these registers changes no memory of the program.
        unsafe { (self.0 as *mut u32).write_volatile(value) }
    }
}
