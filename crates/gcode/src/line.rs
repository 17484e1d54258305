//! The words of a line, one by one, and the grammar of a line as nom parsers, from the byte up.
//!
//! Short or rare parts are nom combinators: comments, the checksum. [`plain_number`], through which
//! nearly all numbers go, is written out for speed. It leaves long numbers, numbers with gaps and
//! faults to [`number`].

use core::iter::FusedIterator;

use nom::branch::alt;
use nom::bytes::complete::take_till;
use nom::character::complete::u8 as byte_value;
use nom::combinator::{eof, opt, value};
use nom::error::ParseError;
use nom::multi::many0_count;
use nom::sequence::{delimited, preceded};
use nom::{IResult, Parser};

use crate::{Error, ErrorKind, Letter, Number, Word};

/// Reads the words of a line one by one, from left to right.
///
/// The iterator ends with the line or with the first error. A `/` that opens the line is skipped:
/// to notice block delete is left to the caller, or to [`parse`](crate::parse). `%` and `*` are no
/// words and hence errors.
///
/// Bounded by the length of the line.
#[inline]
pub fn words(line: &[u8]) -> Words<'_> {
    let (rest, _) = block_delete(line);
    Words {
        length: line.len(),
        rest,
    }
}

/// Reads the number that a text begins with, as after the `$` and the `=` of a setting; returns
/// the text after it, too.
///
/// # Errors
///
/// As for the number of a word: there is none, or it has no digits.
pub fn leading_number(text: &[u8]) -> Result<(Number, &[u8]), Error> {
    match number(text) {
        Ok((rest, number)) => Ok((number, rest)),
        Err(error) => Err(locate(error, text.len())),
    }
}

/// The words of a line. Made by [`words`].
#[derive(Debug, Clone)]
pub struct Words<'a> {
    /// Length of the whole line in bytes. The column is this length less the length of `rest`.
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
        Some(match word(start) {
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
                Err(locate(error, self.length))
            }
        })
    }
}

impl FusedIterator for Words<'_> {}

/// The answer of a parser: the rest of the line and the value.
type Parsed<'a, O> = IResult<&'a [u8], O, Fault>;

/// An [`Error`] as seen from inside the line, which knows only the bytes left.
#[derive(Debug)]
pub(crate) struct Fault {
    kind: ErrorKind,
    /// Bytes from the faulty one to the end of the line.
    left: usize,
}

impl Fault {
    #[cold]
    fn at(input: &[u8], kind: ErrorKind) -> nom::Err<Self> {
        let left = input.len();
        nom::Err::Error(Self { kind, left })
    }

    /// The fault of a byte that cannot stand there. At the end of a line only a number can still be
    /// missing, because each word may be the last.
    #[cold]
    fn unexpected(input: &[u8]) -> Self {
        let missing = ErrorKind::MissingNumber;
        let kind = input
            .first()
            .copied()
            .map_or(missing, ErrorKind::UnexpectedByte);
        let left = input.len();
        Self { kind, left }
    }
}

impl ParseError<&[u8]> for Fault {
    fn from_error_kind(input: &[u8], _: nom::error::ErrorKind) -> Self {
        Self::unexpected(input)
    }

    fn append(_: &[u8], _: nom::error::ErrorKind, other: Self) -> Self {
        other
    }
}

/// Turns a parser's error into the crate's [`Error`].
#[cold]
pub(crate) fn locate(error: nom::Err<Fault>, length: usize) -> Error {
    let (kind, left) = match error {
        nom::Err::Error(fault) | nom::Err::Failure(fault) => (fault.kind, fault.left),
        // No parser here answers this, because all of them are complete parsers. It would mean that
        // the line ended too soon.
        nom::Err::Incomplete(_) => (ErrorKind::MissingNumber, 0),
    };
    Error {
        kind,
        column: length.saturating_sub(left),
    }
}

