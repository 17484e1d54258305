//! Realtime commands: single bytes that act at once, wherever they stand in the stream, unless they
//! are a part of a letter.

/// One step of an override.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum OverrideStep {
    /// Back to 100 %.
    Reset,
    /// 10 % more.
    CoarseUp,
    /// 10 % less.
    CoarseDown,
    /// 1 % more.
    FineUp,
    /// 1 % less.
    FineDown,
}

impl OverrideStep {
    /// Returns the override in percent after this step, kept within 10 to 200.
    pub fn apply(self, percent: u8) -> u8 {
        let stepped = match self {
            Self::Reset => 100,
            Self::CoarseUp => percent.saturating_add(10),
            Self::CoarseDown => percent.saturating_sub(10),
            Self::FineUp => percent.saturating_add(1),
            Self::FineDown => percent.saturating_sub(1),
        };
        stepped.clamp(10, 200)
    }
}

/// The three values of the rapid override.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum RapidOverride {
    /// 100 %.
    Full = 100,
    /// 50 %.
    Half = 50,
    /// 25 %.
    Quarter = 25,
}

impl RapidOverride {
    /// Returns the override in percent.
    pub const fn percent(self) -> u8 {
        self as u8
    }
}

/// A realtime command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Realtime {
    /// Soft reset, 0x18.
    Reset,
    /// Status report, `?`.
    Report,
    /// Feed hold, `!`.
    Hold,
    /// Cycle start and resume, `~`.
    Resume,
    /// Safety door, 0x84.
    Door,
    /// Jog cancel, 0x85.
    JogCancel,
    /// Feed override, 0x90 to 0x94.
    Feed(OverrideStep),
    /// Rapid override, 0x95 to 0x97.
    Rapid(RapidOverride),
    /// Spindle override, 0x99 to 0x9D.
    Spindle(OverrideStep),
    /// Spindle off in a hold, and on again, 0x9E.
    SpindleStop,
    /// Flood coolant on and off, 0xA0.
    Flood,
    /// Mist coolant on and off, 0xA1.
    Mist,
    /// A realtime byte of an extension, 0xF8 to 0xFF: no UTF-8 text has these bytes.
    Own(u8),
}

/// The meaning of a received byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Byte {
    /// A byte that is part of a line. For a letter outside ASCII it is [`LETTER`].
    Ordinary(u8),
    /// A realtime command.
    Realtime(Realtime),
    /// A byte that means nothing by itself: it is dropped.
    Unknown,
}

/// The byte that stands in a line for a letter outside ASCII. A comment may have it; any other line
/// that has it is refused.
pub const LETTER: u8 = 0x80;

/// The progress of a letter of several bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Letter {
    /// No letter is under way.
    None,
    /// 0xC2 has come, which senders that write UTF-8 put before each realtime byte.
    Prefix,
    /// Its first byte has come. This many may follow.
    Begun(u8),
    /// It stands in the line already. This many may follow.
    Kept(u8),
    /// 0xEF has come at the begin of a line: a byte order mark may follow.
    Mark,
    /// 0xEF and 0xBB have.
    HalfMark,
}

/// Sorts the bytes of one wire in the order in which they come. The text on it is UTF-8.
///
/// * Behind a first byte 0xC3 to 0xF4, the bytes 0x80 to 0xBF belong to that letter: no realtime
///   command is among them.
/// * 0xC2 and 0x80 to 0xA1 are the realtime command that the second byte is alone. So is a
///   no-break space (0xC2 0xA0), unless a line has begun: there it is a blank.
/// * A byte order mark at the begin of a line means nothing, nor does a first byte that no other
///   byte of a letter follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sorter {
    letter: Letter,
    /// The last byte of a line was not its end.
    in_line: bool,
}

impl Default for Sorter {
    fn default() -> Self {
        Self::new()
    }
}

impl Sorter {
    /// Begins with the first byte of a line.
    pub const fn new() -> Self {
        Self {
            letter: Letter::None,
            in_line: false,
        }
    }

