//! Bytes to lines: Grbl's filter.
//!
//! The filter drops bytes up to 0x20, `/`, and comments in parentheses or behind `;`. A `/` behind a
//! `[` divides and stays in a build with the feature `linuxcnc`: Grbl has an error for such a line.
//! Small letters become capitals. CR and LF each end a line. Comments do not nest: inside `( )` a
//! `;` is text, behind `;` a `(` is. A `(` left open lasts to the end of the line; a `)` without a
//! `(` stays, and the interpreter refuses it. So does a [`LETTER`] outside comments. `$` lines are
//! filtered in the same way.
//!
//! Nearly all bytes of a job are capitals, digits, `.` and `-`: they take one look-up and one
//! store.

use super::realtime::{Byte, Sorter, LETTER};
use super::status::Status;
use heapless::Vec;

/// The longest line of Grbl, in characters after filtering.
pub const GRBL_LINE_LENGTH: usize = 79;

/// The text that the filter is passing over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Skip {
    Nothing,
    /// Up to the `)`.
    Parentheses,
    /// Up to the end of the line: behind a `;`, or because the line is too long already.
    Rest,
}

/// True if expressions are kept whole.
const CALCULATES: bool = cfg!(feature = "linuxcnc");

/// The kind of a line, which the reader knows at its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// A line without a comment.
    Plain,
    /// A line with a comment.
    Commented,
    /// No line: its begin was dropped.
    Torn,
}

/// For each byte, the byte that it becomes outside comments; 0 for one that is dropped or takes a
/// closer look.
const KEPT: [u8; 256] = {
    let mut kept = [0; 256];
    let mut byte = 0x21;
    while byte < 0x80 {
        if !matches!(byte, b'/' | b'(' | b';') {
            kept[byte as usize] = byte.to_ascii_uppercase();
        }
        byte += 1;
    }
    kept[LETTER as usize] = LETTER;
    kept
};

/// Returns the byte that a byte becomes outside comments: 0 for blanks, for the start of a comment,
/// and for bytes that are never part of a line.
#[inline]
fn kept(byte: u8) -> u8 {
    KEPT.get(usize::from(byte)).copied().unwrap_or(0)
}

impl Skip {
    /// Returns the text to pass over after this byte, which is not the end of the line.
    fn after(self, byte: u8) -> Self {
        match (self, byte) {
            (Self::Nothing, b'(') => Self::Parentheses,
            (Self::Nothing, b';') => Self::Rest,
            (Self::Parentheses, b')') => Self::Nothing,
            (Self::Nothing | Self::Parentheses | Self::Rest, _) => self,
        }
    }
}

/// The place of the next character while none is kept: beyond every line.
const NOWHERE: usize = usize::MAX;

/// Collects one line at a time, at most `CAPACITY` characters of it.
///
/// The main loop pushes bytes until a line is complete, deals with [`line`](Self::line) for as long
/// as that takes, then calls [`clear`](Self::clear) and goes on.
#[derive(Debug, Clone)]
pub struct LineReader<const CAPACITY: usize> {
    line: [u8; CAPACITY],
    /// The next character's place: [`NOWHERE`] while something is passed over, which spares each
    /// byte a test.
    next: usize,
    /// The number of characters that were kept before the text that is passed over.
    kept: usize,
    limit: usize,
    skip: Skip,
    too_long: bool,
    /// The comment of the last line that has one.
    comment: Vec<u8, COMMENT>,
    /// The kind of the line that is being read, by the bytes so far.
    end: End,
    /// The kind of the line that was completed last.
    last: End,
}

/// The most that is kept of a comment, in bytes.
pub const COMMENT: usize = 48;

impl<const CAPACITY: usize> LineReader<CAPACITY> {
    /// Makes a reader that refuses lines of more than `limit` characters, and of more than
    /// `CAPACITY` in any case.
    pub const fn new(limit: usize) -> Self {
        Self {
            line: [0; CAPACITY],
            next: 0,
            kept: 0,
            limit,
            skip: Skip::Nothing,
            too_long: false,
            comment: Vec::new(),
            end: End::Plain,
            last: End::Plain,
        }
    }

    /// Sets the number of characters beyond which a line is refused. Between lines.
    pub fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// Takes a byte; returns whether it completed a line. Main loop.
    #[inline]
    pub fn push(&mut self, byte: u8) -> bool {
        let kept = kept(byte);
        let next = self.next;
        match self.line.get_mut(next) {
            Some(place) if kept != 0 => {
                *place = kept;
                self.next = next + 1;
                false
            }
            Some(_) | None => self.pass_over(byte),
        }
    }

