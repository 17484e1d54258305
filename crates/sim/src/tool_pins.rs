//! Two switches at the ends of a tool's travel, as an extension reads them.

use leadscrew_ztool::{End, ToolPort};
use std::cell::Cell;
use std::rc::Rc;

/// The place of Z's carriage, in steps. A clone refers to the same carriage.
#[derive(Clone, Debug, Default)]
pub struct ToolHeight(Rc<Cell<i32>>);

impl ToolHeight {
    /// Sets the carriage's height; the main loop's next turn sees it.
    pub(crate) fn set(&self, steps: i32) {
        self.0.set(steps);
    }
}

/// The switches of a tool. The lower one is closed at its place and below, the upper one at its
/// place and above.
#[derive(Clone, Debug)]
pub struct ToolSwitches {
    /// The carriage that works them.
    pub z: ToolHeight,
    /// Place of the lower switch, steps.
    pub lower: i32,
    /// Place of the upper switch, steps; above the lower one.
    pub upper: i32,
}

impl ToolPort for ToolSwitches {
    fn is_closed(&self, end: End) -> bool {
        let z = self.z.0.get();
        match end {
            End::Lower => z <= self.lower,
            End::Upper => z >= self.upper,
        }
    }
}
