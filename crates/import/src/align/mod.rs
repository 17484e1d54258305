//! Turns and shifts a job onto a board that is not clamped straight.
//!
//! The user finds some points of the job on the board by jogging to them. [`Fit::new`] finds the
//! turn and shift that brings the job's points onto the found ones. [`job()`] writes the job with
//! this turn and shift.

mod fit;
mod job;

pub use fit::{Fit, Pair, Place};
pub use job::job;