    /// Returns the line as far as it has come.
    ///
    /// # Errors
    ///
    /// [`Status::LineTooLong`]: nothing of the line can be used.
    pub fn line(&self) -> Result<&[u8], Status> {
        if self.too_long || self.length() > self.limit {
            return Err(Status::LineTooLong);
        }
        Ok(self.line.get(..self.length()).unwrap_or(&[]))
    }

    /// Returns whether nothing has been kept of the line so far.
    pub fn is_empty(&self) -> bool {
        self.length() == 0
    }

    /// Returns whether a part of a line has come, comments count.
    pub(crate) fn has_begun(&self) -> bool {
        !self.is_empty() || self.skip != Skip::Nothing || self.end != End::Plain
    }

    /// Forgets the line, to begin the next: after it has been answered, and at a reset.
    pub fn clear(&mut self) {
        self.next = 0;
        self.skip = Skip::Nothing;
        self.too_long = false;
        self.end = End::Plain;
    }

    /// Forgets the line under way and the rest of it that is still to come: nobody is to carry out
    /// a line from its middle. After a reset that was not its sender's.
    pub fn tear(&mut self) {
        self.clear();
        self.kept = 0;
        self.next = NOWHERE;
        self.skip = Skip::Rest;
        self.end = End::Torn;
    }

    /// Returns the comment of the line that was completed last, as far as there is room for it:
    /// between `(` and `)`, or behind `;`.
    pub fn comment(&self) -> &str {
        match self.last {
            End::Commented => core::str::from_utf8(&self.comment).unwrap_or_default(),
            End::Plain | End::Torn => "",
        }
    }

    fn note_comment(&mut self, byte: u8) {
        match (self.skip, byte) {
            (Skip::Nothing, b'(' | b';') => {
                self.comment.clear();
                self.end = End::Commented;
            }
            (Skip::Parentheses, b')') | (Skip::Nothing, _) => {}
            (Skip::Parentheses | Skip::Rest, b' '..=b'~')
                if !self.too_long && self.end == End::Commented =>
            {
                let _full = self.comment.push(byte);
            }
            (Skip::Parentheses | Skip::Rest, _) => {}
        }
    }

    fn length(&self) -> usize {
        match self.skip {
            Skip::Nothing => self.next,
            Skip::Parentheses | Skip::Rest => self.kept,
        }
    }

    /// Ends the line under way; returns whether it is one.
    fn end_line(&mut self) -> bool {
        if self.end == End::Torn {
            self.clear();
            return false;
        }
        self.last = self.end;
        true
    }

    /// Returns true if a `/` that comes next divides: not in a `$` line.
    fn divides(&self) -> bool {
        let line = self.line.get(..self.length()).unwrap_or(&[]);
        CALCULATES && line.contains(&b'[') && !line.starts_with(b"$")
    }

    #[cold]
    fn pass_over(&mut self, byte: u8) -> bool {
        if is_line_end(byte) {
            return self.end_line();
        }
        self.note_comment(byte);
        let divides = self.skip == Skip::Nothing && byte == b'/' && self.divides();
        match self.line.get_mut(self.next) {
            Some(place) if divides => {
                *place = byte;
                self.next += 1;
                return false;
            }
            Some(_) | None => {}
        }
        let is_full = self.skip == Skip::Nothing && (divides || kept(byte) != 0);
        self.too_long |= is_full;
        self.kept = self.length();
        self.skip = if is_full {
            Skip::Rest
        } else {
            self.skip.after(byte)
        };
        self.next = match self.skip {
            Skip::Nothing => self.kept,
            Skip::Parentheses | Skip::Rest => NOWHERE,
        };
        false
    }
}

