//! Sets of letters and of modal groups that a line has had so far.

use crate::own::MCode;
use crate::Status;
use leadscrew_gcode::Letter;

/// A set of letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Letters(u32);

impl Letters {
    pub(super) const fn of(letters: &[Letter]) -> Self {
        let (mut set, mut rest) = (0, letters);
        while let [letter, tail @ ..] = rest {
            set |= 1 << *letter as u32;
            rest = tail;
        }
        Self(set)
    }

    /// The words that belong to an extension's M code.
    pub(super) const fn taken_by(code: MCode) -> Self {
        Self(code.letters())
    }

    pub(super) const fn contains(self, letter: Letter) -> bool {
        self.0 & 1 << letter as u32 != 0
    }

    pub(super) const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    pub(super) const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    pub(super) const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    pub(super) const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Adds a letter, which may not be in the set yet.
    pub(super) fn insert(&mut self, letter: Letter) -> Result<(), Status> {
        let bit = 1 << letter as u32;
        if self.0 & bit != 0 {
            return Err(Status::WordTwice);
        }
        self.0 |= bit;
        Ok(())
    }
}

/// Words of one group exclude each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Group {
    /// G4, G10, G28, G30, G53, G92 and their fractions.
    NonModal,
    /// G0 to G3, G38.2 to G38.5, G73, G80 to G83, G85, G86, G89.
    Motion,
    /// G17 to G19.
    Plane,
    /// G90, G91.
    Distance,
    /// G91.1.
    ArcDistance,
    /// G93, G94.
    FeedMode,
    /// G20, G21.
    Units,
    /// G40.
    CutterCompensation,
    /// G43.1, G49.
    ToolLength,
    /// G54 to G59.
    System,
    /// G61.
    PathControl,
    /// M0, M1, M2, M30.
    Flow,
    /// M3 to M5.
    Spindle,
    /// M7 to M9.
    Coolant,
    /// M56.
    Parking,
    /// M codes of an extension.
    Own,
    /// G98, G99.
    Retract,
    /// M82, M83.
    Extrusion,
}

/// The groups of which a jog may have words; of the non-modal ones G53 alone.
pub(super) const GROUPS_IN_JOGS: Groups =
    Groups::of(&[Group::Units, Group::Distance, Group::NonModal]);

/// A set of modal groups.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Groups(u32);

impl Groups {
    pub(super) const fn of(groups: &[Group]) -> Self {
        let (mut set, mut rest) = (0, groups);
        while let [group, tail @ ..] = rest {
            set |= 1 << *group as u32;
            rest = tail;
        }
        Self(set)
    }

    pub(super) const fn contains(self, group: Group) -> bool {
        self.0 & 1 << group as u32 != 0
    }

    pub(super) const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Whether one of these is there.
    pub(super) const fn have_any(self, others: Self) -> bool {
        self.0 & others.0 != 0
    }

    pub(super) const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Adds a group, which may not be in the set yet.
    pub(super) fn insert(&mut self, group: Group) -> Result<(), Status> {
        let bit = 1 << group as u32;
        if self.0 & bit != 0 {
            return Err(Status::ModalGroupTwice);
        }
        self.0 |= bit;
        Ok(())
    }
}