/// Reads over the gap and the `/` that may open the line; returns whether there was a `/`.
#[inline]
pub(crate) fn block_delete(line: &[u8]) -> (&[u8], bool) {
    let start = skip_gap(line);
    match start.strip_prefix(b"/") {
        Some(rest) => (skip_gap(rest), true),
        None => (start, false),
    }
}

/// Reads a word and the gap after it: a letter and its number, gaps between them allowed.
#[inline]
pub(crate) fn word(input: &[u8]) -> Parsed<'_, (Letter, Number)> {
    let (rest, letter) = letter(input)?;
    let (rest, number) = match plain_number(rest) {
        Some(read) => read,
        None => preceded(gap, number).parse(rest)?,
    };
    Ok((rest, (letter, number)))
}

/// Returns whether this is `%` and nothing else.
pub(crate) fn is_demarcation(input: &[u8]) -> bool {
    delimited(byte(|byte| byte == b'%'), gap, eof::<_, Fault>)
        .parse(input)
        .is_ok()
}

/// Reads the checksum that ends a line: `*` and a number from 0 to 255.
pub(crate) fn checksum(input: &[u8]) -> Parsed<'_, u8> {
    delimited((byte(|byte| byte == b'*'), gap), byte_value, (gap, eof))
        .parse(input)
        .map_err(|_: nom::Err<Fault>| Fault::at(input, ErrorKind::BadChecksum))
}

#[inline]
fn letter(input: &[u8]) -> Parsed<'_, Letter> {
    let read = input
        .split_first()
        .and_then(|(byte, rest)| Some((rest, Letter::from_byte(*byte)?)));
    read.ok_or_else(|| nom::Err::Error(Fault::unexpected(input)))
}

/// Reads a number as nearly all are: a minus or none, one to nine digits with at most one point
/// among them, and after it the end of the line or a byte that may be the letter of the next word.
/// `None` for all others, which [`number`] reads.
#[inline]
fn plain_number(input: &[u8]) -> Option<(&[u8], Number)> {
    let (unsigned, negative) = match input {
        [b'-', rest @ ..] => (rest, true),
        _ => (input, false),
    };
    let (mut ahead, mut value) = (unsigned, 0_u32);
    let mut from_point = 0; // bytes from the point to the end of the line: none without a point
    let left = loop {
        let [byte, behind @ ..] = ahead else { break 0 };
        match char::from(*byte).to_digit(10) {
            Some(digit) => value = value.wrapping_mul(10).wrapping_add(digit),
            None if *byte >= b'A' => break ahead.len(),
            None if *byte == b'.' && from_point == 0 => from_point = ahead.len(),
            None => return None,
        }
        ahead = behind;
    };
    let (number, rest) = unsigned.split_at_checked(unsigned.len() - left)?;
    let (digits, unit) = match from_point {
        0 => (number.len(), UNITS[0]),
        _ => (number.len() - 1, *UNITS.get(from_point - 1 - left)?),
    };
    if !matches!(digits, 1..=9) {
        return None;
    }
    let count = value as i32; // nine digits fit 31 bits: nothing has wrapped
    let count = if negative { -count } else { count };
    Some((rest, Number::product(count, unit)))
}

/// The value of the last decimal place in nanos, for 0 to 9 decimal places.
const UNITS: [i32; 10] = [
    1_000_000_000,
    100_000_000,
    10_000_000,
    1_000_000,
    100_000,
    10_000,
    1_000,
    100,
    10,
    1,
];

