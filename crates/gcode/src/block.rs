//! Blocks: all that one line says, in one value.

use core::fmt;

use heapless::Vec;

use crate::{line, words, Error, ErrorKind, Letter, Number, Word};

/// The number of words that [`parse`] has room for: the whole alphabet and six more G or M words.
pub const DEFAULT_WORDS: usize = 32;

/// The words of one line, at most `N` of them, and the marks around them.
///
/// Blocks are equal when they have the same words and marks. The places of the words do not count.
/// The checksum does not count either: it guards the bytes of a line on their way, and has done its
/// work once the line is read.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Block<const N: usize = DEFAULT_WORDS> {
    words: Vec<Word, N>,
    deleted: bool,
    demarcation: bool,
    checksum: Option<u8>,
}

/// Reads a line, given without its line end, into a block of the default size.
///
/// # Errors
///
/// The first fault from the left, see [`ErrorKind`]. A line whose checksum is wrong is an error,
/// too: nothing on it can be trusted.
pub fn parse(line: &[u8]) -> Result<Block, Error> {
    Block::parse(line)
}

impl<const N: usize> Block<N> {
    /// Reads a line into a block with room for `N` words. See [`parse`].
    ///
    /// # Errors
    ///
    /// As [`parse`].
    pub fn parse(line: &[u8]) -> Result<Self, Error> {
        let (_, deleted) = line::block_delete(line);
        let mut block = Self {
            words: Vec::new(),
            deleted,
            demarcation: false,
            checksum: None,
        };
        for word in words(line) {
            match word {
                Ok(word) => block.push(word)?,
                Err(error) => return block.end(line, error),
            }
        }
        Ok(block)
    }

    /// Returns the words from left to right, the line number among them.
    pub fn words(&self) -> &[Word] {
        &self.words
    }

    /// Returns the line number: the value of the first N word. It is not checked, and may be
    /// negative or have a fraction.
    pub fn line_number(&self) -> Option<Number> {
        self.words
            .iter()
            .find(|word| word.letter() == Letter::N)
            .map(Word::value)
    }

    /// Returns whether a `/` opens the line: a machine with block delete switched on skips such
    /// lines.
    pub fn is_deleted(&self) -> bool {
        self.deleted
    }

    /// Returns whether the line is a lone `%`, which opens and closes a program.
    pub fn is_demarcation(&self) -> bool {
        self.demarcation
    }

    /// Returns the checksum that ended the line, if there was one. [`parse`] has compared it with
    /// the line.
    pub fn checksum(&self) -> Option<u8> {
        self.checksum
    }

    fn push(&mut self, word: Word) -> Result<(), Error> {
        let column = word.column();
        self.words.push(word).map_err(|_| Error {
            kind: ErrorKind::TooManyWords,
            column,
        })
    }

    /// Reads the `%` or the checksum that ends the words. Returns `error` if neither is there.
    fn end(mut self, line: &[u8], error: Error) -> Result<Self, Error> {
        let (before, rest) = line.split_at_checked(error.column).unwrap_or((line, &[]));
        let bare = self.words.is_empty() && !self.deleted;
        if error.kind == ErrorKind::UnexpectedByte(b'*') {
            self.checksum = Some(verified_checksum(before, rest)?);
        } else if error.kind == ErrorKind::UnexpectedByte(b'%')
            && bare
            && line::is_demarcation(rest)
        {
            self.demarcation = true;
        } else {
            return Err(error);
        }
        Ok(self)
    }
}

/// Reads the checksum at the start of `rest` and compares it with the checksum of the bytes
/// `before` it.
fn verified_checksum(before: &[u8], rest: &[u8]) -> Result<u8, Error> {
    let (_, stated) =
        line::checksum(rest).map_err(|error| line::locate(error, before.len() + rest.len()))?;
    let computed = before.iter().fold(0, |sum, byte| sum ^ byte);
    if stated == computed {
        Ok(stated)
    } else {
        Err(Error {
            kind: ErrorKind::ChecksumMismatch { stated, computed },
            column: before.len(),
        })
    }
}

impl<const N: usize> PartialEq for Block<N> {
    fn eq(&self, other: &Self) -> bool {
        (&self.words, self.deleted, self.demarcation)
            == (&other.words, other.deleted, other.demarcation)
    }
}

impl<const N: usize> Eq for Block<N> {}

