//! GRBL 1.1h as a state machine that never waits: bytes in, segments and pins out.
//!
//! A [`board`] lends its slow pins and its serial lines; switch interrupts report to [`inputs`]; what a
//! machine is built with stands in [`config`].
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod board;
pub mod config;
pub mod inputs;
pub mod interpreter;
pub mod machine;
pub mod protocol;
pub mod state;
pub mod work;
pub mod settings;