/// Finds where the character at `column` of a filtered line stands in the line as it was sent, for
/// a front end that wants to point at a fault. Returns the length of `raw` for a column beyond the
/// end.
pub fn raw_column(raw: &[u8], column: usize) -> usize {
    let mut skip = Skip::Nothing;
    let (mut sorter, mut ahead) = (Sorter::new(), column);
    let (mut first, mut divides) = (None, false);
    for (index, &byte) in raw.iter().enumerate() {
        let Byte::Ordinary(byte) = sorter.sort(byte) else {
            continue;
        };
        // A letter counts from its second byte on, and begins with its first.
        let index = index - usize::from(byte == LETTER && index > 0);
        let is_divisor = byte == b'/' && divides;
        let is_kept = skip == Skip::Nothing && (is_divisor || kept(byte) != 0);
        skip = skip.after(byte);
        if is_kept {
            let first = *first.get_or_insert(byte);
            divides |= CALCULATES && byte == b'[' && first != b'$';
        }
        match (is_kept, ahead) {
            (true, 0) => return index,
            (true, _) => ahead -= 1,
            (false, _) => {}
        }
    }
    raw.len()
}

pub(crate) const fn is_line_end(byte: u8) -> bool {
    matches!(byte, b'\r' | b'\n')
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::borrow::ToOwned;
    use std::string::{String, ToString};
    use std::vec::Vec;

    /// All complete lines of a text, with Grbl's limit.
    fn lines(text: &[u8]) -> Vec<Result<String, Status>> {
        let mut reader = LineReader::<128>::new(GRBL_LINE_LENGTH);
        let mut lines = Vec::new();
        for byte in text {
            if reader.push(*byte) {
                let line = reader.line();
                lines.push(line.map(|line| line.iter().map(|byte| char::from(*byte)).collect()));
                reader.clear();
            }
        }
        lines
    }

    fn line(text: &str) -> String {
        let mut all = lines((text.to_string() + "\n").as_bytes());
        assert_eq!(all.len(), 1);
        all.remove(0).unwrap()
    }

    #[test]
    fn a_reader_without_room_takes_empty_lines_and_refuses_each_other() {
        let mut reader = LineReader::<0>::new(usize::MAX);
        for (text, taken) in [
            ("\n", true),
            ("G\n", false),
            ("( G0 )\n", true),
            ("G0X1\n", false),
        ] {
            let ends = text.bytes().filter(|byte| reader.push(*byte)).count();
            assert_eq!((ends, reader.line().is_ok()), (1, taken), "{text}");
            reader.clear();
        }
    }

    #[test]
    fn blanks_slashes_and_comments_are_dropped_and_letters_become_capitals() {
        let cases = [
            ("g0 x1.5 y-2", "G0X1.5Y-2"),
            ("G/0X/0", "G0X0"),
            ("G0\x0b\x0c\x01X0", "G0X0"),
            ("\0", ""),
            ("(only a comment)", ""),
            ("/", ""),
            ("G0(a(b)c)X0", "G0C)X0"),
            ("G0(a;b)X0", "G0X0"),
            ("G0;(a\tX0)", "G0"),
            ("G0(open X0", "G0"),
            ("G0)X0", "G0)X0"),
            ("%*#@", "%*#@"),
            ("G\x7f0", "G\x7f0"),
            ("$ $", "$$"),
            ("$(x)G", "$G"),
            ("/$G", "$G"),
            ("$ 1 0 = 1", "$10=1"),
            ("$I=Hello World", "$I=HELLOWORLD"),
        ];
        for (raw, filtered) in cases {
            assert_eq!(line(raw), filtered, "{raw:?}");
        }
    }

    #[test]
    fn cr_and_lf_each_end_a_line() {
        assert_eq!(lines(b"G0\r\n\n\rG1\r").len(), 5);
        assert_eq!(lines(b"(a\nG0\n"), [Ok("".into()), Ok("G0".into())]);
    }

    #[test]
    fn a_line_of_79_characters_passes_and_one_of_80_is_refused_once() {
        let fits = "X".repeat(79);
        assert_eq!(line(&fits), fits);
        assert_eq!(line(&(fits.clone() + " ( and a comment )")), fits);
        for length in [80, 128, 129, 500] {
            let mut text = "$".repeat(length).into_bytes();
            text.extend(b"\nG0\n");
            assert_eq!(lines(&text), [Err(Status::LineTooLong), Ok("G0".into())]);
        }
    }

    #[test]
    fn of_bytes_above_0x7f_only_a_letter_gets_into_a_line_and_none_from_a_comment() {
        assert_eq!(lines(b"G0\x81\xff\xc2X1\n"), [Ok("G0X1".into())]);
        assert_eq!(lines(b"G0(\x80)X1;\x80\n"), [Ok("G0X1".into())]);
        let mut reader = LineReader::<8>::new(8);
        b"G\x80".iter().for_each(|byte| {
            reader.push(*byte);
        });
        assert_eq!(reader.line(), Ok(&[b'G', LETTER][..]));
    }

    #[test]
    fn a_cleared_reader_starts_afresh() {
        let mut reader = LineReader::<8>::new(8);
        for byte in b"123456789(" {
            reader.push(*byte);
        }
        reader.clear();
        assert!(reader.is_empty());
        reader.push(b'x');
        assert_eq!(reader.line(), Ok(b"X".as_slice()));
    }

    #[test]
    fn of_a_torn_line_nothing_is_left_and_the_next_is_whole() {
        for rest in ["", "X1(", "(X1)F5 ;", &"X".repeat(200)] {
            let mut reader = LineReader::<8>::new(8);
            reader.push(b'G');
            reader.tear();
            assert!(reader.has_begun());
            for byte in rest.bytes().chain(*b"\n") {
                assert!(!reader.push(byte) && reader.is_empty(), "{rest}");
            }
            assert!(b"G0\n".iter().any(|byte| reader.push(*byte)));
            assert_eq!(reader.line(), Ok(b"G0".as_slice()));
        }
    }

    #[test]
    fn a_column_is_found_in_the_raw_line() {
        let raw = b" g0 (move) /x1?\xc2y2";
        let find = |column| raw[raw_column(raw, column)];
        assert_eq!([0, 1, 2, 3, 4, 5].map(find), *b"g0x1y2");
        assert_eq!(raw_column(raw, 6), raw.len());
        let raw = "(\u{e4}) X\u{a0}\u{2212}1".as_bytes();
        let find = |column| &raw[raw_column(raw, column)..];
        assert_eq!(find(0)[0], b'X');
        assert!(find(1).starts_with("\u{2212}".as_bytes()));
        assert_eq!(find(2), b"1");
    }

    /// The obvious filter: the text of the line cut into pieces, at its comments and at the place
    /// at which its first expression begins.
    fn reference(text: &str) -> String {
        let mut rest = text;
        let mut kept = String::new();
        while let Some(start) = rest.find(['(', ';']) {
            kept += &rest[..start];
            let end = rest[start..]
                .find(')')
                .filter(|_| rest[start..].starts_with('('));
            rest = end.map_or("", |end| &rest[start + end + 1..]);
        }
        kept += rest;
        kept.retain(|letter| letter > ' ');
        let expressions = kept.find('[').filter(|_| cfg!(feature = "linuxcnc"));
        let (plain, calculated) = kept.split_at(expressions.unwrap_or(kept.len()));
        let plain = plain.replace('/', "");
        let calculated = match plain.starts_with('$') {
            true => calculated.replace('/', ""),
            false => calculated.to_owned(),
        };
        (plain + &calculated).to_ascii_uppercase()
    }

    proptest! {
        #[test]
        fn lines_are_what_the_obvious_filter_leaves(text in "[ -~\t]{0,79}") {
            prop_assert_eq!(line(&text), reference(&text));
        }

        #[test]
        fn every_kept_character_has_its_raw_column(text in "[ -~]{0,60}") {
            let raw = text.replace(['?', '!', '~'], "");
            let filtered = line(&raw);
            for (column, character) in filtered.bytes().enumerate() {
                let at = raw_column(raw.as_bytes(), column);
                prop_assert_eq!(raw.as_bytes()[at].to_ascii_uppercase(), character);
            }
        }

        #[test]
        fn every_line_end_completes_exactly_one_line(text in prop::collection::vec(any::<u8>(), 0..400)) {
            let ends = text.iter().filter(|byte| is_line_end(**byte)).count();
            prop_assert_eq!(lines(&text).len(), ends);
        }
    }

    #[test]
    fn the_comment_of_a_line_is_kept_until_the_next_line_has_ended() {
        let mut reader = LineReader::<128>::new(GRBL_LINE_LENGTH);
        for (text, comment) in [
            ("M6 T3 (0.8 mm drill)\n", "0.8 mm drill"),
            ("G0\n", ""),
            ("M6 T3 ; 1.0 mm (PTH)\r", " 1.0 mm (PTH)"),
            ("(one)(two) G1\n", "two"),
        ] {
            text.bytes().for_each(|byte| {
                reader.push(byte);
            });
            reader.clear();
            assert_eq!(reader.comment(), comment, "{text:?}");
        }
    }
}
