//! A job turned and shifted onto a board that lies askew.
//!
//! Some points of the job are found on the board by jogging to them. [`Fit::new`] finds the turn
//! and shift that brings the one onto the other, [`job()`] writes the job so.

mod fit;
mod job;

pub use fit::{Fit, Pair, Place};
pub use job::job;
