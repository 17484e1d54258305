//! The chip's timer: a 64-bit count of microseconds. Alarm 0, which compares with its low half, is
//! the step timer's.
#![allow(unsafe_code)]

use leadscrew::{Alarm, Instant};
use rp235x_hal::pac::{self, timer0::RegisterBlock};

/// The counts in a second: the timer counts its own tick, made from the crystal (RP2350 data sheet,
/// sections 8.5 and 12.8).
pub(crate) const HZ: u32 = 1_000_000;

/// The bit of alarm 0.
const ALARM: u32 = 1;

fn timer() -> &'static RegisterBlock {
    // SAFETY: the time is only read, and alarm 0 belongs to the step interrupt.
    unsafe { &*pac::TIMER0::ptr() }
}

/// Enables the alarm's interrupt. Called once.
pub(crate) fn start() {
    // SAFETY: the bit is our alarm's.
    timer().inte().write(|w| unsafe { w.bits(ALARM) });
}

/// Makes the step interrupt come at once. Called by the main loop.
pub(crate) fn pend() {
    rtic::pend(pac::Interrupt::TIMER0_IRQ_0);
}

/// The time for the machine. Called by the main loop.
pub(crate) fn now() -> Instant {
    loop {
        let high = timer().timerawh().read().bits();
        let low = timer().timerawl().read().bits();
        if high == timer().timerawh().read().bits() {
            return Instant::from_ticks(u64::from(high) << 32 | u64::from(low));
        }
    }
}

/// The step timer.
pub(crate) struct StepTimer;

impl Alarm for StepTimer {
    fn count(&self) -> u32 {
        timer().timerawl().read().bits()
    }

    fn ring_at(&mut self, at: u32) {
        self.silence();
        // SAFETY: any value is a valid instant.
        timer().alarm0().write(|w| unsafe { w.bits(at) });
        // The alarm compares for equality: an instant that has passed would match after 71 minutes.
        if self.count().wrapping_sub(at).cast_signed() >= 0 {
            pend();
        }
    }

    fn silence(&mut self) {
        // SAFETY: writing the bit disarms our alarm, and clears its flag.
        unsafe {
            timer().armed().write(|w| w.bits(ALARM));
            timer().intr().write(|w| w.bits(ALARM));
        }
    }
}
