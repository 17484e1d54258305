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
