//! The tool: spindle or laser, and the coolant.
//!
//! | file | it says |
//! |---|---|
//! | [`beam`] | when a laser is lit |
//! | `scale` | which power an `S` is |
//! | [`spindle`] | which output is wanted of spindle or laser |
//! | [`coolant`] | which valves are open |
//! | `dead_man` | how long a laser stays lit without its sender |
//! | `output` | which direction and power go out at rest |

pub mod beam;
pub mod coolant;
pub mod spindle;

pub(crate) mod dead_man;
mod output;
mod scale;

use crate::board::SpindleOutput;
use crate::interpreter;
use coolant::Coolant;
use dead_man::DeadMan;
use leadscrew_stepper::Power;
use spindle::{Spindle, SpindleScale};

/// Spindle or laser, and coolant: the wishes of program and operator, and the outputs as they are.
pub(crate) struct Tool {
    pub(crate) spindle: Spindle,
    pub(crate) coolant: Coolant,
    /// The dead-man of a laser that is lit at rest.
    pub(crate) dead_man: DeadMan,
    /// The program's last command to the spindle.
    pub(crate) told: interpreter::Spindle,
    /// The power that was put out in this rest; `None` in motion, and where it has to be put out
    /// anew.
    rest_power: Option<Power>,
    /// The direction that was put out in this rest; `None` as for the power.
    rest_output: Option<SpindleOutput>,
}

impl Tool {
    /// Makes a tool that is off. `laser`: whether a laser stands in the spindle's place.
    pub(crate) fn new(scale: SpindleScale, laser: bool) -> Self {
        Self {
            spindle: Spindle::new(scale, laser),
            coolant: Coolant::default(),
            dead_man: DeadMan::Dark,
            told: interpreter::Spindle::default(),
            rest_power: None,
            rest_output: None,
        }
    }

    /// Motion begins, and brings its own power: in the next rest, direction and power are put out
    /// anew.
    pub(crate) fn leave_rest(&mut self) {
        self.rest_power = None;
        self.rest_output = None;
    }
}