impl<const N: usize> fmt::Display for Block<N> {
    /// Writes a line that reads back as an equal block: words one space apart, without comments and
    /// checksum.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.demarcation {
            return f.write_str("%");
        }
        f.write_str(if self.deleted { "/" } else { "" })?;
        for (index, word) in self.words.iter().enumerate() {
            write!(f, "{}{word}", if index == 0 { "" } else { " " })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::string::string_regex;
    use std::format;
    use std::string::{String, ToString};
    use std::vec::Vec;

    fn fails(line: &[u8], kind: ErrorKind, column: usize) {
        assert_eq!(
            parse(line),
            Err(Error { kind, column }),
            "{}",
            line.escape_ascii()
        );
    }

    #[test]
    fn the_line_number_is_found_and_stays_a_word() {
        let block = parse(b"N120 G1 X1").unwrap();
        assert_eq!(block.line_number(), Some(Number::from_int(120)));
        assert_eq!(block.words().len(), 3);
        assert_eq!(parse(b"G1").unwrap().line_number(), None);
    }

    #[test]
    fn a_slash_at_the_start_deletes_the_block() {
        assert!(parse(b" /G0 X1").unwrap().is_deleted());
        assert!(parse(b"/").unwrap().is_deleted());
        assert!(!parse(b"G0").unwrap().is_deleted());
        fails(b"G0/X1", ErrorKind::UnexpectedByte(b'/'), 2);
    }

    #[test]
    fn a_deleted_block_prints_its_slash_even_without_words() {
        for line in ["/", "/G0 X1"] {
            assert_eq!(parse(line.as_bytes()).unwrap().to_string(), line);
        }
    }

    #[test]
    fn only_a_lone_percent_sign_is_a_demarcation() {
        assert!(parse(b" % (program)").unwrap().is_demarcation());
        assert!(!parse(b"").unwrap().is_demarcation());
        fails(b"%1", ErrorKind::UnexpectedByte(b'%'), 0);
        fails(b"/%", ErrorKind::UnexpectedByte(b'%'), 1);
        fails(b"G0%", ErrorKind::UnexpectedByte(b'%'), 2);
        fails(b"X%", ErrorKind::MissingNumber, 1);
        fails(b"X*5", ErrorKind::MissingNumber, 1);
    }

    #[test]
    fn a_right_checksum_is_accepted() {
        let block = parse(b"N3 T0*57").unwrap(); // the example of the RepRap wiki, "G-code", section "Checksum"
        assert_eq!(block.checksum(), Some(57));
        assert_eq!(block, parse(b"N3 T0").unwrap());
        assert_eq!(
            parse(b"N3 T0* 57 ;sent twice").unwrap().checksum(),
            Some(57)
        );
    }

    #[test]
    fn a_garbled_line_is_refused() {
        fails(
            b"N3 T1*57",
            ErrorKind::ChecksumMismatch {
                stated: 57,
                computed: 56,
            },
            5,
        );
    }

    #[test]
    fn a_checksum_is_one_byte_and_ends_the_line() {
        for line in [
            b"N3*".as_slice(),
            b"N3*256",
            b"N3*x",
            b"N3*-1",
            b"N3*53X1",
            b"N3*53*53",
        ] {
            fails(line, ErrorKind::BadChecksum, 2);
        }
    }

    #[test]
    fn a_word_too_many_is_named_by_its_column() {
        assert!(Block::<2>::parse(b"G0 X1").is_ok());
        let error = Error {
            kind: ErrorKind::TooManyWords,
            column: 6,
        };
        assert_eq!(Block::<2>::parse(b"G0 X1 Y1"), Err(error));
    }

    #[test]
    fn of_two_faults_the_left_one_is_named() {
        fails(b"G0 X %", ErrorKind::MissingNumber, 5);
        fails(b"G0 % X", ErrorKind::UnexpectedByte(b'%'), 3);
    }

    /// Lines as people and programs write them, with gaps, comments and marks.
    fn any_line() -> impl Strategy<Value = String> {
        let word =
            r"[A-Za-z] ?[+-]?([0-9]{1,9}(\.[0-9]{0,12})?|\.[0-9]{1,9})[ \t]?(\([^)\r\n]{0,5}\))?";
        let line = format!("[ \t]?/?({word}){{0,{DEFAULT_WORDS}}}(;[^\r\n]{{0,5}})?");
        prop_oneof![1 => " ?%[ \t]?", 9 => string_regex(&line).unwrap()]
    }

    proptest! {
        #[test]
        fn a_printed_block_reads_back_as_itself(line in any_line()) {
            let block = parse(line.as_bytes()).unwrap();
            prop_assert_eq!(parse(block.to_string().as_bytes()), Ok(block));
        }

        #[test]
        fn no_bytes_make_it_panic(line in any::<Vec<u8>>()) {
            if let Err(error) = parse(&line) {
                prop_assert!(error.column <= line.len());
            }
        }

        #[test]
        fn any_single_flipped_bit_breaks_the_checksum(bit in 0..8_u32, at in 0..21_usize) {
            let mut line = b"G1X12.345Y-6.789F1500".to_vec();
            let sum = line.iter().fold(0, |sum, byte| sum ^ byte);
            line[at] ^= 1 << bit;
            line.extend(format!("*{sum}").bytes());
            prop_assert!(!parse(&line).is_ok_and(|block| block.checksum().is_some()));
        }
    }
}
