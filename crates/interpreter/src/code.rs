//! G and M numbers: which exist, their meaning, their modal groups, and the error of a wrong one.
//! Sets of letters and of groups, for the words that a line has had so far.
//!
//! GRBL takes a number modulo 256 and its fraction in hundredths, rounded: G38.204 is G38.2, G0.004
//! is G0. A number that wraps is never accepted. It is refused as the wrapped number is: G256 as a
//! G0 with a fraction, G300 as G44.

use super::command::OffsetId;
use super::cycle::kind::CycleKind;
use super::modal_state::{
    Distance, FeedMode, Motion, Plane, ProbeKind, Retract, Rotation, Turn, Units, WorkSystem,
};
use super::takers::{AxisCommand, Flow, NonModal, ToolLength};
use crate::own::MCode;
use crate::{Dialect, Status};
use leadscrew_gcode::{Letter, Number};

/// The number of a G or M word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Code {
    whole: u8,
    /// 0 to 100, or [`WRAPPED`].
    hundredths: u16,
}

/// The fraction of a number that is not within 0 to 255: no word has it.
const WRAPPED: u16 = u16::MAX;

/// The meaning of a G word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum GWord {
    NonModal(NonModal),
    Motion(Motion),
    Plane(Plane),
    Distance(Distance),
    /// G91.1, the only mode there is.
    ArcDistance,
    FeedMode(FeedMode),
    Retract(Retract),
    Units(Units),
    /// G40, the only mode there is.
    CutterCompensation,
    ToolLength(ToolLength),
    System(WorkSystem),
    /// G61, G61.1 and G64 (`true`): the path is exact with each.
    PathControl(bool),
}

impl GWord {
    pub(super) const fn group(self) -> Group {
        match self {
            Self::NonModal(_) => Group::NonModal,
            Self::Motion(_) => Group::Motion,
            Self::Plane(_) => Group::Plane,
            Self::Distance(_) => Group::Distance,
            Self::ArcDistance => Group::ArcDistance,
            Self::FeedMode(_) => Group::FeedMode,
            Self::Retract(_) => Group::Retract,
            Self::Units(_) => Group::Units,
            Self::CutterCompensation => Group::CutterCompensation,
            Self::ToolLength(_) => Group::ToolLength,
            Self::System(_) => Group::System,
            Self::PathControl(_) => Group::PathControl,
        }
    }
}

/// The meaning of an M word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MWord {
    Flow(Flow),
    Spindle(Rotation),
    Mist,
    Flood,
    CoolantOff,
    Parking,
    /// M48 to M51.
    Overrides(u8),
    /// M70 to M73.
    Modes(u8),
}

impl MWord {
    pub(super) const fn group(self) -> Group {
        match self {
            Self::Flow(_) => Group::Flow,
            Self::Spindle(_) => Group::Spindle,
            Self::Mist | Self::Flood | Self::CoolantOff => Group::Coolant,
            Self::Parking => Group::Parking,
            Self::Overrides(_) => Group::Overrides,
            Self::Modes(_) => Group::Modes,
        }
    }
}

impl Code {
    pub(super) fn of(value: Number) -> Self {
        let whole = value.trunc();
        let fraction = value
            .nanos()
            .wrapping_sub(whole.wrapping_mul(1_000_000_000));
        let hundredths = match fraction as i32 {
            _ if u8::try_from(whole).is_err() => WRAPPED,
            0 => 0,
            fraction => ((fraction.unsigned_abs() + 5_000_000) / 10_000_000) as u16,
        };
        Self {
            whole: whole as u8,
            hundredths,
        }
    }

    pub(super) const fn whole(self) -> u8 {
        self.whole
    }

