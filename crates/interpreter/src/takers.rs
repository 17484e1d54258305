//! Commands that take the words of a line.

use super::command::OffsetId;
use crate::Status;

/// The command that takes the axis words of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AxisCommand {
    /// The line has no axis words, and no command that takes any.
    None,
    /// The motion mode.
    Motion,
    /// The non-modal command.
    NonModal,
    /// G43.1.
    SetToolLength,
    /// G49, which ignores axis words that are nobody else's.
    CancelToolLength,
}

impl AxisCommand {
    /// The command that takes the axis words of a line that has both.
    ///
    /// # Errors
    /// [`Status::AxisWordConflict`] if both take them.
    pub(super) const fn and(self, next: Self) -> Result<Self, Status> {
        match (self, next) {
            (Self::None, command)
            | (Self::CancelToolLength, command @ (Self::Motion | Self::NonModal))
            | (command @ (Self::Motion | Self::NonModal), Self::CancelToolLength) => Ok(command),
            _ => Err(Status::AxisWordConflict),
        }
    }
}

/// The change of the tool length by a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ToolLength {
    /// There is none.
    Keep,
    /// G43: the length of a tool in the table.
    FromTable,
    /// G43.1: the Z word.
    FromWord,
    /// G49.
    Cancel,
}

/// A command that leaves no mode behind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NonModal {
    /// The line has none.
    None,
    /// G4.
    Dwell,
    /// G10.
    SetOrigin,
    /// G28, G30.
    GoTo(OffsetId),
    /// G28.1, G30.1.
    Store(OffsetId),
    /// G53.
    MachineCoordinates,
    /// G92.
    SetG92,
    /// G52: the offset of G92, as the words have it.
    LocalOrigin,
    /// G92.1.
    ClearG92,
    /// G92.2 (`false`), G92.3 (`true`).
    UseG92(bool),
}

/// The way in which the program goes on after a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Flow {
    /// The next line.
    Continue,
    /// M0.
    Pause,
    /// M2, M30.
    End,
}
