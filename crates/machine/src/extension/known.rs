//! The values that a calculated line may read of the machine.

use crate::config::AxisKind;
use crate::interpreter::Interpreter;
use leadscrew_planner::Coordinate;

/// The machine as it is behind the lines that were taken: what a line that is calculated may read.
#[derive(Clone, Copy, Debug)]
pub struct Known<'a, const AXES: usize> {
    /// Modes, offsets, and the end of the last motion.
    pub interpreter: &'a Interpreter<AXES>,
    /// The kinds of the axes.
    pub axes: &'a [AxisKind; AXES],
    /// The end of the last probing motion, machine position; `None` if there was none.
    pub probed: Option<[Coordinate; AXES]>,
    /// True if it made contact.
    pub contact: bool,
    /// The tool in the spindle, if it is known.
    pub tool: Option<u32>,
}
