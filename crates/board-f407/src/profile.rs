//! The pins of a board: compiled in, or read from its record. And the values that all boards share.
//!
//! | image | pins | module |
//! |---|---|---|
//! | `cargo fw` | compiled in, from the board's file (`crates/boards`) | `wired` |
//! | `cargo fw --record` | in the board's record in flash (`crates/record`) | `recorded` |
//!
//! The firmware asks both modules for the same items, such as `usart` and `enables`.
use crate::{
    chip::Bank,
    gpio::{Pin, Pull, Speed},
};

#[cfg(record)]
mod recorded;
#[cfg(not(record))]
mod wired;

#[cfg(record)]
pub(crate) use recorded::*;
#[cfg(not(record))]
pub(crate) use wired::*;

/// Moves planned ahead. The self-test has short jobs, and uses the memory for captured edges.
pub(crate) const MOVES: usize = if cfg!(captures) { 256 } else { 1024 };

/// Hands PA11 and PA12 to the USB controller: they are the same on every board, and no profile
/// names them.
pub(crate) fn give_usb_its_pins() {
    for number in [11, 12] {
        // The controller's number in the data sheet's table 9.
        let pin = Pin::new(Bank::A, number);
        pin.make_alternate(10, Pull::None);
        pin.set_speed(Speed::VeryHigh);
    }
}

/// The serial line's rate in bits a second: 115200, or the value of `LEADSCREW_BAUD` at build time.
pub(crate) const BAUD: u32 = match number(option_env!("LEADSCREW_BAUD")) {
    Some(baud) => baud,
    None => 115_200,
};

/// The number that a variable of the build holds, if it is there.
const fn number(text: Option<&str>) -> Option<u32> {
    match text {
        Some(text) => match u32::from_str_radix(text, 10) {
            Ok(number) => Some(number),
            Err(_) => panic!("a variable of the build is no number"),
        },
        None => None,
    }
}
