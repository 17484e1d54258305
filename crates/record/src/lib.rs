#![no_std]
#![forbid(unsafe_code)]
#![doc = include_str!("../README.md")]

mod layout;
mod lines;
mod pin;
mod place;
mod read;
mod safe;

pub use layout::{
    Content, Head, Image, Motor, Outputs, Power, Record, Serial, Setting, Shape, ENABLES, MAGIC,
    MOTORS, NAME, OLDEST, SAFE, SETTINGS, VERSION,
};
pub use lines::{Incoming, WrongLine, LONGEST, PART};
pub use pin::PinCode;
pub use place::{sector, slot, PROGRAM, SLOT, SLOTS};
pub use read::{checksum, Refusal, FIXED, UNPROTECTED};
pub use safe::{SafePort, SafeTable, PORTS};