    /// Sorts the next byte. Serial interrupt: a few instructions.
    #[inline]
    pub fn sort(&mut self, byte: u8) -> Byte {
        if byte >= 0x80 {
            return self.sort_high(byte);
        }
        self.letter = Letter::None;
        Byte::Realtime(match byte {
            0x18 => {
                self.in_line = false;
                Realtime::Reset
            }
            b'?' => Realtime::Report,
            b'!' => Realtime::Hold,
            b'~' => Realtime::Resume,
            _ => {
                self.in_line = !matches!(byte, b'\r' | b'\n');
                return Byte::Ordinary(byte);
            }
        })
    }

    fn sort_high(&mut self, byte: u8) -> Byte {
        let before = core::mem::replace(&mut self.letter, Letter::None);
        let letter = Byte::Ordinary(LETTER);
        let (next, meaning) = match (before, byte) {
            (Letter::Prefix, 0xa0) if self.in_line => (Letter::None, Byte::Ordinary(b' ')),
            (Letter::Prefix, 0xa2..=0xbf) => (Letter::None, letter),
            (Letter::Mark, 0xbb) => (Letter::HalfMark, Byte::Unknown),
            (Letter::HalfMark, 0xbf) => (Letter::None, Byte::Unknown),
            (Letter::HalfMark, 0x80..=0xbe) => (Letter::None, letter),
            (Letter::Mark, 0x80..=0xbf) => (Letter::Kept(1), letter),
            (Letter::Begun(left @ 1..), 0x80..=0xbf) => (Letter::Kept(left - 1), letter),
            (Letter::Kept(left @ 1..), 0x80..=0xbf) => (Letter::Kept(left - 1), Byte::Unknown),
            (_, 0xc2) => (Letter::Prefix, Byte::Unknown),
            (_, 0xef) if !self.in_line => (Letter::Mark, Byte::Unknown),
            (_, 0xc3..=0xdf) => (Letter::Begun(1), Byte::Unknown),
            (_, 0xe0..=0xef) => (Letter::Begun(2), Byte::Unknown),
            (_, 0xf0..=0xf4) => (Letter::Begun(3), Byte::Unknown),
            _ => (Letter::None, single(byte)),
        };
        self.letter = next;
        self.in_line |= meaning == letter;
        meaning
    }
}

