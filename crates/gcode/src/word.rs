//! Words: a letter and a number, read one by one.

use core::fmt;
use core::iter::FusedIterator;

use crate::{line, Error, Letter, Number};

/// A letter with its number, and where it was found.
///
/// Words are equal when they say the same, wherever they stand and however they were spelled.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Word {
    letter: Letter,
    value: Number,
    column: usize,
}

impl Word {
    /// Answers the letter.
    #[inline]
    pub const fn letter(&self) -> Letter {
        self.letter
    }

    /// Answers the number after the letter.
    #[inline]
    pub const fn value(&self) -> Number {
        self.value
    }

    /// Answers the offset of the letter in its line, in bytes from 0.
    #[inline]
    pub const fn column(&self) -> usize {
        self.column
    }
}

impl PartialEq for Word {
    fn eq(&self, other: &Self) -> bool {
        (self.letter, self.value) == (other.letter, other.value)
    }
}

impl Eq for Word {}

impl fmt::Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.letter, self.value)
    }
}

/// Reads the words of a line one by one, from left to right.
///
/// The iterator ends with the line or with the first error. A `/` that opens the line is skipped:
/// to notice block delete is left to the caller, or to [`parse`](crate::parse). `%` and `*` are no
/// words and hence errors.
///
/// Bounded by the length of the line.
#[inline]
pub fn words(line: &[u8]) -> Words<'_> {
    let (rest, _) = line::block_delete(line);
    Words {
        length: line.len(),
        rest,
    }
}

/// Reads the number that a text begins with, as after the `$` and the `=` of a setting; answers
/// the text after it, too.
///
/// # Errors
///
/// As for the number of a word: there is none, or it has no digits.
pub fn leading_number(text: &[u8]) -> Result<(Number, &[u8]), Error> {
    match line::number(text) {
        Ok((rest, number)) => Ok((number, rest)),
        Err(error) => Err(line::locate(error, text.len())),
    }
}

/// The words of a line. Made by [`words`].
#[derive(Debug, Clone)]
pub struct Words<'a> {
    /// Length of the whole line in bytes. The column is this length less that of `rest`.
    length: usize,
    /// The unread part, without a gap in front of it; empty after an error.
    rest: &'a [u8],
}

impl Iterator for Words<'_> {
    type Item = Result<Word, Error>;

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        let start = self.rest;
        if start.is_empty() {
            return None;
        }
        Some(match line::word(start) {
            Ok((rest, (letter, value))) => {
                self.rest = rest;
                Ok(Word {
                    letter,
                    value,
                    column: self.length - start.len(),
                })
            }
            Err(error) => {
                self.rest = &[];
                Err(line::locate(error, self.length))
            }
        })
    }
}

impl FusedIterator for Words<'_> {}
