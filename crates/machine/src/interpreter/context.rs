//! What a line's meaning depends on besides the lines before it, and what is wrong with it.

use super::Coordinate;
use crate::config::{AxisKind, Options};
use crate::protocol::status::Status;
use core::fmt;

/// The settings and build options that decide what a line means.
#[derive(Debug, Clone, Copy)]
pub struct Context<'a, const AXES: usize> {
    /// Linear axes take inches in G20, rotary ones never.
    pub axes: &'a [AxisKind; AXES],
    /// M7 and M56 are refused where the machine is built without them.
    pub options: &'a Options,
    /// `$32`: spindle words are laser words.
    pub laser_mode: bool,
    /// The farthest machine coordinate to either side, by axis: what steps can count. Half the range of `i32` divided
    /// by the steps per mm keeps every move countable, too. At most [`MAX_WORD`](super::MAX_WORD).
    pub reach: &'a [Coordinate; AXES],
}

/// Why a line was refused, and where it went wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fault {
    /// The answer to the line.
    pub status: Status,
    /// Byte offset in the filtered line, from 0; its length where something is missing at the end.
    pub column: usize,
}

impl fmt::Display for Fault {
    /// Counts the column from 1, as people and editors do.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "column {}: {}", self.column + 1, self.status)
    }
}

impl core::error::Error for Fault {}
