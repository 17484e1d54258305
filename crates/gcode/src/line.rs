//! The grammar of a line as nom parsers, from the byte up.
//!
//! Short or rare parts are nom combinators: comments, the checksum. [`plain_number`], through which
//! nearly all numbers go, is written out for speed. It leaves long numbers, numbers with gaps and
//! faults to [`number`].

use nom::branch::alt;
use nom::bytes::complete::take_till;
use nom::character::complete::u8 as byte_value;
use nom::combinator::{eof, opt, value};
use nom::error::ParseError;
use nom::multi::many0_count;
use nom::sequence::{delimited, preceded};
use nom::{IResult, Parser};

use crate::{Error, ErrorKind, Letter, Number};

/// The answer of a parser: the rest of the line and the value.
type Parsed<'a, O> = IResult<&'a [u8], O, Fault>;

/// An [`Error`] as seen from inside the line, where only the bytes left are known.
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
        // Never answered: all parsers here are complete ones. It would mean that the line ended too
        // soon.
        nom::Err::Incomplete(_) => (ErrorKind::MissingNumber, 0),
    };
    Error {
        kind,
        column: length.saturating_sub(left),
    }
}

/// Reads over the gap and the `/` that may open the line; answers whether there was a `/`.
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

/// Answers whether this is `%` and nothing else.
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

/// Reads a sign and the gap after it; answers whether it was a minus.
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
/// answers how many digits.
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
mod tests {
    use super::*;
    use crate::{words, Word};
    use proptest::prelude::*;
    use std::format;
    use std::string::{String, ToString};
    use std::vec::Vec;

    fn read(line: &str) -> Result<Vec<Word>, Error> {
        words(line.as_bytes()).collect()
    }

    /// The words of a line as printed, or the kind of its error.
    fn printed(line: &str) -> Result<String, ErrorKind> {
        let words = read(line).map_err(|error| error.kind)?;
        Ok(words
            .iter()
            .map(Word::to_string)
            .collect::<Vec<_>>()
            .join(" "))
    }

    fn fails(line: &str, kind: ErrorKind, column: usize) {
        assert_eq!(read(line), Err(Error { kind, column }), "{line}");
    }

    #[test]
    fn a_clean_line_is_its_words() {
        assert_eq!(
            printed("G1X12.345Y-6.789F1500").as_deref(),
            Ok("G1 X12.345 Y-6.789 F1500")
        );
        assert_eq!(printed("").as_deref(), Ok(""));
    }

    #[test]
    fn small_letters_count_as_capitals() {
        assert_eq!(printed("g38.2 z-1"), printed("G38.2Z-1"));
    }

    #[test]
    fn gaps_mean_nothing_anywhere() {
        for line in [
            " G 0\tX1\x002 . 5 ",
            "G(one)0X(two)12(three).(four)5(five)",
            "(a;b)G0X12.5;c(d",
            "G0X1(2)2.5(open",
        ] {
            assert_eq!(printed(line).as_deref(), Ok("G0 X12.5"), "{line}");
        }
        assert_eq!(printed("X- 1").as_deref(), Ok("X-1"));
    }

    #[test]
    fn comments_do_not_nest() {
        fails("G0(a(b)c)X0", ErrorKind::MissingNumber, 8);
        fails("G0)X0", ErrorKind::UnexpectedByte(b')'), 2);
    }

    #[test]
    fn a_line_break_is_never_swallowed() {
        for (line, column) in [("G0\nG1", 2), ("G0;a\rG1", 4), ("G0(a\nb)G1", 4)] {
            let found = line.as_bytes()[column];
            fails(line, ErrorKind::UnexpectedByte(found), column);
        }
    }

    #[test]
    fn numbers_may_lack_digits_on_one_side_of_the_point() {
        assert_eq!(
            printed("X.5Y5.Z-.5A+1B-0C007").as_deref(),
            Ok("X0.5 Y5 Z-0.5 A1 B0 C7")
        );
    }

    #[test]
    fn numbers_have_no_exponent() {
        assert_eq!(printed("X1e2").as_deref(), Ok("X1 E2"));
    }

    #[test]
    fn a_leading_number_leaves_the_rest_of_the_text() {
        let read = |text: &'static str| crate::leading_number(text.as_bytes());
        let half = Number::from_nanos(-500_000_000);
        assert_eq!(read("-.5=x"), Ok((half, b"=x".as_slice())));
        assert_eq!(
            read("=1").map_err(|error| error.kind),
            Err(ErrorKind::MissingNumber)
        );
        assert_eq!(
            read("-").map_err(|error| error.kind),
            Err(ErrorKind::BadNumber)
        );
    }

    #[test]
    fn a_second_point_is_no_letter() {
        fails("X1.2.3", ErrorKind::UnexpectedByte(b'.'), 4);
    }

