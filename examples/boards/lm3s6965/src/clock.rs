//! The board's clock: one 50 MHz count for both steps and the main loop.
//!
//! SysTick counts down 24 bits, and its exception counts how often it wraps around. A step timer
//! that is started again for each tick would lose the time from its end to its next start. So a
//! tick is an instant of this count, and the step timer only raises an interrupt when that instant
//! has come.

use crate::register::Register;
use core::sync::atomic::{AtomicU32, Ordering};
use leadscrew_machine::board::Instant;

/// The counts in a second.
pub(crate) const HZ: u32 = 50_000_000;

const COUNTS_PER_US: u64 = HZ as u64 / 1_000_000;

/// Run-mode clock configuration; the clock gates of timers and UARTs; the clock gates of ports.
const RCC: Register = Register::at(0x400F_E000, 0x060);
const RCGC1: Register = Register::at(0x400F_E000, 0x104);
const RCGC2: Register = Register::at(0x400F_E000, 0x108);

/// SysTick and the interrupt control word of the core (Armv7-M).
const SYST_CSR: Register = Register::at(0xE000_E010, 0x0);
const SYST_RVR: Register = Register::at(0xE000_E010, 0x4);
const SYST_CVR: Register = Register::at(0xE000_E010, 0x8);
const ICSR: Register = Register::at(0xE000_ED04, 0);

const LAST: u32 = 0x00FF_FFFF;
const PENDSTSET: u32 = 1 << 26;

/// How often SysTick has wrapped around.
static ROUNDS: AtomicU32 = AtomicU32::new(0);

/// The timer that wakes the main loop.
pub(crate) const MAIN_LOOP: Alarm = Alarm(0x4003_2000);

/// Starts PLL, peripheral clocks and the count.
pub(crate) fn start() {
    // The 8 MHz crystal, the PLL's 200 MHz divided by 4 (data sheet, run-mode clock configuration).
    const SYSDIV_4: u32 = 3 << 23;
    const USESYSDIV: u32 = 1 << 22;
    const XTAL_8_MHZ: u32 = 0xE << 6;
    RCC.write(SYSDIV_4 | USESYSDIV | XTAL_8_MHZ);
    const UART_0: u32 = 1;
    const TIMERS_0_TO_2: u32 = 0b111 << 16;
    RCGC1.write(UART_0 | TIMERS_0_TO_2);
    const PORTS_A_D_E: u32 = 1 | 1 << 3 | 1 << 4;
    RCGC2.write(PORTS_A_D_E);
    let _ = RCGC2.read(); // three cycles pass before a port may be touched

    const ENABLE_WITH_EXCEPTION_AT_CORE_CLOCK: u32 = 0b111;
    SYST_RVR.write(LAST);
    SYST_CVR.write(0);
    SYST_CSR.write(ENABLE_WITH_EXCEPTION_AT_CORE_CLOCK);
}

/// SysTick has wrapped around. Called by its exception.
pub(crate) fn on_round() {
    let rounds = ROUNDS.load(Ordering::Relaxed);
    ROUNDS.store(rounds.wrapping_add(1), Ordering::Relaxed);
}

/// The counts since the start. Any context may call this.
pub(crate) fn count() -> u64 {
    loop {
        let rounds = ROUNDS.load(Ordering::Relaxed);
        let low = LAST - SYST_CVR.read();
        // If the exception is pending, its round is not counted yet, and a low count comes after
        // it.
        let waiting = ICSR.read() & PENDSTSET != 0 && low < LAST / 2;
        if rounds == ROUNDS.load(Ordering::Relaxed) {
            return (u64::from(rounds) + u64::from(waiting)) << 24 | u64::from(low);
        }
    }
}

/// The time for the machine. Called by the main loop.
pub(crate) fn now() -> Instant {
    Instant::from_ticks(count() / COUNTS_PER_US)
}

/// Wakes the main loop at `instant`, or at once where that has passed. Called by the main loop.
pub(crate) fn wake_at(instant: Instant) {
    let left = (instant.ticks() * COUNTS_PER_US).saturating_sub(count());
    MAIN_LOOP.ring_in(left);
}

/// A one-shot timer of the chip, 32 bits wide, at the core's clock.
pub(crate) struct Alarm(pub(crate) u32);

impl Alarm {
    /// Sets the timer up without starting it. Called once.
    pub(crate) fn start(&self) {
        const ONE_SHOT: u32 = 1;
        const TIME_OUT: u32 = 1;
        self.register(0x0C).write(0); // CTL
        self.register(0x00).write(0); // CFG: 32 bits
        self.register(0x04).write(ONE_SHOT); // TAMR
        self.register(0x18).write(TIME_OUT); // IMR
    }

    /// Raises one interrupt, `counts` from now, in place of an earlier setting.
    pub(crate) fn ring_in(&self, counts: u64) {
        self.register(0x0C).write(0);
        let counts = u32::try_from(counts).unwrap_or(u32::MAX).max(1);
        self.register(0x28).write(counts); // TAILR
        self.register(0x0C).write(1);
    }

    /// Stops the timer.
    pub(crate) fn silence(&self) {
        self.register(0x0C).write(0);
    }

    /// Clears the interrupt that is being handled.
    pub(crate) fn acknowledge(&self) {
        self.register(0x24).write(1); // ICR
    }

    const fn register(&self, offset: u32) -> Register {
        Register::at(self.0, offset)
    }
}
