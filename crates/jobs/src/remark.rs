//! Likely mistakes that the machine accepts: comments that do not end, bytes that act at once,
//! settings in a job, lines after its end.

use leadscrew_machine::protocol::realtime::{Byte, Realtime, Sorter};

/// The effects of a line besides its motion.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct Done {
    /// It paused for the operator (M0, M6).
    pub paused: bool,
    /// It ended the program (M2, M30).
    pub ended: bool,
    /// The machine refuses it if motion goes on, and nothing has waited for the end of motion.
    pub in_motion: bool,
}

/// The subject of a remark.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Remark {
    /// A `(` without a `)`: the rest of the line is a comment.
    UnclosedComment,
    /// A byte that does not occur in G-code.
    OddByte,
    /// A byte that acts at once, wherever it stands.
    Realtime(Realtime),
    /// A line that changes a setting of the machine permanently.
    Setting,
    /// A line after M2 or M30: senders send it nevertheless.
    AfterEnd,
    /// A place outside the travel; soft limits are off and would not stop it.
    OutsideTravel,
    /// A line that the machine refuses in motion, and motion may go on.
    InMotion,
    /// The job ends with the laser lit at rest.
    LeftOn,
    /// S above full power.
    AboveFullPower,
    /// No S above 255, and full power is 1000 or more.
    EightBitPower,
    /// S, but no M3 or M4.
    PowerWithoutStart,
    /// M3 or M4, but no S.
    StartWithoutPower,
    /// A feed that the axes do not reach.
    AboveRate,
    /// A move onto a home switch, in machine coordinates.
    OntoSwitch,
    /// Filament is fed, and the job has not heated the nozzle.
    ColdNozzle,
    /// A dwell of minutes: its P is in seconds.
    LongDwell,
}

impl Remark {
    /// Returns the name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::UnclosedComment => "unclosed_comment",
            Self::OddByte => "odd_byte",
            Self::Realtime(_) => "realtime_byte",
            Self::Setting => "setting",
            Self::AfterEnd => "after_end",
            Self::OutsideTravel => "outside_travel",
            Self::InMotion => "in_motion",
            Self::LeftOn => "left_on",
            Self::AboveFullPower => "above_full_power",
            Self::EightBitPower => "eight_bit_power",
            Self::PowerWithoutStart => "power_without_start",
            Self::StartWithoutPower => "start_without_power",
            Self::AboveRate => "above_rate",
            Self::OntoSwitch => "onto_switch",
            Self::ColdNozzle => "cold_nozzle",
            Self::LongDwell => "long_dwell",
        }
    }

    /// Returns the short text.
    pub fn message(self) -> &'static str {
        match self {
            Self::UnclosedComment => "a comment is not closed",
            Self::OddByte => "a byte that is no G-code",
            Self::Realtime(command) => effect(command),
            Self::Setting => "the job changes a setting of the machine",
            Self::AfterEnd => "the program has ended before",
            Self::OutsideTravel => "outside the travel",
            Self::InMotion => "the machine may still be moving",
            Self::LeftOn => "the job ends with the laser on",
            Self::AboveFullPower => "S is above full power",
            Self::EightBitPower => "no S is above 255",
            Self::PowerWithoutStart => "S without M3 or M4",
            Self::StartWithoutPower => "M3 or M4 without S",
            Self::AboveRate => "the feed is above what the axes reach",
            Self::OntoSwitch => "the move leads onto a home switch",
            Self::ColdNozzle => "the job does not heat the nozzle",
            Self::LongDwell => "a long dwell",
        }
    }

    /// Returns the meaning of the remark.
    pub fn explanation(self) -> &'static str {
        match self {
            Self::UnclosedComment => "All that follows the ( in this line is taken for comment.",
            Self::OddByte => {
                "What looks like a blank, a minus or a digit may be another character."
            }
            Self::Realtime(_) => {
                "The byte is no text, not even in a comment: it acts as soon as it is received. \
                 Leave it out, or use a sender that leaves comments out."
            }
            Self::Setting => {
                "It stays changed after the job. In motion the machine refuses it: error:8."
            }
            Self::AfterEnd => "M2 and M30 end the program; senders send what follows all the same.",
            Self::OutsideTravel => "Soft limits ($20) are off: the machine would run into its end.",
            Self::InMotion => {
                "In motion the machine refuses the line: error:8, or error:9 in a jog. `G4 P0` \
                 waits for the end of motion; for the end of a jog the sender has to wait."
            }
            Self::LeftOn => "At rest the laser burns on one place. End the job with M5 or M2.",
            Self::AboveFullPower => "The machine takes full power, $30, in its place.",
            Self::EightBitPower => {
                "If the program counts full power as 255, set $30=255, or have it write S up to $30."
            }
            Self::PowerWithoutStart => {
                "The spindle or laser stays off. Put M3, or M4 for a laser, before the first cut."
            }
            Self::StartWithoutPower => "The spindle or laser stays off. Give it S, such as M3 S500.",
            Self::AboveRate => "The axes move at their own rates, $110 to $115, and the job takes longer.",
            Self::OntoSwitch => {
                "With hard limits ($21) the switch stops the machine: ALARM:1. Stay away from it, as \
                 in G53 Z-5, or store a place for G28 with G28.1."
            }
            Self::ColdNozzle => {
                "The machine refuses E while the nozzle is cold: error:220. Put M109 before the first E."
            }
            Self::LongDwell => "P is in seconds. Some controllers count milliseconds.",
        }
    }
}