/// The meaning of a byte from 0x80 on that belongs to no letter.
const fn single(byte: u8) -> Byte {
    use OverrideStep::{CoarseDown, CoarseUp, FineDown, FineUp, Reset};
    Byte::Realtime(match byte {
        0x84 => Realtime::Door,
        0x85 => Realtime::JogCancel,
        0x90 => Realtime::Feed(Reset),
        0x91 => Realtime::Feed(CoarseUp),
        0x92 => Realtime::Feed(CoarseDown),
        0x93 => Realtime::Feed(FineUp),
        0x94 => Realtime::Feed(FineDown),
        0x95 => Realtime::Rapid(RapidOverride::Full),
        0x96 => Realtime::Rapid(RapidOverride::Half),
        0x97 => Realtime::Rapid(RapidOverride::Quarter),
        0x99 => Realtime::Spindle(Reset),
        0x9a => Realtime::Spindle(CoarseUp),
        0x9b => Realtime::Spindle(CoarseDown),
        0x9c => Realtime::Spindle(FineUp),
        0x9d => Realtime::Spindle(FineDown),
        0x9e => Realtime::SpindleStop,
        0xa0 => Realtime::Flood,
        0xa1 => Realtime::Mist,
        0xf8..=0xff => Realtime::Own(byte),
        _ => return Byte::Unknown,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;
    use std::string::String;
    use std::vec::Vec;

    /// Sorts bytes that come one behind the other.
    fn sorted(bytes: &[u8]) -> Vec<Byte> {
        let mut sorter = Sorter::new();
        bytes.iter().map(|byte| sorter.sort(*byte)).collect()
    }

    fn alone(byte: u8) -> Byte {
        Sorter::new().sort(byte)
    }

    /// The text of a wire as the main loop gets it, and the realtime commands in it.
    fn text(bytes: &[u8]) -> (String, usize) {
        let (mut text, mut commands) = (String::new(), 0);
        for byte in sorted(bytes) {
            match byte {
                Byte::Ordinary(LETTER) => text.push('*'),
                Byte::Ordinary(byte) => text.push(byte.into()),
                Byte::Realtime(_) => commands += 1,
                Byte::Unknown => {}
            }
        }
        (text, commands)
    }

    #[test]
    fn these_bytes_alone_and_no_others_are_realtime_commands() {
        let is_command = |byte: &u8| matches!(alone(*byte), Byte::Realtime(_));
        let found: Vec<u8> = (0..=255).filter(is_command).collect();
        let mut expected = b"\x18!?~\x84\x85".to_vec();
        expected.extend((0x90..=0x97).chain(0x99..=0x9e).chain(0xa0..=0xa1));
        expected.extend(0xf8..=0xff); // an extension's
        assert_eq!(found, expected);
    }

    #[test]
    fn all_other_bytes_above_0x7f_vanish_alone() {
        for byte in 0..=255 {
            match alone(byte) {
                Byte::Ordinary(same) => assert!(same == byte && byte < 0x80),
                Byte::Unknown => assert!(byte >= 0x80),
                Byte::Realtime(_) => {}
            }
        }
    }

    #[test]
    fn a_command_with_the_prefix_of_utf_8_is_the_command_alone() {
        for byte in 0x80..=0xa1 {
            let expected = [Byte::Unknown, alone(byte)];
            assert_eq!(sorted(&[0xc2, byte]), expected, "{byte:x}");
            if byte != 0xa0 {
                assert_eq!(sorted(&[b'G', 0xc2, byte])[1..], expected, "{byte:x}");
            }
        }
    }

    /// Every character that a text can have, against Rust's own UTF-8.
    #[test]
    fn no_letter_of_any_script_holds_a_command_and_each_is_one_letter() {
        for letter in (0xa2..=u32::from(char::MAX)).filter_map(char::from_u32) {
            assert_eq!(text(format!("({letter})").as_bytes()), ("(*)".into(), 0));
            let first = text(format!("{letter}G").as_bytes());
            let expected = if letter == '\u{feff}' { "G" } else { "*G" };
            assert_eq!(first, (expected.into(), 0), "{letter}");
        }
    }

    #[test]
    fn a_no_break_space_is_a_blank_in_a_line_and_a_command_between_lines() {
        let cases: [(&[u8], &str, usize); 6] = [
            (b"G1\xc2\xa0X1\n", "G1 X1\n", 0),
            (b"\xc2\xa0G1\n", "G1\n", 1),
            (b"G1\r\xc2\xa0\n", "G1\r\n", 1),
            (b"G1?\xc2\xa0X1", "G1 X1", 1),
            (b"G1\x18\xc2\xa0X1", "G1X1", 2),
            (b"G1\xa0X1\n", "G1X1\n", 1),
        ];
        for (bytes, expected, commands) in cases {
            assert_eq!(text(bytes), (expected.into(), commands), "{bytes:x?}");
        }
    }

    #[test]
    fn a_letter_that_breaks_off_swallows_no_byte_behind_it() {
        let cases: [(&[u8], &str, usize); 8] = [
            (b"G0\xe9X0", "G0X0", 0), // as recorded
            (b"G0\xe2\x88X0", "G0*X0", 0),
            (b"G0\xe2\x88\x92\x91X0", "G0*X0", 1),
            (b"\xc3!\x84", "", 2),
            (b"\xc3\xc3\x84\x84", "*", 1),
            (b"\xc3\xc2\x84", "", 1),
            (b"\xc2\xc2\x84", "", 1),
            (b"\xf0\x9f\x99\x82\x84", "*", 1),
        ];
        for (bytes, expected, commands) in cases {
            assert_eq!(text(bytes), (expected.into(), commands), "{bytes:x?}");
        }
    }

    #[test]
    fn overrides_stay_between_10_and_200_percent() {
        use OverrideStep::*;
        let cases = [
            (195, CoarseUp, 200),
            (200, FineUp, 200),
            (15, CoarseDown, 10),
            (10, FineDown, 10),
            (100, CoarseUp, 110),
            (100, CoarseDown, 90),
            (100, FineUp, 101),
            (100, FineDown, 99),
            (10, Reset, 100),
            (255, CoarseUp, 200),
            (0, CoarseDown, 10),
        ];
        for (before, step, after) in cases {
            assert_eq!(step.apply(before), after, "{before} {step:?}");
        }
    }
}
