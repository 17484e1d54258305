//! The chip's timer: a 64-bit count of microseconds, and four alarms that compare with its low
//! half.
#![allow(unsafe_code)]

use leadscrew_machine::board::Instant;
use rp2040_hal::pac;

/// The counts in a second: the timer counts the watchdog's tick, made from the crystal (RP2040 data
/// sheet, section 4.6).
pub(crate) const HZ: u32 = 1_000_000;

/// The timer's registers.
pub(crate) fn timer() -> &'static pac::timer::RegisterBlock {
    // SAFETY: the time is only read. Alarm 0 belongs to the tick and alarm 1 to the pulse, and both
    // interrupts have the same priority.
    unsafe { &*pac::TIMER::ptr() }
}

/// The low half of the time. Any context may call this.
pub(crate) fn count() -> u32 {
    timer().timerawl().read().bits()
}

/// The time for the machine. Called by the main loop.
pub(crate) fn now() -> Instant {
    loop {
        let high = timer().timerawh().read().bits();
        let low = count();
        if high == timer().timerawh().read().bits() {
            return Instant::from_ticks(u64::from(high) << 32 | u64::from(low));
        }
    }
}
