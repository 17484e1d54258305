//! Coolant valves: set by the program (M7, M8, M9), toggled by the operator (0xA0, 0xA1), closed by
//! the door.

use crate::board::{Board, CoolantOutput};

/// The wanted state of the valves, and whether they are kept shut for now.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Coolant {
    wanted: CoolantOutput,
    /// Shut while the door is open, whatever is wanted.
    suspended: bool,
}

impl Coolant {
    /// Sets the wanted state, and the valves unless they are kept shut. Main loop.
    pub fn set<B: Board>(&mut self, wanted: CoolantOutput, board: &mut B) {
        self.wanted = wanted;
        board.set_coolant(self.output());
    }

    /// Shuts the valves until [`Coolant::restore`]; the wanted state is kept. Main loop.
    pub fn suspend<B: Board>(&mut self, board: &mut B) {
        self.suspended = true;
        board.set_coolant(self.output());
    }

    /// Opens the valves that are wanted again. Main loop.
    pub fn restore<B: Board>(&mut self, board: &mut B) {
        self.suspended = false;
        board.set_coolant(self.output());
    }

    /// Returns the last request of the program or the operator.
    pub fn wanted(&self) -> CoolantOutput {
        self.wanted
    }

    /// Returns true if any valve is meant to be open.
    pub fn is_wanted(&self) -> bool {
        self.wanted != CoolantOutput::default()
    }

    /// Returns the valves as they are.
    pub fn output(&self) -> CoolantOutput {
        if self.suspended {
            CoolantOutput::default()
        } else {
            self.wanted
        }
    }
}
