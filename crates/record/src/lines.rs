//! A record as lines of text, which go over a serial line.
//!
//! ```text
//!   00004C53421F
//!   |   |     |
//!   |   |     a byte that makes the sum of all bytes 0, modulo 256
//!   |   1 to 16 bytes of the record
//!   their place in the record, high byte first
//! ```

use crate::{Setting, FIXED, SETTINGS};

/// Bytes of the longest record.
pub const LONGEST: usize = FIXED + SETTINGS * size_of::<Setting>();

/// The most bytes of a record in one line.
pub const PART: usize = 16;

/// Bytes of a line besides its part of the record: the place in front, and the checksum behind.
const PLACE: usize = 2;
const SUM: usize = 1;

/// The part of a record whose lines have come.
pub struct Incoming {
    bytes: [u8; LONGEST],
    length: usize,
}

/// The error of a line that is damaged, or that is not the next line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct WrongLine;

impl Incoming {
    /// Begins before any line has come.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            bytes: [0; LONGEST],
            length: 0,
        }
    }

    /// Takes the next line. A line with the first bytes of a record begins anew.
    ///
    /// # Errors
    /// The line is damaged, or it is not the next one, or the record is longer than [`LONGEST`].
    pub fn take(&mut self, line: &[u8]) -> Result<(), WrongLine> {
        let mut bytes = [0; PLACE + PART + SUM];
        let bytes = decode(line, &mut bytes).ok_or(WrongLine)?;
        let sum = bytes
            .iter()
            .fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
        let ([high, low, part @ .., _], 0) = (bytes, sum) else {
            return Err(WrongLine);
        };
        let place = usize::from(u16::from_be_bytes([*high, *low]));
        if place == 0 {
            *self = Self::new();
        }
        let end = place + part.len();
        if place != self.length || part.is_empty() {
            return Err(WrongLine);
        }
        let room = self.bytes.get_mut(place..end).ok_or(WrongLine)?;
        room.copy_from_slice(part);
        self.length = end;
        Ok(())
    }

    /// Returns the bytes that have come so far.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }
}

impl Default for Incoming {
    fn default() -> Self {
        Self::new()
    }
}

/// The bytes of pairs of hexadecimal digits.
fn decode<'a>(digits: &[u8], bytes: &'a mut [u8]) -> Option<&'a [u8]> {
    let (pairs, []) = digits.as_chunks::<2>() else {
        return None;
    };
    let bytes = bytes.get_mut(..pairs.len())?;
    for (byte, [high, low]) in bytes.iter_mut().zip(pairs) {
        *byte = digit(*high)? << 4 | digit(*low)?;
    }
    Some(bytes)
}

fn digit(letter: u8) -> Option<u8> {
    char::from(letter).to_digit(16).map(|digit| digit as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_taken_in_their_order_and_whole() {
        let mut incoming = Incoming::new();
        assert_eq!(incoming.take(b"00004C53421F"), Ok(()));
        assert_eq!(incoming.take(b"000352AB"), Ok(()));
        assert_eq!(incoming.bytes(), b"LSBR");
        for wrong in [
            "000352AB",
            "000552A9",
            "00045",
            "0004FX",
            "",
            "000001",
            "0009",
            "000452ABAB",
        ] {
            assert_eq!(incoming.take(wrong.as_bytes()), Err(WrongLine), "{wrong}");
        }
        assert_eq!(incoming.bytes(), b"LSBR");
        assert_eq!(incoming.take(b"00004CB4"), Ok(()));
        assert_eq!(incoming.bytes(), b"L");
    }
}
