//! The settings and the machine that a line's meaning depends on.

use super::Coordinate;
use crate::arc::ArcMismatch;
use crate::own::{Call, MCode, Words};
use crate::AxisKind;
use crate::Status;
use core::cell::Cell;
use core::fmt;

/// The settings and the build of the machine, as far as the meaning of a line depends on them.
#[derive(Debug, Clone, Copy)]
pub struct Context<'a, const AXES: usize> {
    /// Linear axes take inches in G20, rotary ones never.
    pub axes: &'a [AxisKind; AXES],
    /// Words that not every machine knows.
    pub dialect: &'a Dialect,
    /// `$32`: spindle words are laser words.
    pub laser_mode: bool,
    /// `$20`. With soft limits a target beyond `reach` is replaced by a target just beyond `reach`.
    /// This target lies outside every travel, so the machine answers with an alarm, as Grbl does.
    /// Without soft limits a target beyond `reach` is refused.
    pub soft_limits: bool,
    /// For each axis the farthest machine coordinate to either side that steps can count. Half the
    /// range of `i32` divided by the steps per mm keeps every move countable, too. At most
    /// [`MAX_WORD`](super::MAX_WORD).
    pub reach: &'a [Coordinate; AXES],
    /// `$713`, `$714`: how much farther from an arc's centre one end may be than the other.
    pub arcs: ArcMismatch,
    /// M codes beyond GRBL's.
    pub own: OwnCodes<'a>,
    /// The tool table.
    pub tools: ToolTable<'a>,
}

impl<const AXES: usize> Context<'_, AXES> {
    /// Returns true if a motion turns axes and changes no length.
    pub(super) fn turns_alone(&self, from: &[Coordinate; AXES], to: &[Coordinate; AXES]) -> bool {
        let moves = |kind| {
            let mut axes = self.axes.iter().zip(from.iter().zip(to));
            axes.any(|(of, (from, to))| *of == kind && from != to)
        };
        moves(AxisKind::Rotary) && !moves(AxisKind::Linear)
    }
}

/// Words that not every machine knows: Grbl has two of them as options when it is compiled, and lacks
/// the others. A machine refuses a word that is off.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Dialect {
    /// M7, for the mist valve.
    pub mist: bool,
    /// M56, which allows and forbids parking.
    pub parking_override: bool,
    /// Canned cycles, which Grbl has not: G73, G81 to G83, G85, G86, G89, G98, G99, and the words Q
    /// and L for them. Only in a build with the feature `cycles`: see [`Dialect::has_cycles`].
    pub cycles: bool,
    /// Words of LinuxCNC's that Grbl has not, so that files of its post-processors run: `%`, G52, G59.1
    /// to G59.3, G61.1, G64, G92.2, G92.3, M48 to M51, M70 to M73, P of arcs, and full circles
    /// without axis words. Only in a build with the feature `linuxcnc`: see
    /// [`Dialect::has_linuxcnc`].
    pub linuxcnc: bool,
    /// A tool table, which Grbl has not: T stays selected, G43 Hn, G10 L1. For a machine with an
    /// extension that keeps the table.
    pub tools: bool,
}

impl Dialect {
    /// Returns true if the machine knows LinuxCNC's words. A build without the feature `linuxcnc`
    /// has no code for them: firmware for small chips.
    pub const fn has_linuxcnc(&self) -> bool {
        cfg!(feature = "linuxcnc") && self.linuxcnc
    }

    /// Returns true if the machine knows canned cycles. A build without the feature `cycles` has no
    /// code for them.
    pub const fn has_cycles(&self) -> bool {
        cfg!(feature = "cycles") && self.cycles
    }

    /// The words of Grbl as it is usually compiled.
    pub const GRBL: Self = Self {
        mist: false,
        parking_override: false,
        cycles: false,
        linuxcnc: false,
        tools: false,
    };
}

/// Returns the length of the tool with this number, or for `None` the length of the tool in the
/// spindle. The answer is `None` if there is no such tool.
type LengthOf<'a> = dyn Fn(Option<u32>) -> Option<Coordinate> + 'a;

/// The lengths of tools, if the machine has a table of them.
#[derive(Clone, Copy, Default)]
pub struct ToolTable<'a>(Option<&'a LengthOf<'a>>);

impl<'a> ToolTable<'a> {
    /// No table.
    pub const NONE: Self = Self(None);

    /// Makes a table that `length` looks up.
    pub const fn some(length: &'a LengthOf<'a>) -> Self {
        Self(Some(length))
    }

    /// The length of the tool with this number, or for `None` of the tool in the spindle.
    pub(super) fn length(self, tool: Option<u32>) -> Option<Coordinate> {
        self.0.and_then(|length| length(tool))
    }
}

impl fmt::Debug for ToolTable<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("ToolTable").field(&self.0.is_some()).finish()
    }
}

/// The M codes of an extension, and the M code that the present line has.
pub struct Own<'a> {
    find: &'a dyn Fn(u8) -> Option<MCode>,
    check: &'a dyn Fn(&Call) -> Result<(), Status>,
    /// The M code of the line, noted as the words are read and used at the end of the line. Kept
    /// apart from the block, since most lines have none.
    found: Cell<Option<(MCode, Call)>>,
}

impl<'a> Own<'a> {
    /// Returns the codes for which `find` has an answer. A line whose code `check` refuses is
    /// refused.
    pub const fn new(
        find: &'a dyn Fn(u8) -> Option<MCode>,
        check: &'a dyn Fn(&Call) -> Result<(), Status>,
    ) -> Self {
        let found = Cell::new(None);
        Self { find, check, found }
    }
}

/// The M codes of an extension, if there is one.
#[derive(Clone, Copy, Default)]
pub struct OwnCodes<'a>(Option<&'a Own<'a>>);

impl<'a> OwnCodes<'a> {
    /// No codes at all.
    pub const NONE: Self = Self(None);

    /// Returns the codes of `own`.
    pub const fn some(own: &'a Own<'a>) -> Self {
        Self(Some(own))
    }

    /// Notes the M code of this number; returns whether there is such a code.
    pub(super) fn take(self, code: u8) -> bool {
        let Some((own, known)) = self.0.and_then(|own| Some((own, (own.find)(code)?))) else {
            return false;
        };
        let words = Words::NONE;
        own.found.set(Some((known, Call { code, words })));
        true
    }

    /// The M code that was noted last.
    pub(super) fn found(self) -> Option<(MCode, Call)> {
        self.0.and_then(|own| own.found.get())
    }

    /// Checks whether the M code that was noted last may be carried out.
    ///
    /// # Errors
    /// The status with which the line is refused.
    pub(super) fn check(self) -> Result<(), Status> {
        match self.0.and_then(|own| Some((own, own.found.get()?))) {
            Some((own, (_, call))) => (own.check)(&call),
            None => Ok(()),
        }
    }

    /// Notes the words of the M code that was noted last.
    pub(super) fn set_words(self, words: Words) {
        if let Some((own, (code, call))) = self.0.and_then(|own| Some((own, own.found.get()?))) {
            own.found.set(Some((code, Call { words, ..call })));
        }
    }
}

impl fmt::Debug for OwnCodes<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("OwnCodes").field(&self.0.is_some()).finish()
    }
}
