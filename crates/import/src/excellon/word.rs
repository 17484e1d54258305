//! Words of a statement: letters with their digits.

use super::wrong::Wrong;
use nom::character::complete::{one_of, satisfy};
use nom::combinator::{opt, recognize};
use nom::{bytes::complete::take_while, IResult, Parser};

/// A letter and the number after it, as written. The place of its decimal point depends on the
/// file's format.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Word<'a> {
    /// The letter, a capital.
    pub(super) letter: char,
    /// Sign, digits, point; may be empty.
    pub(super) text: &'a str,
    /// Column of the letter, from 1.
    pub(super) column: usize,
}

impl Word<'_> {
    /// The number, if it is a whole number without a sign, as codes and counts are.
    pub(super) fn whole(&self) -> Result<u32, Wrong> {
        let digits = self.text.bytes().all(|byte| byte.is_ascii_digit());
        let number = self.text.parse().ok().filter(|_| digits);
        number.ok_or_else(|| self.wrong("expected a whole number"))
    }

    /// A complaint about this word.
    pub(super) fn wrong(&self, message: impl std::fmt::Display) -> Wrong {
        let Word {
            letter,
            text,
            column,
        } = self;
        Wrong::at(*column, format!("{letter}{text}: {message}"))
    }
}

/// Splits a statement into words; blanks between them are ignored.
pub(super) fn words(statement: &str) -> Result<Vec<Word<'_>>, Wrong> {
    let mut words = Vec::new();
    let mut rest = statement.trim_start();
    while !rest.is_empty() {
        let column = statement.len() - rest.len() + 1;
        let (behind, (letter, text)) = word(rest)
            .map_err(|_| Wrong::at(column, "not understood; a letter with a number is"))?;
        let letter = letter.to_ascii_uppercase();
        words.push(Word {
            letter,
            text,
            column,
        });
        rest = behind.trim_start();
    }
    Ok(words)
}

fn word(input: &str) -> IResult<&str, (char, &str)> {
    let sign = opt(one_of("+-"));
    let digits = take_while(|c: char| c.is_ascii_digit() || c == '.');
    let letter = satisfy(|c| c.is_ascii_alphabetic());
    (letter, recognize((sign, digits))).parse(input)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_keep_their_digits_and_columns() {
        let found = words(" T1C.034 F200").unwrap();
        let shown: Vec<_> = found.iter().map(|w| (w.letter, w.text, w.column)).collect();
        assert_eq!(shown, [('T', "1", 2), ('C', ".034", 4), ('F', "200", 10)]);
        assert_eq!(words("X1*2").unwrap_err().column, 3);
    }
}