/// Reads any number and the gap after it: a sign or none, digits with at most one point and gaps
/// among them.
///
/// Nine digits after the point count, the others are dropped: the value is cut toward zero. A
/// number beyond the range of [`Number`] is read as the end of the range.
#[cold]
pub(crate) fn number(input: &[u8]) -> Parsed<'_, Number> {
    let (unsigned, negative) = sign(input);
    let (mut whole, mut nanos, mut weight) = (0_i64, 0, 100_000_000);
    let (rest, wholes) = digits(unsigned, |digit| {
        whole = whole.saturating_mul(10).saturating_add(i64::from(digit))
    });
    let (rest, places) = match rest {
        [b'.', rest @ ..] => digits(rest, |digit| {
            nanos += i64::from(digit) * weight;
            weight /= 10; // zero from the tenth place on
        }),
        _ => (rest, 0),
    };
    if wholes + places == 0 {
        return Err(no_digits(input, rest));
    }
    let magnitude = whole.saturating_mul(1_000_000_000).saturating_add(nanos);
    Ok((
        rest,
        Number::from_nanos(if negative { -magnitude } else { magnitude }),
    ))
}

/// Reads a sign and the gap after it; returns whether it was a minus.
fn sign(input: &[u8]) -> (&[u8], bool) {
    match input {
        [b'-', rest @ ..] => (skip_gap(rest), true),
        [b'+', rest @ ..] => (skip_gap(rest), false),
        _ => (input, false),
    }
}

/// Tells a number that is not there from one that begins and has no digits.
#[cold]
fn no_digits(input: &[u8], rest: &[u8]) -> nom::Err<Fault> {
    let kind = if rest.len() == input.len() {
        ErrorKind::MissingNumber
    } else {
        ErrorKind::BadNumber
    };
    Fault::at(input, kind)
}

/// Hands all digits to `push`, from left to right, and skips the gaps between and after them;
/// returns how many digits.
fn digits(mut input: &[u8], mut push: impl FnMut(u32)) -> (&[u8], usize) {
    let mut count = 0;
    while let [byte, rest @ ..] = input {
        match char::from(*byte).to_digit(10) {
            Some(digit) => {
                push(digit);
                count += 1;
                input = rest;
            }
            None if opens_gap(*byte) => input = long_gap(input),
            None => break,
        }
    }
    (input, count)
}

/// [`skip_gap`] for use between combinators.
#[inline]
fn gap(input: &[u8]) -> Parsed<'_, ()> {
    Ok((skip_gap(input), ()))
}

/// Skips blanks and comments, if there are any: seldom, since senders strip them.
#[inline]
pub(crate) fn skip_gap(input: &[u8]) -> &[u8] {
    match input {
        [byte, ..] if opens_gap(*byte) => long_gap(input),
        _ => input,
    }
}

#[inline(never)]
fn long_gap(input: &[u8]) -> &[u8] {
    let skipped: Parsed<'_, usize> =
        many0_count(alt((value((), byte(is_blank)), comment))).parse(input);
    skipped.map_or(input, |(rest, _)| rest)
}

/// Reads a comment: `(` to `)`, or to the end of the line when it is not closed; `;` to the end of
/// the line.
fn comment(input: &[u8]) -> Parsed<'_, ()> {
    let bracketed = delimited(
        byte(|byte| byte == b'('),
        take_till(|byte| byte == b')' || is_line_end(byte)),
        opt(byte(|byte| byte == b')')),
    );
    let trailing = preceded(byte(|byte| byte == b';'), take_till(is_line_end));
    alt((value((), bracketed), value((), trailing))).parse(input)
}

/// Reads one byte that is accepted. nom's own `char` and `take_while1` keep a bounds check, and
/// with it a panic.
fn byte<'a>(accepts: impl Fn(u8) -> bool) -> impl Fn(&'a [u8]) -> Parsed<'a, u8> {
    move |input: &'a [u8]| match input {
        [first, rest @ ..] if accepts(*first) => Ok((rest, *first)),
        _ => Err(nom::Err::Error(Fault::unexpected(input))),
    }
}

#[inline]
fn opens_gap(byte: u8) -> bool {
    byte == b';' || byte <= b'(' && (is_blank(byte) || byte == b'(')
}

#[inline]
fn is_blank(byte: u8) -> bool {
    byte <= b' ' && !is_line_end(byte)
}

#[inline]
fn is_line_end(byte: u8) -> bool {
    byte == b'\r' || byte == b'\n'
}

#[cfg(test)]
mod tests;
