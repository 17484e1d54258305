//! The independent watchdog (RM0090 chapter 21): resets the chip, and with it all pins, when the
//! main loop hangs.
//!
//! Its clock of 17 to 47 kHz (data sheet, table 34) is divided by 4. The reset comes after
//! [`RELOAD`] + 1 counts:
//!
//! ```text
//!   201 × 4 / 17 kHz = 47.3 ms     outputs are safe within 50 ms
//!   201 × 4 / 47 kHz = 17.1 ms     longer than any turn of the main loop: it sleeps for 5 ms at
//!                                  most, and writes a setting in 2 ms
//! ```
use crate::registers::watchdog;
use stm32f4::stm32f407::DBGMCU;

/// Counts of the watchdog's clock divided by four.
const RELOAD: u16 = 200;
/// Counts while a sector is erased, of the clock divided by 256: 5.5 s at 47 kHz. Erasing a small
/// sector takes 0.5 s at most (data sheet, table 40).
const LONG_RELOAD: u16 = 1_000;

/// True if the watchdog stands still while a debugger halts the CPU (RM0090 section 38.16.4). Then
/// a laser that is lit stays lit. This is for debugging with motors and laser unplugged: set
/// `LEADSCREW_DEBUG_HALT` when the firmware is built.
const STOPS_ON_HALT: bool = option_env!("LEADSCREW_DEBUG_HALT").is_some();

/// Starts the watchdog. Nothing stops it, not even a debugger that halts the CPU, unless
/// [`STOPS_ON_HALT`]. Before the main loop.
pub(crate) fn start(debug: &DBGMCU) {
    debug
        .apb1_fz()
        .modify(|_, w| w.dbg_iwdg_stop().bit(STOPS_ON_HALT));
    watchdog().kr().write(|w| w.key().start());
    set(true, RELOAD);
}

/// Begins the watchdog's time anew, so that no reset comes. Main loop, at least every 17 ms.
#[inline]
pub(crate) fn feed() {
    watchdog().kr().write(|w| w.key().feed());
}

/// Does `work`, which may take up to five seconds. Main loop, with the power off. Before [`start`]
/// the watchdog does not count anyway.
pub(crate) fn patiently<T>(work: impl FnOnce() -> T) -> T {
    set(false, LONG_RELOAD);
    let done = work();
    set(true, RELOAD);
    done
}

/// Sets the watchdog's time, waits until the new time is in effect (RM0090 section 21.4.4: five
/// periods of its clock, 0.3 ms), and begins it anew.
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
