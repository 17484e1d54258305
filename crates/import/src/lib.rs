//! Converts job files of other machines to G-code, and helps to set a machine up.
//!
//! ```text
//! Excellon files -> excellon::Drawing -> drill::Board -> order -> drill::job -> lines
//! RP code, engraver rows, printer G-code -> rp, rows, print               -> lines
//! a G-code job and pairs of points       -> align                        -> lines
//! a G-code job and a map of heights      -> level                        -> lines
//! ```
//!
//! Coordinates are exact decimals ([`Mm`]), from the file's digits to the job's. Text that a reader
//! does not understand is a [`Fault`] with line and column: no hole, row or move is ever left out
//! silently. A reader goes on after a fault, so that a person sees all faults. A job is made only
//! from a file without faults.
#![forbid(unsafe_code)]

pub mod align;
pub mod calibrate;
mod decimal;
pub mod drill;
pub mod excellon;
mod fault;
mod gcode_text;
pub mod level;
mod mm;
mod point;
pub mod print;
pub mod rows;
pub mod rp;

pub use fault::{Fault, Faults};
pub use mm::Mm;
pub use point::Point;

/// A job: its lines without line ends, and notes for its user.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Job {
    /// Lines of G-code.
    pub lines: Vec<String>,
    /// Sentences for the user about assumptions, and about what was clipped or left out.
    pub notes: Vec<String>,
}

/// The examples of the package's README, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