/// The effect of a byte that acts at once.
fn effect(command: Realtime) -> &'static str {
    match command {
        Realtime::Reset => "the byte 0x18 resets the machine",
        Realtime::Report => "`?` asks for a report",
        Realtime::Hold => "`!` holds the machine",
        Realtime::Resume => "`~` resumes a held machine",
        Realtime::Door => "the byte 0x84 opens the safety door",
        Realtime::JogCancel => "the byte 0x85 cancels jogs",
        Realtime::Feed(_) => "a byte 0x90 to 0x94 changes the feed",
        Realtime::Rapid(_) => "a byte 0x95 to 0x97 changes the speed of rapids",
        Realtime::Spindle(_) => "a byte 0x99 to 0x9D changes the speed of the spindle",
        Realtime::SpindleStop => "the byte 0x9E stops the spindle in a hold",
        Realtime::Flood => "the byte 0xA0 switches the flood coolant",
        Realtime::Mist => "the byte 0xA1 switches the mist coolant",
        Realtime::Own(_) => "a byte 0xF8 to 0xFF is a command to an extension",
    }
}

/// Looks for remarks along a program.
#[derive(Default)]
pub(crate) struct Remarks {
    /// The bytes that act at once of which a remark has been made.
    told: Vec<u8>,
    ended: bool,
    told_of_end: bool,
}

impl Remarks {
    /// Takes a line with its effects `done`; returns the remarks about it, each with its byte.
    pub(crate) fn take(&mut self, raw: &[u8], done: Done) -> Vec<(usize, Remark)> {
        let mut found = self.read(raw);
        found.extend(done.in_motion.then_some((0, Remark::InMotion)));
        self.pass(done);
        found
    }

    /// Takes a line whose effects are not known yet.
    pub(crate) fn read(&mut self, raw: &[u8]) -> Vec<(usize, Remark)> {
        let mut found = Vec::new();
        let code = match is_plain(raw) {
            true => raw.iter().find(|byte| **byte != b' ').copied(),
            false => {
                let code = code(raw, &mut found);
                self.note_realtime(raw, &mut found);
                code
            }
        };
        if code == Some(b'$') && raw.contains(&b'=') && !raw.trim_ascii().starts_with(b"$J=") {
            found.push((0, Remark::Setting));
        }
        let after_end = self.ended && code.is_some();
        if after_end && !std::mem::replace(&mut self.told_of_end, true) {
            found.push((0, Remark::AfterEnd));
        }
        found
    }

