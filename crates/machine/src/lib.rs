//! GRBL 1.1h as a state machine that never waits: bytes in, segments and pins out.
//!
//! A [`board`] lends its slow pins and its serial lines; switch interrupts report to [`inputs`].
//! The machine's build is in [`config`]; a firmware adds to it by an [`extension`].
//!
//! Many functions say where they are called. "Main loop.": from the main loop only. "At rest.": no
//! motor steps and none is about to. A *turn* is one call of [`machine::Machine::poll`].
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

mod activity;
mod apply;
pub mod board;
pub mod config;
mod console;
mod derived;
mod dual;
mod ends;
mod events;
pub mod explain;
mod explanation;
pub mod extension;
pub mod guard;
mod hard_limits;
pub mod home;
pub mod inputs;
mod lines;
mod listing;
pub mod machine;
mod memory;
mod motion;
pub mod overrides;
mod program;
mod reset;
mod rules;
mod segment_queue;
mod sender;
mod snapshot;
pub mod soft_limits;
pub mod state;
pub mod step_rate;
pub mod step_timing;
mod store;
mod switches;
mod system;
pub mod tool;
mod unsaved;
pub mod valid;
pub mod work;

pub use leadscrew_interpreter as interpreter;
pub use leadscrew_protocol as protocol;
pub use leadscrew_settings as settings;

/// The examples of the package's README, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
