//! How the main loop sleeps, and who wakes it.
//!
//! Whoever has something for the main loop says so with [`wake`]. No wake-up is lost: every return
//! from an interrupt sets the core's event register, so that WFE does not sleep where one came
//! after the look at the flag (DDI 0403 section B1.5.18). The step interrupt wakes the core as
//! well, but the main loop goes on sleeping unless it took a segment.
use core::sync::atomic::{compiler_fence, AtomicBool, Ordering};

static AWAKE: AtomicBool = AtomicBool::new(true);

/// Makes the main loop run once more. Any context: they run on one core, where only the compiler
/// could change the order.
#[inline]
pub(crate) fn wake() {
    compiler_fence(Ordering::Release);
    AWAKE.store(true, Ordering::Relaxed);
}

/// Sleeps until somebody wakes the main loop, or not at all where somebody has since this returned
/// last. Main loop.
pub(crate) fn sleep() {
    while !AWAKE.swap(false, Ordering::Acquire) {
        cortex_m::asm::wfe();
    }
}
