//! GRBL 1.1h on the wire: bytes to lines and commands, answers to text. No machine inside.
//!
//! ```text
//!   serial interrupt -> serial -> realtime             ?, !, ~, 0x18, overrides
//!                              -> line_reader -> system_command    $ commands
//!                                             -> the interpreter   G-code
//!   report, message, alarm, status -> serial::Output -> the serial line
//! ```
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod alarm;
pub mod cadence;
pub mod decimal;
pub mod line_reader;
pub mod message;
pub mod realtime;
pub mod report;
pub mod serial;
pub mod system_command;

pub use leadscrew_interpreter::status;

/// The examples of the package's README, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
