//! The kinds of canned cycles.

use core::fmt::{self, Display, Formatter};

/// The kind of a canned cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CycleKind {
    /// G73: pecks, a little back after each to break the chip.
    ChipBreak,
    /// G81: down, back in rapid.
    Drill,
    /// G82: down, dwell, back in rapid.
    DrillDwell,
    /// G83: pecks, out to the R level after each to clear the chips.
    Peck,
    /// G85: down, back at the feed rate as far as the R level.
    Bore,
    /// G86: down, dwell, spindle stop, back in rapid, spindle on again.
    BoreStop,
    /// G89: down, dwell, back at the feed rate.
    BoreDwell,
}

impl CycleKind {
    /// Returns the cycle of a G number.
    pub(crate) const fn from_code(whole: u8) -> Option<Self> {
        Some(match whole {
            73 => Self::ChipBreak,
            81 => Self::Drill,
            82 => Self::DrillDwell,
            83 => Self::Peck,
            85 => Self::Bore,
            86 => Self::BoreStop,
            89 => Self::BoreDwell,
            _ => return None,
        })
    }

    /// Returns its G number.
    pub const fn code(self) -> u8 {
        match self {
            Self::ChipBreak => 73,
            Self::Drill => 81,
            Self::DrillDwell => 82,
            Self::Peck => 83,
            Self::Bore => 85,
            Self::BoreStop => 86,
            Self::BoreDwell => 89,
        }
    }

    /// Returns true if it goes down in pecks, and takes Q.
    pub const fn pecks(self) -> bool {
        matches!(self, Self::ChipBreak | Self::Peck)
    }

    /// Returns true if it dwells at the bottom, and takes P.
    pub const fn dwells(self) -> bool {
        matches!(self, Self::DrillDwell | Self::BoreStop | Self::BoreDwell)
    }
}

impl Display for CycleKind {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "G{}", self.code())
    }
}
