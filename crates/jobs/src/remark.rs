//! Likely mistakes that the machine accepts: comments that do not end, settings in a job, lines
//! after its end.

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
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Remark {
    /// A `(` without a `)`: the rest of the line is a comment.
    UnclosedComment,
    /// A byte that does not occur in G-code.
    OddByte,
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
}

impl Remark {
    /// The name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::UnclosedComment => "unclosed_comment",
            Self::OddByte => "odd_byte",
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
        }
    }

    /// The short text.
    pub fn message(self) -> &'static str {
        match self {
            Self::UnclosedComment => "a comment is not closed",
            Self::OddByte => "a byte that is no G-code",
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
        }
    }

    /// The meaning of the remark.
    pub fn explanation(self) -> &'static str {
        match self {
            Self::UnclosedComment => "All that follows the ( in this line is taken for comment.",
            Self::OddByte => {
                "What looks like a blank, a minus or a digit may be another character."
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
        }
    }
}

/// Looks for remarks along a program.
#[derive(Default)]
pub(crate) struct Remarks {
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
        let code = code(raw, &mut found);
        if code == Some(b'$') && raw.contains(&b'=') && !raw.trim_ascii().starts_with(b"$J=") {
            found.push((0, Remark::Setting));
        }
        let after_end = self.ended && code.is_some();
        if after_end && !std::mem::replace(&mut self.told_of_end, true) {
            found.push((0, Remark::AfterEnd));
        }
        found
    }

    /// Takes the effects of the line read last.
    pub(crate) fn pass(&mut self, done: Done) {
        self.ended |= done.ended;
    }
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
