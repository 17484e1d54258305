//! Lines of G-code to canonical commands.
//!
//! ```text
//!  line --words--> Block --check--> Plan --commit--> Commands
//!
//!    words:   finds errors 1, 2, 4, 20, 21, 23…25, 38
//!    check:   finds errors 20, 22, 23, 26…38, 52, 200…204, and errors of extensions
//!    commit:  cannot fail; changes modal state, offsets and position
//! ```
//!
//! Read first: Kramer, Proctor, Messina, "The NIST RS274/NGC Interpreter, Version 3" (NISTIR 6556).
//! GRBL 1.1h decides which of its words exist, and which fault of a line is reported.
//!
//! Everything is checked before anything changes: a line is carried out wholly or not at all. The
//! first fault from the left is reported while words are read, then the first in the order of
//! [`check`].
//!
//! ```
//! use leadscrew_interpreter::{
//!     ArcMismatch, AxisKind, Commands, Context, Dialect, Interpreter, OwnCodes, ToolTable, MAX_WORD,
//! };
//!
//! let context = Context {
//!     axes: &[AxisKind::Linear; 3],
//!     dialect: &Dialect::GRBL,
//!     laser_mode: false,
//!     soft_limits: false,
//!     reach: &[MAX_WORD; 3],
//!     arcs: ArcMismatch::GRBL,
//!     own: OwnCodes::NONE,
//!     tools: ToolTable::NONE,
//! };
//! let mut interpreter = Interpreter::<3>::new();
//! let mut commands = Commands::new();
//! interpreter.interpret(b"G20G1X1F10", &context, &mut commands)?;
//! assert_eq!(commands[0].to_string(), "FEED X25.4 Y0 Z0 F254");
//!
//! let fault = interpreter.interpret(b"G2X1", &context, &mut commands).unwrap_err();
//! assert_eq!((fault.status.number(), fault.column), (35, 2));
//! # Ok::<(), leadscrew_interpreter::Fault>(())
//! ```
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

mod arc;
pub mod axes;
mod check;
mod code;
mod codes;
mod command;
mod context;
mod cycle;
mod decimals;
mod extruder;
mod fault;
mod interpreter;
mod jog;
mod modal_state;
mod offsets;
pub mod own;
mod print;
mod setup;
pub mod status;
mod takers;
mod units;
mod words;

pub use arc::ArcMismatch;
pub use axes::AxisKind;
pub use command::{
    ArcShape, Command, Commands, Feed, Jog, OffsetId, Spindle, Travel, MAX_COMMANDS,
};
pub use context::{Context, Dialect, Own, OwnCodes, ToolTable};
pub use cycle::{Cycle, CycleKind, Strokes};
pub use fault::Fault;
pub use interpreter::Extent;
pub use leadscrew_planner::Coordinate;
pub use modal_state::{
    Coolant, Distance, FeedMode, ModalState, Motion, OverrideControl, Plane, ProbeKind, Retract,
    Rotation, Turn, Units, WorkSystem,
};
pub use offsets::Offsets;
pub use setup::Interpreter;
pub use status::Status;
pub use units::MAX_WORD;

/// The examples of the package's README, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

#[cfg(test)]
mod tests;
