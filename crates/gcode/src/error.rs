//! Faults of a line, and their places.

use core::fmt;

/// A fault of a line, and its byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Error {
    /// The fault.
    pub kind: ErrorKind,
    /// The place of the fault: its offset in the line, in bytes from 0. If the line ends too soon,
    /// the length of the line.
    pub column: usize,
}

/// The ways in which a line can be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ErrorKind {
    /// This byte stands where only the letter of a word may.
    UnexpectedByte(u8),
    /// Nothing that looks like a number follows the letter.
    MissingNumber,
    /// A sign or a point begins a number that has no digit: `-`, `.`, `--1`.
    BadNumber,
    /// The line has more words than the [`Block`](crate::Block) has room for.
    TooManyWords,
    /// `*` is not followed by a whole number from 0 to 255 and the end of the line.
    BadChecksum,
    /// The bytes before `*` are not those that the sender added up: the line was garbled on its
    /// way.
    ChecksumMismatch {
        /// The checksum written on the line.
        stated: u8,
        /// The checksum of the bytes received.
        computed: u8,
    },
}

impl fmt::Display for ErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnexpectedByte(byte) => {
                write!(f, "expected a letter, found `{}`", byte.escape_ascii())
            }
            Self::MissingNumber => f.write_str("the letter needs a number"),
            Self::BadNumber => f.write_str("the number has no digits"),
            Self::TooManyWords => f.write_str("too many words on one line"),
            Self::BadChecksum => {
                f.write_str("`*` needs a checksum from 0 to 255 and the end of the line")
            }
            Self::ChecksumMismatch { stated, computed } => {
                write!(
                    f,
                    "the checksum should be {computed}, the line says {stated}"
                )
            }
        }
    }
}

impl fmt::Display for Error {
    /// Counts the column from 1, as people and editors do.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "column {}: {}", self.column.saturating_add(1), self.kind)
    }
}

impl core::error::Error for Error {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn messages_name_the_byte_and_count_columns_from_one() {
        let error = Error {
            kind: ErrorKind::UnexpectedByte(b'\n'),
            column: 4,
        };
        assert_eq!(
            error.to_string(),
            r"column 5: expected a letter, found `\n`"
        );
    }
}
