//! A leadscrew machine on a desk: the same main loop and the same step interrupt as on the board,
//! on a clock that counts the cycles of its CPU.
//!
//! ```text
//!   Host ====serial line====> Machine ---segments---> step interrupt ---pins---> Plant
//!  (Streamer, a test)  <====    |  ^                    ^ |                      |
//!                               |  +---- switches ------|-|----------------------+
//!                               +------- SimBoard ------+ +--> Observer
//! ```
//!
//! [`Simulation`] always handles the event that is due next ([`event_loop`]), charges the CPU for
//! it ([`cost`], [`load`]) and so finds late events. Nothing depends on the computer that runs the
//! simulation: the same input gives the same bits.
//!
//! The simulation always checks some rules, and collects each [`trouble::Violation`]: the carriages
//! stand where the machine counts them, no pulse is short, and no direction pin changes during a
//! pulse or too soon before one.
#![forbid(unsafe_code)]

pub mod board;
pub mod clock;
pub mod contacts;
pub mod cost;
pub mod event_loop;
pub mod fixtures;
pub mod flash;
pub mod link;
pub mod load;
pub mod measured;
pub mod observer;
pub mod outcome;
pub mod output_pins;
pub mod oven;
pub mod own;
pub mod plant;
mod position;
pub mod powered;
pub mod program;
pub mod replay;
pub mod scene;
pub mod setup;
pub mod speed_profile;
mod stepping;
pub mod streamer;
pub mod tool_pins;
pub mod trouble;

pub use clock::Cycle;
pub use contacts::Contacts;
pub use event_loop::{Simulation, Stopped};
pub use fixtures::Fixtures;
pub use link::{Host, Rate};
pub use observer::{Observer, StepEvent};
pub use outcome::{Answers, Outcome};
pub use output_pins::OutputPins;
pub use powered::PowerUp;
pub use setup::{Memory, Setup};
pub use streamer::{Replies, Reply, Streamer, Streaming};

/// Machine files: a simulated machine is made from one.
pub use leadscrew_machine_file as profile;

/// The examples of the package's README, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
