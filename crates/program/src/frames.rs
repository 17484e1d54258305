//! The frames that a program is in the middle of: calls, loops, and the search for a line.

use crate::fault::{Error, ErrorKind};
use crate::label::{Keyword, Label};
use crate::numbered::Locals;
use crate::texts::Place;

/// A call under way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub(crate) label: Label,
    /// The text of the caller, the line after the call, and the column of the call.
    pub(crate) text: u8,
    pub(crate) back: Place,
    pub(crate) column: usize,
    /// The caller's #1 to #30; `None` after M98, which shares them.
    pub(crate) callers: Option<Locals>,
    /// Loops that belong to the callers.
    pub(crate) loops: usize,
    /// The first line of the subprogram.
    pub(crate) entry: Place,
    /// The number of times that the subprogram is still to be run after this time.
    pub(crate) again: u32,
}

impl Frame {
    /// A fault of the call.
    pub(crate) fn error(&self, kind: ErrorKind) -> Error {
        Error {
            kind,
            text: self.text,
            line: self.back.line,
            column: self.column,
        }
    }
}

/// A loop or condition under way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Loop {
    pub(crate) label: Label,
    pub(crate) kind: LoopKind,
    /// The line that began it.
    pub(crate) begin: Place,
    /// The line after it.
    pub(crate) inside: Place,
}

/// A kind of loop or condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LoopKind {
    /// A condition; whether one of its branches has been run.
    If {
        done: bool,
    },
    While,
    Do,
    /// A loop with a count, and how often it is still to be run after this time.
    Repeat {
        again: u32,
    },
}

/// The treatment of a program's next line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mode {
    /// Runs it.
    Run,
    /// Passes over lines up to an O word with this label. `opened` is the line, from 1, that began
    /// what is passed over.
    Skip {
        label: Label,
        until: Until,
        opened: u32,
    },
    /// Looks for the beginning of the subprogram that has just been called.
    Seek,
    /// Has nothing left to run.
    Ended,
}

/// The O word up to which lines are passed over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Until {
    /// The next branch of a condition, or its end.
    Branch,
    /// This keyword, which is then run.
    At(Keyword),
    /// This keyword, and run the line after it.
    Past(Keyword),
}

impl Until {
    pub(crate) fn is_met(self, keyword: Keyword) -> bool {
        match self {
            Self::Branch => matches!(keyword, Keyword::ElseIf | Keyword::Else | Keyword::EndIf),
            Self::At(wanted) | Self::Past(wanted) => keyword == wanted,
        }
    }
}
