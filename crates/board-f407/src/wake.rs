//! How the main loop sleeps, and who wakes it.
//!
//! Code that has something for the main loop calls [`wake`]. No wake-up is lost: every return from
//! an interrupt sets the core's event register, so that WFE does not sleep if an interrupt came
//! after the look at the flag (DDI 0403 section B1.5.18). The step interrupt wakes the core as
//! well, but the main loop goes on sleeping unless that interrupt has called [`wake`].
use core::sync::atomic::{compiler_fence, AtomicBool, Ordering};

static AWAKE: AtomicBool = AtomicBool::new(true);

/// Makes the main loop run once more. Any context: they run on one core, where only the compiler
/// could change the order.
#[inline]
pub(crate) fn wake() {
    compiler_fence(Ordering::Release);
    AWAKE.store(true, Ordering::Relaxed);
}

/// Sleeps until [`wake`] is called. Returns at once if it has been called since this returned last.
/// Main loop.
pub(crate) fn sleep() {
    while !AWAKE.swap(false, Ordering::Acquire) {
        cortex_m::asm::wfe();
    }
}
