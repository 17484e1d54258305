//! The format of a file's lengths: its unit, its digits, and which zeros are left out.

use super::fact::{Fact, Place, Settled};
use super::word::Word;
use super::wrong::Wrong;
use crate::decimal::{self, NANOS_PER_INCH, NANOS_PER_MM};
use crate::Mm;
use std::fmt;
use std::str::FromStr;

/// The unit of a file's lengths.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Units {
    /// `INCH`, `M72`.
    Inch,
    /// `METRIC`, `M71`.
    Mm,
}

impl Units {
    /// The unit in 1e-9 mm.
    pub(super) fn nanos(self) -> i64 {
        match self {
            Self::Inch => NANOS_PER_INCH,
            Self::Mm => NANOS_PER_MM,
        }
    }

    /// The digits if nothing states them: Excellon's own defaults.
    fn usual_digits(self) -> Digits {
        match self {
            Self::Inch => Digits {
                whole: 2,
                decimals: 4,
            },
            Self::Mm => Digits {
                whole: 3,
                decimals: 3,
            },
        }
    }
}

impl fmt::Display for Units {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Inch => "inch",
            Self::Mm => "mm",
        })
    }
}

/// The digits before and after the decimal point in numbers that are written without it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Digits {
    /// The digits before the point.
    pub whole: usize,
    /// The digits after the point.
    pub decimals: usize,
}

impl fmt::Display for Digits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.whole, self.decimals)
    }
}

impl FromStr for Digits {
    type Err = String;

    /// Reads `2.4` or `2:4`.
    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once(['.', ':']);
        let digit = |part: &str| part.parse().ok().filter(|digits| (0..=9).contains(digits));
        let both = parts.and_then(|(whole, decimals)| Some((digit(whole)?, digit(decimals)?)));
        let (whole, decimals) = both.ok_or("expected digits such as 2.4 or 3.3")?;
        Ok(Self { whole, decimals })
    }
}

/// The zeros that a number keeps. Those at its other end may be left out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Zeros {
    /// `LZ`: with 2.4 digits, `X0034` is 00.3400.
    Leading,
    /// `TZ`: with 2.4 digits, `X3400` is 00.3400.
    Trailing,
}

impl fmt::Display for Zeros {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Leading => "LZ",
            Self::Trailing => "TZ",
        })
    }
}

/// Facts about a file's numbers. Those that the user states override those that the file states.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Known {
    /// The unit.
    pub units: Option<Units>,
    /// Digits of numbers without a point.
    pub digits: Option<Digits>,
    /// Zeros that are kept.
    pub zeros: Option<Zeros>,
}

/// The facts that are known about a file's numbers so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Format {
    told: Known,
    /// The file's own statements.
    units: Option<Fact<Units>>,
    digits: Option<Fact<Digits>>,
    zeros: Option<Fact<Zeros>>,
    /// The fact that the numbers show, and the line of the first number that shows it.
    shown: Option<(Zeros, usize)>,
    /// The unit that the file names below, and its line.
    ahead: Option<(Units, usize)>,
    /// True if there was an `M48`: after it, a unit has to be given.
    pub(super) has_header: bool,
}

impl Format {
    pub(super) fn new(
        told: &Known,
        shown: Option<(Zeros, usize)>,
        ahead: Option<(Units, usize)>,
    ) -> Self {
        Self {
            told: *told,
            units: None,
            digits: None,
            zeros: None,
            shown,
            ahead,
            has_header: false,
        }
    }

    /// Takes the facts of one statement of the file. If its unit differs from the unit before, the
    /// digits stated for the unit before no longer hold. If its unit does not count, its digits do
    /// not count either.
    ///
    /// # Errors
    /// The statement contradicts another one, and neither counts more.
    pub(super) fn take(
        &mut self,
        said: &Known,
        at: Place,
        notes: &mut Notes,
    ) -> Result<(), String> {
        let mut digits = said.digits;
        if let Some(units) = said.units {
            let before = self.units.map(|fact| fact.value);
            let is_told = self.told.units.is_some();
            let counts = keep(&mut self.units, units, at, "--units", is_told, notes)?;
            if counts != units {
                digits = None;
            } else if before.is_some_and(|before| before != units) {
                self.digits = None;
            }
        }
        if let Some(digits) = digits {
            let is_told = self.told.digits.is_some();
            keep(&mut self.digits, digits, at, "--format", is_told, notes)?;
        }
        if let Some(zeros) = said.zeros {
            let is_told = self.told.zeros.is_some();
            keep(&mut self.zeros, zeros, at, "--zeros", is_told, notes)?;
        }
        Ok(())
    }

    /// The unit of lengths: the last one, or else the one that the file names below, as Mentor's
    /// tools stand above it. In a file without header and unit it is the inch, as in all such
    /// files.
    pub(super) fn units(&self, notes: &mut Notes) -> Result<Units, String> {
        if let Some(units) = self.told.units.or(self.units.map(|fact| fact.value)) {
            return Ok(units);
        }
        if let Some((units, line)) = self.ahead {
            notes.add(format!(
                "tools above the unit are read as {units}, which line {line} names"
            ));
            return Ok(units);
        }
        if self.has_header {
            return Err("the file does not name its unit: tell it with --units".to_owned());
        }
        notes.add("no header: lengths are read as inches (--units tells another)");
        Ok(Units::Inch)
    }