    #[test]
    fn a_letter_needs_a_number() {
        fails("G0X", ErrorKind::MissingNumber, 3);
        fails("GX0", ErrorKind::MissingNumber, 1);
        fails("G (open", ErrorKind::MissingNumber, 7);
    }

    #[test]
    fn a_number_needs_a_digit() {
        for line in ["X.", "X-", "X--1", "X+-1", "X-.", "X-Y1", "X. Y1"] {
            fails(line, ErrorKind::BadNumber, 1);
        }
    }

    #[test]
    fn digits_beyond_the_ninth_place_are_cut() {
        assert_eq!(
            printed("X0.1234567899Y-0.0000000009").as_deref(),
            Ok("X0.123456789 Y0")
        );
    }

    #[test]
    fn numbers_beyond_the_range_are_its_ends() {
        let largest = "9223372036.854775807";
        for line in [
            "X9223372036.8547758079",
            "X9223372036.854775808",
            "X9223372037",
            "X18446744073709551616",
            "X100000000000000000000",
        ] {
            assert_eq!(printed(line), Ok(format!("X{largest}")));
            let negative = line.replace('X', "X-");
            assert_eq!(printed(&negative), Ok(format!("X-{largest}")));
        }
    }

    #[test]
    fn what_is_no_letter_is_refused_with_its_column() {
        for byte in [
            b'%', b'*', b'/', b'#', b'@', b'[', b'{', b'`', 0x7f, 0x80, 0xef, 0xff,
        ] {
            let line = [b'G', b'0', byte, b'1'];
            let error = Error {
                kind: ErrorKind::UnexpectedByte(byte),
                column: 2,
            };
            assert_eq!(words(&line).last(), Some(Err(error)));
        }
    }

    #[test]
    fn one_slash_may_open_the_line() {
        assert_eq!(printed(" /G0").as_deref(), Ok("G0"));
        fails("//G0", ErrorKind::UnexpectedByte(b'/'), 1);
    }

    #[test]
    fn nothing_follows_an_error() {
        let mut words = words(b"G0%X1");
        assert!(matches!(words.next(), Some(Ok(_))));
        assert!(matches!(words.next(), Some(Err(_))));
        assert_eq!(words.next(), None);
    }

    /// Reads a decimal the obvious way: cuts the text apart, fills up with zeros, and lets `i128`
    /// read it.
    fn reference(sign: &str, whole: &str, fraction: &str) -> i128 {
        let nanos: String = fraction
            .chars()
            .chain("000000000".chars())
            .take(9)
            .collect();
        let magnitude: i128 = format!("0{whole}{nanos}").parse().unwrap();
        if sign == "-" {
            -magnitude
        } else {
            magnitude
        }
    }

    proptest! {
        #[test]
        fn numbers_are_what_i128_makes_of_them(
            sign in "[+-]?", whole in "[0-9]{1,12}", point in "\\.?", fraction in "[0-9]{0,12}",
        ) {
            let fraction = if point.is_empty() { "" } else { fraction.as_str() };
            let text = format!("X{sign}{whole}{point}{fraction}");
            let most = i128::from(i64::MAX);
            let expected = reference(&sign, &whole, fraction).clamp(-most, most);
            let found = read(&text).unwrap()[0].value().nanos();
            prop_assert_eq!(i128::from(found), expected);
        }

        #[test]
        fn plain_numbers_are_what_the_general_reader_makes_of_them(text in "[+-]?[0-9]{0,10}[.]?[0-9]{0,10}[X%( .]?") {
            if let Some((rest, value)) = plain_number(text.as_bytes()) {
                let (general_rest, general) = number(text.as_bytes()).unwrap();
                prop_assert_eq!((rest, value), (general_rest, general));
            }
        }

        #[test]
        fn no_bytes_make_it_panic_or_answer_a_column_off_the_line(line in any::<Vec<u8>>()) {
            for word in words(&line) {
                let column = word.map_or_else(|error| error.column, |word| word.column());
                prop_assert!(column <= line.len());
            }
        }

        #[test]
        fn no_line_of_likely_bytes_makes_it_panic(line in "[GXe0-9.+\\-();/%* \r\n]{0,40}") {
            for word in words(line.as_bytes()) {
                let column = word.map_or_else(|error| error.column, |word| word.column());
                prop_assert!(column <= line.len());
            }
        }

        #[test]
        fn a_word_stands_at_its_column(line in "([ ]?[A-Z][0-9]{1,3}(\\(c\\))?){0,8}") {
            for word in read(&line).unwrap() {
                prop_assert_eq!(line.as_bytes()[word.column()], word.letter() as u8 + b'A');
            }
        }

        #[test]
        fn printed_words_read_back(letter in 0..26_usize, nanos in any::<i64>()) {
            let text = format!("{}{}", Letter::ALL[letter], Number::from_nanos(nanos));
            let words = read(&text).unwrap();
            prop_assert_eq!(words[0].value(), Number::from_nanos(nanos));
            prop_assert_eq!(words[0].to_string(), text);
        }
    }
}
