//! Excellon files list the holes of a circuit board and their tools.
//!
//! ```text
//! M48            a header begins
//! METRIC,TZ      unit; which zeros numbers keep (`LZ` leading, `TZ` trailing); digits, as in `METRIC,LZ,000.000`
//! T1C0.8         tool 1 has a diameter of 0.8 mm
//! %              the header ends
//! T1             take tool 1
//! X12700Y5080    a hole at X12.7 Y5.08
//! R3X2540        3 more, each 2.54 mm to the right of the last
//! X0Y0G85X2000Y0 a slot
//! G00X0Y0 M15 G01X5000Y0 M16 G05   a routed path, a statement a line
//! M30            end
//! ```
//!
//! There is no standard that all programs follow. This module reads the files of KiCad, Eagle,
//! Altium, Allegro, Mentor and FlatCAM, and files without a header as older programs wrote them.
//! `docs/import.md` lists how each statement is read.

mod bend;
mod comment;
mod evidence;
mod fact;
mod format;
mod header;
mod program;
mod reader;
mod route;
mod shape;
mod tool;
mod tool_statement;
mod word;
mod wrong;

pub use format::{Digits, Known, Units, Zeros};
pub use shape::{Arc, Centre, Cut, Route, Shape};
pub use tool::Tool;
pub(crate) use tool::MOST_OF_MACHINES;

use crate::Faults;
use reader::Reader;
use std::collections::BTreeMap;

/// The contents of a file: tools, and their shapes in the order of the file.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Drawing {
    /// Tools by their numbers.
    pub tools: BTreeMap<u32, Tool>,
    /// Holes, slots and routes. A repeat (`R5`) is stored as single holes.
    pub hits: Vec<Hit>,
    /// Assumptions that were made, and statements that were ignored.
    pub notes: Vec<String>,
}

/// A shape and the tool that makes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Hit {
    /// The tool's number.
    pub tool: u32,
    /// The line of the file on which it ends, from 1.
    pub line: u32,
    /// The shape.
    pub shape: Shape,
}

/// Reads a file; `known` fills in the facts that it does not state itself.
///
/// # Errors
/// All lines that were not understood.
pub fn read(text: &str, known: &Known) -> Result<Drawing, Faults> {
    let (drawing, faults) = read_all(text, known);
    if faults.0.is_empty() {
        Ok(drawing)
    } else {
        Err(faults)
    }
}

/// Reads a file; returns the drawing and its faults. Each line is either understood completely or
/// is a fault.
pub fn read_all(text: &str, known: &Known) -> (Drawing, Faults) {
    let mut reader = Reader::new(known, evidence::zeros(text), evidence::unit(text));
    for (index, line) in text.lines().enumerate() {
        reader.line(index + 1, line);
    }
    reader.finish()
}
