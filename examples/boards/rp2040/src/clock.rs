//! The chip's timer: 64 bits of microseconds, four alarms that match its low half.
#![allow(unsafe_code)]

use leadscrew_machine::board::Instant;
use rp2040_hal::pac;

/// Counts a second: the watchdog's tick, of the crystal (RP2040 data sheet, section 4.6).
pub(crate) const HZ: u32 = 1_000_000;

/// The timer's registers.
pub(crate) fn timer() -> &'static pac::timer::RegisterBlock {
    // SAFETY: the time is only read; alarm 0 is the tick's, alarm 1 the pulse's, and both
    // interrupts have one priority.
    unsafe { &*pac::TIMER::ptr() }
}

/// The low half of the time. Any context.
pub(crate) fn count() -> u32 {
    timer().timerawl().read().bits()
}

/// The time for the machine. Main loop.
pub(crate) fn now() -> Instant {
    loop {
        let high = timer().timerawh().read().bits();
        let low = count();
        if high == timer().timerawh().read().bits() {
            return Instant::from_ticks(u64::from(high) << 32 | u64::from(low));
        }
    }
}
