//! The words that a line leaves to the next cycle.

use super::kind::CycleKind;
use crate::modal_state::{Distance, Plane};
use leadscrew_gcode::Number;
use leadscrew_planner::Coordinate;

/// A cycle's line as the next line of its series sees it: these words need not be repeated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Series {
    pub(crate) kind: CycleKind,
    pub(crate) plane: Plane,
    /// G90 or G91. The words count from different places in these modes, so they are kept only for
    /// lines of the same mode.
    pub(crate) distance: Distance,
    /// The place of the tool's axis before the series, machine coordinates: the level of G98.
    pub(crate) initial: Coordinate,
    /// The R word, mm.
    pub(crate) r: Coordinate,
    /// The word of the tool's axis, mm.
    pub(crate) depth: Coordinate,
    /// The P word, s, or the Q word, mm.
    pub(crate) value: Number,
}
