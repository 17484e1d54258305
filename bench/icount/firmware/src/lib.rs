//! Markers around the counted code, and the end of a program. A program is a file in `src/bin` that
//! measures one layer.
//!
//! The counted code is in a function that is never inlined, and its inputs go through `black_box`.
//! So the compiler cannot fit the code to the measurement.
#![no_std]

pub mod session;
pub mod spiral;

use core::{arch::asm, panic::PanicInfo};
use cortex_m_semihosting::{debug, hprintln};

/// Opens a region, 0 to 7: the code from here to [`close`] is one sample.
#[inline(always)]
pub fn open<const REGION: u8>() {
    // SAFETY: `dbg` is a hint without effect. The compiler must assume that it touches memory, so
    // that it moves nothing across it.
    unsafe { asm!("dbg #{}", const REGION) }
}

/// Closes the region.
#[inline(always)]
pub fn close<const REGION: u8>() {
    // SAFETY: as in `open`.
    unsafe { asm!("dbg #{}", const REGION + 8) }
}

/// Counts one call of `work` in a region. `work` must be a function that is never inlined.
#[inline(always)]
pub fn count<const REGION: u8, T>(work: impl FnOnce() -> T) -> T {
    open::<REGION>();
    let result = work();
    close::<REGION>();
    result
}

/// Ends the program: the measurement is complete.
pub fn done() -> ! {
    debug::exit(debug::EXIT_SUCCESS);
    loop {}
}

/// A panic makes the measurement void: prints the place, and ends the program with a failure.
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    hprintln!("{}", info);
    debug::exit(debug::EXIT_FAILURE);
    loop {}
}
