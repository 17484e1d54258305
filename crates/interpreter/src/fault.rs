//! Faults of a line, and their places.

use super::code::Code;
use super::code::Letters;
use crate::{Dialect, Status};
use core::fmt;
use leadscrew_gcode::{words, Error, ErrorKind, Letter, Word};

/// The reason why a line was refused, and the place in the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fault {
    /// The answer to the line.
    pub status: Status,
    /// Byte offset in the filtered line, from 0; its length if something is missing at the end.
    pub column: usize,
}

impl fmt::Display for Fault {
    /// Counts the column from 1, as people and editors do.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "column {}: {}", self.column + 1, self.status)
    }
}

impl core::error::Error for Fault {}

impl Fault {
    /// Returns the same fault in a line with `columns` more bytes in front.
    pub fn after(self, columns: usize) -> Self {
        let column = self.column.saturating_add(columns);
        Self { column, ..self }
    }

    /// The fault of a word of `line`, told as what it is if the line is one of a program's. A machine
    /// that has no more words than Grbl keeps Grbl's number; one that knows LinuxCNC's, in a build
    /// with or without them, does not.
    #[cold]
    pub(super) fn named(self, line: &[u8], dialect: &Dialect) -> Self {
        if !dialect.linuxcnc {
            return self;
        }
        let status = match self.status {
            Status::ExpectedLetter | Status::BadNumber | Status::UnsupportedCommand
                if is_flow(line, self.column) =>
            {
                Status::NeedsProgram
            }
            Status::ExpectedLetter | Status::BadNumber if has_values(line) => Status::Calculates,
            status => status,
        };
        Self { status, ..self }
    }
}

/// Returns true if a filtered line has a parameter or an expression.
fn has_values(line: &[u8]) -> bool {
    line.iter().any(|byte| matches!(byte, b'#' | b'['))
}

/// Returns true if a line has an O word, behind its line number at most, or if M98, M99 or G65
/// stands at `column`.
fn is_flow(line: &[u8], column: usize) -> bool {
    let bare = line.strip_prefix(b"N").map(|rest| {
        let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
        rest.get(digits..).unwrap_or_default()
    });
    let word = line.get(column..).and_then(|rest| words(rest).next()?.ok());
    bare.unwrap_or(line).first() == Some(&b'O')
        || word.is_some_and(|word| {
            let code = (word.letter(), Code::of(word.value()).exact());
            matches!(code, (Letter::M, Some(98 | 99)) | (Letter::G, Some(65)))
        })
}

impl From<Status> for Fault {
    /// The line as a whole is refused.
    fn from(status: Status) -> Self {
        Self { status, column: 0 }
    }
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        let status = match error.kind {
            ErrorKind::UnexpectedByte(_)
            | ErrorKind::BadChecksum
            | ErrorKind::ChecksumMismatch { .. } => Status::ExpectedLetter,
            ErrorKind::MissingNumber | ErrorKind::BadNumber => Status::BadNumber,
            ErrorKind::TooManyWords => Status::LineTooLong,
        };
        Self {
            status,
            column: error.column,
        }
    }
}

/// The reason why a line as a whole was refused. The place of its culprit is looked up only in the
/// end, by [`Refusal::locate`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Refusal {
    pub(super) status: Status,
    pub(super) culprit: Culprit,
}

/// The word at which a [`Refusal`] points: the first of its kind, or the start of the line if
/// there is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Culprit {
    /// One of these letters.
    Words(Letters),
    /// This G word, whatever its fraction.
    G(u8),
    /// A word that no jog may have.
    NotInJogs,
}

impl Refusal {
    pub(super) fn words(status: Status, letters: Letters) -> Self {
        let culprit = Culprit::Words(letters);
        Self { status, culprit }
    }

    pub(super) fn g(status: Status, whole: u8) -> Self {
        let culprit = Culprit::G(whole);
        Self { status, culprit }
    }

    pub(super) fn not_in_jogs() -> Self {
        Self {
            status: Status::InvalidJog,
            culprit: Culprit::NotInJogs,
        }
    }

    /// Finds the culprit in its line.
    pub(super) fn locate(self, line: &[u8]) -> Fault {
        let column = words(line)
            .flatten()
            .find(|word| self.culprit.is(word))
            .map_or(0, |word| word.column());
        Fault {
            status: self.status,
            column,
        }
    }
}

impl Culprit {
    fn is(self, word: &Word) -> bool {
        match self {
            Self::Words(letters) => letters.contains(word.letter()),
            Self::G(whole) => word.letter() == Letter::G && Code::of(word.value()).whole() == whole,
            Self::NotInJogs => match word.letter() {
                Letter::G => !Code::of(word.value()).may_be_in_jogs(),
                letter => letter == Letter::M,
            },
        }
    }
}
