//! Two switches at the ends of a tool's way, as an extension reads them.

use leadscrew_ztool::{End, ToolPort};
use std::cell::Cell;
use std::rc::Rc;

/// Where the carriage of Z stands, in steps. A clone is the same carriage.
#[derive(Clone, Debug, Default)]
pub struct ToolHeight(Rc<Cell<i32>>);

impl ToolHeight {
    /// The carriage is here, as the main loop finds it.
    pub(crate) fn set(&self, steps: i32) {
        self.0.set(steps);
    }
}

/// The switches of a tool, closed at their places and beyond.
#[derive(Clone, Debug)]
pub struct ToolSwitches {
    /// The carriage that works them.
    pub z: ToolHeight,
    /// Steps.
    pub lower: i32,
    /// Steps, above the lower one.
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
