//! The independent watchdog (RM0090 chapter 21): resets the chip, and with it all pins, when the
//! main loop hangs.
//!
//! Its clock is anything from 17 to 47 kHz (data sheet, table 34). [`RELOAD`] counts of a quarter
//! of that are
//!
//! ```text
//!   201 × 4 / 17 kHz = 47.3 ms     outputs are safe within 50 ms
//!   201 × 4 / 47 kHz = 17.1 ms     the longest turn of the main loop: 5 ms of sleep, or 2 ms of writing a setting
//! ```
use crate::registers::watchdog;
use stm32f4::stm32f407::DBGMCU;

/// Counts of the watchdog's clock divided by four.
const RELOAD: u16 = 200;
/// Counts while a sector is erased, of the clock divided by 256: 5.5 s at 47 kHz; erasing takes 0.5
/// s at most (data sheet, table 40).
const LONG_RELOAD: u16 = 1_000;

/// Whether it stands still while a debugger stops the CPU, which leaves a laser on that is lit
/// (RM0090 section 38.16.4): for who looks for faults with motors and laser unplugged, and sets
/// `LEADSCREW_DEBUG_HALT` when the firmware is built.
const STOPS_ON_HALT: bool = option_env!("LEADSCREW_DEBUG_HALT").is_some();

/// Starts it; it cannot be stopped, by a debugger that stops the CPU neither. Before the main loop.
pub(crate) fn start(debug: &DBGMCU) {
    debug
        .apb1_fz()
        .modify(|_, w| w.dbg_iwdg_stop().bit(STOPS_ON_HALT));
    watchdog().kr().write(|w| w.key().start());
    set(true, RELOAD);
}

/// Puts the reset off once more. Main loop, at least every 17 ms.
#[inline]
pub(crate) fn feed() {
    watchdog().kr().write(|w| w.key().feed());
}

/// Does something that takes up to five seconds. Main loop, with the power off; has no effect
/// before the start.
pub(crate) fn patiently<T>(work: impl FnOnce() -> T) -> T {
    set(false, LONG_RELOAD);
    let done = work();
    set(true, RELOAD);
    done
}

/// Sets the time, and begins it anew once it counts (RM0090 section 21.4.4: five periods of its
/// clock, 0.3 ms).
fn set(short: bool, reload: u16) {
    let registers = watchdog();
    registers.kr().write(|w| w.key().unlock());
    registers.pr().write(|w| match short {
        true => w.pr().divide_by4(),
        false => w.pr().divide_by256(),
    });
    registers.rlr().write(|w| w.rl().set(reload));
    let updating = |()| {
        let status = registers.sr().read();
        status.pvu().bit_is_set() || status.rvu().bit_is_set()
    };
    // Bounded: without its clock, the watchdog does nothing anyway.
    let _ = (0..200_000).any(|_| !updating(()));
    feed();
}