    /// Reads a coordinate.
    pub(super) fn coordinate(&self, word: &Word, notes: &mut Notes) -> Result<Mm, Wrong> {
        let found = self.length(word.text, notes);
        found.map_err(|message| word.wrong(message))
    }

    fn length(&self, text: &str, notes: &mut Notes) -> Result<Mm, String> {
        let units = self.units(notes)?;
        if text.contains('.') {
            return decimal::length(text, units.nanos());
        }
        let (negative, digits) = decimal::split_sign(text);
        if digits.is_empty() {
            return Err("expected a number".to_owned());
        }
        if digits.bytes().all(|byte| byte == b'0') {
            return Ok(Mm::ZERO);
        }
        let format = self.digits_of(units, notes);
        let padded = self.padded(digits, format, notes)?;
        let (whole, decimals) = padded.split_at(format.whole);
        decimal::scaled(negative, whole, decimals, units.nanos())
    }

    /// The number of digits that stand before and after the point in numbers without one.
    fn digits_of(&self, units: Units, notes: &mut Notes) -> Digits {
        if let Some(digits) = self.told.digits.or(self.digits.map(|fact| fact.value)) {
            return digits;
        }
        let digits = units.usual_digits();
        notes.add(format!(
            "numbers without a point are read as {digits} digits of {units} (--format tells others)"
        ));
        digits
    }

    /// Adds the zeros that were left out.
    fn padded(&self, digits: &str, format: Digits, notes: &mut Notes) -> Result<String, String> {
        let (length, total) = (digits.len(), format.whole + format.decimals);
        if length > total {
            return Err(format!(
                "has {length} digits where {format} has room for {total}"
            ));
        }
        if length == total {
            return Ok(digits.to_owned());
        }
        match self.kept_zeros(notes) {
            Some(Zeros::Leading) => Ok(format!("{digits:0<total$}")),
            Some(Zeros::Trailing) => Ok(format!("{digits:0>total$}")),
            None => Err(format!(
                "has {length} digits of {total}, and nothing says which zeros are left out: tell it with --zeros"
            )),
        }
    }

    fn kept_zeros(&self, notes: &mut Notes) -> Option<Zeros> {
        if let Some(zeros) = self.told.zeros.or(self.zeros.map(|fact| fact.value)) {
            return Some(zeros);
        }
        let (zeros, line) = self.shown?;
        let missing = match zeros {
            Zeros::Leading => "trailing",
            Zeros::Trailing => "leading",
        };
        notes.add(format!(
            "the file does not say which zeros its numbers leave out; line {line} shows that it is the {missing} ones"
        ));
        Some(zeros)
    }
}

/// Takes a fact that the file states, and returns the one that counts. A fact that the user tells
/// (`is_told`, by `option`) stands above all, so contradictions do not matter.
///
/// # Errors
/// As [`Fact::behind`].
fn keep<T: Copy + PartialEq + fmt::Display>(
    kept: &mut Option<Fact<T>>,
    value: T,
    at: Place,
    option: &str,
    is_told: bool,
    notes: &mut Notes,
) -> Result<T, String> {
    let before = kept.filter(|_| !is_told);
    let Settled { fact, note } = Fact { value, at }.behind(before, option)?;
    note.into_iter().for_each(|note| notes.add(note));
    *kept = Some(fact);
    Ok(fact.value)
}

/// Sentences for the user; each is kept only once.
#[derive(Clone, Debug, Default)]
pub(super) struct Notes(pub(super) Vec<String>);

impl Notes {
    pub(super) fn add(&mut self, note: impl Into<String>) {
        let note = note.into();
        if !self.0.contains(&note) {
            self.0.push(note);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, digits: &str, zeros: Option<Zeros>) -> Result<String, String> {
        let told = Known {
            units: Some(Units::Mm),
            digits: Some(digits.parse().unwrap()),
            zeros,
        };
        let format = Format::new(&told, None, None);
        let length = format.length(text, &mut Notes::default());
        length.map(|length| length.to_string())
    }

    #[test]
    fn zeros_come_back_on_the_side_where_they_were_left_out() {
        let (leading, trailing) = (Some(Zeros::Leading), Some(Zeros::Trailing));
        assert_eq!(read("0034", "3.3", leading), Ok("3.4".to_owned()));
        assert_eq!(read("3400", "3.3", trailing), Ok("3.4".to_owned()));
        assert_eq!(read("-003400", "3.3", None), Ok("-3.4".to_owned()));
        assert_eq!(read("-3.4", "3.3", None), Ok("-3.4".to_owned()));
        assert_eq!(read("0", "3.3", None), Ok("0".to_owned()));
    }

    #[test]
    fn a_number_that_could_be_two_is_refused() {
        for text in ["34", "0003400", "", "+"] {
            assert!(read(text, "3.3", None).is_err(), "{text}");
        }
    }
}
