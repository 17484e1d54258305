//! A tool of a file.

use crate::Mm;

/// The highest number of a tool that machines take.
pub(crate) const MOST_OF_MACHINES: u32 = 255;

/// The data of a tool in a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Tool {
    /// `C`, its diameter; 0 if the tool has no hole, as CAD programs write it. Older programs write
    /// diameters into a separate list.
    pub diameter: Option<Mm>,
    /// `F`: how fast it goes down, mm/min.
    pub feed: Option<Mm>,
    /// `S`: how fast it turns, 1/min.
    pub speed: Option<u32>,
}

impl Tool {
    /// Returns true if the file gives this tool a diameter of 0: it can make no hole.
    pub(super) fn is_empty(&self) -> bool {
        self.diameter == Some(Mm::ZERO)
    }
}