    /// Makes a remark about each byte that acts at once and stands in the program for the first
    /// time.
    fn note_realtime(&mut self, raw: &[u8], found: &mut Vec<(usize, Remark)>) {
        let mut sorter = Sorter::new();
        for (column, byte) in raw.iter().enumerate() {
            if let Byte::Realtime(command) = sorter.sort(*byte) {
                if !self.told.contains(byte) {
                    self.told.push(*byte);
                    found.push((column, Remark::Realtime(command)));
                }
            }
        }
    }

    /// Takes the effects of the line read last.
    pub(crate) fn pass(&mut self, done: Done) {
        self.ended |= done.ended;
    }
}

/// Returns true if a line has no comment, no byte that acts at once, and none that does not occur
/// in G-code. All bytes are looked at together.
fn is_plain(raw: &[u8]) -> bool {
    raw.iter().fold(true, |plain, byte| {
        plain & matches!(byte, b' '..=b'z') & !matches!(byte, b'(' | b';' | b'?' | b'!')
    })
}

/// The first byte of a line that is code, not comment. Notes remarks about comments and bytes in
/// `found`.
fn code(raw: &[u8], found: &mut Vec<(usize, Remark)>) -> Option<u8> {
    let (mut first, mut comment, mut odd) = (None, None, None);
    for (column, byte) in raw.iter().enumerate() {
        match (comment, byte) {
            (Some(_), b')') => comment = None,
            (Some(_), _) => {}
            (None, b'(') => comment = Some(column),
            (None, b';') => break,
            (None, b'\t' | b' ') => {}
            (None, b'?' | b'!' | b'~') => {} // no part of the line
            (None, b'!'..=b'~') => first = first.or(Some(*byte)),
            (None, _) => odd = odd.or(Some(column)),
        }
    }
    found.extend(odd.map(|column| (column, Remark::OddByte)));
    found.extend(comment.map(|column| (column, Remark::UnclosedComment)));
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    fn remarks(lines: &[&str]) -> Vec<(usize, Remark)> {
        let mut all = Remarks::default();
        let mut found = Vec::new();
        for line in lines {
            let ended = line.starts_with("M30");
            let done = Done {
                ended,
                ..Done::default()
            };
            found.extend(all.take(line.as_bytes(), done));
        }
        found
    }

    #[test]
    fn what_nobody_can_have_meant_is_remarked_at_its_place() {
        assert_eq!(
            remarks(&["G0X1 (to the left"]),
            [(5, Remark::UnclosedComment)]
        );
        assert_eq!(remarks(&["G0X\u{2212}1"]), [(3, Remark::OddByte)]);
        assert_eq!(remarks(&["$110=500"]), [(0, Remark::Setting)]);

        assert_eq!(remarks(&["M30", "G0X1", "G0X2"]), [(0, Remark::AfterEnd)]);
    }

    #[test]
    fn each_byte_that_acts_at_once_is_remarked_where_it_stands_first() {
        use leadscrew_machine::protocol::realtime::OverrideStep::CoarseUp;
        let lines = [
            "G0X1 (wow!)",
            "(no!) G0X2 ; why?~",
            "(\u{91})",
            "(\u{a0}) \u{c4}",
        ];
        let expected = [
            (9, Realtime::Hold),
            (16, Realtime::Report),
            (17, Realtime::Resume),
            (2, Realtime::Feed(CoarseUp)),
        ];
        let found = remarks(&lines).into_iter();
        let found: Vec<_> = found
            .filter(|(_, remark)| *remark != Remark::OddByte)
            .collect();
        let expected = expected.map(|(column, command)| (column, Remark::Realtime(command)));
        assert_eq!(found, expected);
    }

    #[test]
    fn what_is_usual_is_not() {
        let usual = [
            "G0X1 (\u{e4}) Y2\t; (\u{e4}",
            "$J=G91X1F100",
            "$H",
            "M30",
            "; end (",
            "",
        ];
        assert_eq!(remarks(&usual), []);
    }
}