    /// Returns the command that takes the axis words because of this G word. Asked before the word
    /// is known to exist.
    pub(super) const fn claims(self, dialect: &Dialect) -> Option<AxisCommand> {
        match self.whole {
            0..=3 | 38 => Some(AxisCommand::Motion),
            73 | 81..=83 | 85 | 86 | 89 if dialect.has_cycles() => Some(AxisCommand::Motion),
            43 if dialect.tools && self.hundredths == 0 => None,
            43 => Some(AxisCommand::SetToolLength),
            49 => Some(AxisCommand::CancelToolLength),
            52 if dialect.has_linuxcnc() => Some(AxisCommand::NonModal),
            10 | 28 | 30 | 92 if self.hundredths == 0 => Some(AxisCommand::NonModal),
            _ => None,
        }
    }

    /// Returns whether a jog may have this number as a G word.
    pub(super) fn may_be_in_jogs(self) -> bool {
        match self.g(&Dialect::GRBL) {
            Ok(GWord::NonModal(command)) => command == NonModal::MachineCoordinates,
            Ok(word) => GROUPS_IN_JOGS.contains(word.group()),
            Err(_) => false,
        }
    }

    /// Returns the meaning of this number as a G word, on a machine with this dialect.
    #[inline]
    pub(super) fn g(self, dialect: &Dialect) -> Result<GWord, Status> {
        match self.hundredths {
            0 => self.whole_g(dialect).ok_or(Status::UnsupportedCommand),
            1..=100 => self.fractional_g(dialect),
            _ => Err(self.not_whole(dialect)),
        }
    }

    #[inline]
    fn whole_g(self, dialect: &Dialect) -> Option<GWord> {
        Some(match self.whole {
            0 => GWord::Motion(Motion::Rapid),
            1 => GWord::Motion(Motion::Feed),
            2 if cfg!(feature = "arcs") => GWord::Motion(Motion::Arc(Turn::Clockwise)),
            3 if cfg!(feature = "arcs") => GWord::Motion(Motion::Arc(Turn::Counterclockwise)),
            4 => GWord::NonModal(NonModal::Dwell),
            10 => GWord::NonModal(NonModal::SetOrigin),
            17 => GWord::Plane(Plane::Xy),
            18 => GWord::Plane(Plane::Zx),
            19 => GWord::Plane(Plane::Yz),
            20 => GWord::Units(Units::Inches),
            21 => GWord::Units(Units::Millimetres),
            28 => GWord::NonModal(NonModal::GoTo(OffsetId::G28)),
            30 => GWord::NonModal(NonModal::GoTo(OffsetId::G30)),
            40 => GWord::CutterCompensation,
            49 => GWord::ToolLength(ToolLength::Cancel),
            43 if dialect.tools => GWord::ToolLength(ToolLength::FromTable),
            52 if dialect.has_linuxcnc() => GWord::NonModal(NonModal::LocalOrigin),
            53 => GWord::NonModal(NonModal::MachineCoordinates),
            54 => GWord::System(WorkSystem::G54),
            55 => GWord::System(WorkSystem::G55),
            56 => GWord::System(WorkSystem::G56),
            57 => GWord::System(WorkSystem::G57),
            58 => GWord::System(WorkSystem::G58),
            59 => GWord::System(WorkSystem::G59),
            61 => GWord::PathControl(false),
            64 if dialect.has_linuxcnc() => GWord::PathControl(true),
            80 => GWord::Motion(Motion::Cancelled),
            73 | 81..=83 | 85 | 86 | 89 if dialect.has_cycles() => {
                GWord::Motion(Motion::Cycle(CycleKind::from_code(self.whole)?))
            }
            90 => GWord::Distance(Distance::Absolute),
            91 => GWord::Distance(Distance::Incremental),
            92 => GWord::NonModal(NonModal::SetG92),
            93 => GWord::FeedMode(FeedMode::InverseTime),
            94 => GWord::FeedMode(FeedMode::PerMinute),
            98 if dialect.has_cycles() => GWord::Retract(Retract::Initial),
            99 if dialect.has_cycles() => GWord::Retract(Retract::Clear),
            _ => return None,
        })
    }

