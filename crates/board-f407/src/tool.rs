//! The switches at the ends of a tool's travel, for the extension `leadscrew_ztool`.
use crate::gpio::Input;
use leadscrew_ztool::{End, ToolPort};

/// The two inputs.
pub(crate) struct ToolPins {
    lower: Input,
    upper: Input,
}

impl ToolPins {
    /// Makes inputs of the pins. Before the interrupts are on.
    pub(crate) fn new(lower: Input, upper: Input) -> Self {
        lower.pin.make_input(lower.pull);
        upper.pin.make_input(upper.pull);
        Self { lower, upper }
    }
}

impl ToolPort for ToolPins {
    fn is_closed(&self, end: End) -> bool {
        let switch = match end {
            End::Lower => self.lower,
            End::Upper => self.upper,
        };
        !switch.level()
    }
}