    fn fractional_g(self, dialect: &Dialect) -> Result<GWord, Status> {
        let probe = |toward, must_trigger| {
            GWord::Motion(Motion::Probe(ProbeKind {
                toward,
                must_trigger,
            }))
        };
        Ok(match (self.whole, self.hundredths) {
            (28, 10) => GWord::NonModal(NonModal::Store(OffsetId::G28)),
            (30, 10) => GWord::NonModal(NonModal::Store(OffsetId::G30)),
            (38, _) if !cfg!(feature = "probing") => return Err(Status::UnsupportedCommand),
            (38, 20) => probe(true, true),
            (38, 30) => probe(true, false),
            (38, 40) => probe(false, true),
            (38, 50) => probe(false, false),
            (43, 10) => GWord::ToolLength(ToolLength::FromWord),
            (49, _) => GWord::ToolLength(ToolLength::Cancel),
            (91, 10) => GWord::ArcDistance,
            (92, 10) => GWord::NonModal(NonModal::ClearG92),
            (59, 10) if dialect.has_linuxcnc() => GWord::System(WorkSystem::G59_1),
            (59, 20) if dialect.has_linuxcnc() => GWord::System(WorkSystem::G59_2),
            (59, 30) if dialect.has_linuxcnc() => GWord::System(WorkSystem::G59_3),
            (61, 10) if dialect.has_linuxcnc() => GWord::PathControl(false),
            (92, 20) if dialect.has_linuxcnc() => GWord::NonModal(NonModal::UseG92(false)),
            (92, 30) if dialect.has_linuxcnc() => GWord::NonModal(NonModal::UseG92(true)),
            _ => return Err(self.not_whole(dialect)),
        })
    }

    /// Returns the status of a fraction that means nothing: [`Status::NotWhole`] if the number
    /// exists without a fraction and never has one in G-code, otherwise
    /// [`Status::UnsupportedCommand`].
    fn not_whole(self, dialect: &Dialect) -> Status {
        match self.whole {
            28 | 30 | 38 | 43 | 61 | 90 | 91 | 92 => Status::UnsupportedCommand,
            _ if self.whole_g(dialect).is_some() => Status::NotWhole,
            _ => Status::UnsupportedCommand,
        }
    }

    /// Returns the number, if it is a whole one of 0 to 255.
    pub(super) fn exact(self) -> Option<u8> {
        (self.hundredths == 0).then_some(self.whole)
    }

    /// Returns the meaning of this number as an M word, on a machine with this dialect.
    pub(super) fn m(self, dialect: &Dialect) -> Result<MWord, Status> {
        if self.hundredths != 0 {
            return Err(Status::NotWhole);
        }
        Ok(match self.whole {
            0 => MWord::Flow(Flow::Pause),
            1 => MWord::Flow(Flow::Continue), // there is no switch for an optional stop
            2 | 30 => MWord::Flow(Flow::End),
            3 => MWord::Spindle(Rotation::Clockwise),
            4 => MWord::Spindle(Rotation::Counterclockwise),
            5 => MWord::Spindle(Rotation::Off),
            7 if dialect.mist => MWord::Mist,
            8 => MWord::Flood,
            9 => MWord::CoolantOff,
            56 if dialect.parking_override => MWord::Parking,
            48..=51 if dialect.has_linuxcnc() => MWord::Overrides(self.whole),
            70..=73 if dialect.has_linuxcnc() => MWord::Modes(self.whole),
            _ => return Err(Status::UnsupportedCommand),
        })
    }
}

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
    /// G4, G10, G28, G30, G52, G53, G92 and their fractions.
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
    /// G43, G43.1, G49.
    ToolLength,
    /// G54 to G59.3.
    System,
    /// G61, G61.1, G64.
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
    /// M48 to M51.
    Overrides,
    /// M70 to M73.
    Modes,
    /// G64, besides its group: it takes words.
    Blend,
    /// M48, besides its group.
    AllOverrides,
    /// M49, besides its group.
    NoOverrides,
    /// M50, besides its group: P is for the feed.
    FeedOverride,
    /// M51, besides its group: P is for the spindle.
    SpindleOverride,
    /// M70 and M73, besides their group.
    Keep,
    /// M72, besides its group.
    Recall,
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

    /// Returns true if one of these is there.
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
