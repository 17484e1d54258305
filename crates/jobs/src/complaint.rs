//! An error shown to a person: file, line, column, the line itself with a caret, GRBL's number, and
//! the remedy.
//!
//! ```text
//! job.nc:12:5: error:2: A number is missing or badly written
//!    12 | G1 X-- Y2
//!       |     ^
//!   A letter, `$` or `=` must be followed by a number such as 10, -0.5 or .25. ...
//! ```

use crate::remark::Remark;
use crate::remedy::remedy;
use leadscrew_machine::protocol::alarm::Alarm;
use leadscrew_machine::protocol::status::Status;
use leadscrew_sim::own::{alarm_of, error_of};
use leadscrew_sim::program::ProgramFault;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

/// The reason why a line of a job was refused, why the machine stopped at it, or what is odd about
/// it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Fault {
    /// `error:N`.
    Error(Status),
    /// `ALARM:N`.
    Alarm(Alarm),
    /// `error:33`, because a move has more steps than can be counted.
    TooLong,
    /// The job goes farther than the travel of an axis, wherever in it work zero is.
    CannotFit,
    /// The carriage of a simulated machine leaves its frame, and no switch stops it.
    LeavesFrame,
    /// The machine has not answered, and will not.
    Unanswered,
    /// A program with parameters, expressions or O words cannot go on. The details say why.
    Program,
    /// A likely mistake that the machine accepts without an answer.
    Remark(Remark),
}

impl Fault {
    /// Returns the name of a remark in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Remark(remark) => remark.name(),
            Self::Error(_)
            | Self::Alarm(_)
            | Self::TooLong
            | Self::CannotFit
            | Self::LeavesFrame
            | Self::Program
            | Self::Unanswered => "error",
        }
    }

    /// Returns true if the machine accepts the line.
    pub fn is_remark(self) -> bool {
        matches!(self, Self::Remark(_))
    }

    /// Returns GRBL's number; 0 for a line that the machine accepts or does not answer.
    pub fn code(self) -> u8 {
        match self {
            Self::TooLong => Status::InvalidTarget.number(),
            Self::Remark(_)
            | Self::CannotFit
            | Self::LeavesFrame
            | Self::Unanswered
            | Self::Program => 0,
            Self::Error(status) => status.number(),
            Self::Alarm(alarm) => alarm.number(),
        }
    }

    /// Returns the short text.
    pub fn message(self) -> &'static str {
        match self {
            Self::TooLong => "the move has more steps than can be counted",
            Self::CannotFit => "the job does not fit the travel",
            Self::LeavesFrame => "the carriage leaves its frame",
            Self::Unanswered => "the machine leaves the line unanswered",
            Self::Program => "the program cannot go on",
            Self::Remark(remark) => remark.message(),
            Self::Error(Status::Own(number)) => error_of(number).map_or("", |own| own.text),
            Self::Alarm(Alarm::Own(number)) => alarm_of(number).map_or("", |own| own.text),
            Self::Error(status) => status.text(),
            Self::Alarm(alarm) => alarm.text(),
        }
    }

    fn explanation(self) -> &'static str {
        match self {
            Self::TooLong => "67 108 863 steps of one motor are the most: divide the move.",
            Self::CannotFit => {
                "From no work zero in the travel do all its places lie in it. Turn or divide the job, \
                 or move its zero to it. `check --origin X,Y,Z` says that zero is elsewhere."
            }
            Self::LeavesFrame => {
                "A real carriage would run against the end and lose steps. `run` begins at `start` of \
                 the machine file; a job may home ($H) and set its zero (G10 L2, G92)."
            }
            Self::Unanswered => {
                "It sleeps until a reset ($SLP), waits for its door to be closed (0x84 opens it), or \
                 a byte of the job has reset it (0x18)."
            }
            Self::Program => {
                "docs/programs.md lists the parameters, expressions and O words that programs have."
            }
            Self::Remark(remark) => remark.explanation(),
            Self::Error(Status::Own(number)) => error_of(number).map_or("", |own| own.explanation),
            Self::Alarm(Alarm::Own(number)) => alarm_of(number).map_or("", |own| own.explanation),
            Self::Error(status) => status.explanation(),
            Self::Alarm(alarm) => alarm.explanation(),
        }
    }
}

/// Returns the errors and alarms of all machines, for a page: the spelling, and for each the short
/// text and the remedy.
pub fn faults() -> BTreeMap<String, [&'static str; 2]> {
    let own = |number| {
        [
            Fault::Error(Status::Own(number)),
            Fault::Alarm(Alarm::Own(number)),
        ]
    };
    let errors = Status::ALL.iter().map(|status| Fault::Error(*status));
    let alarms = Alarm::ALL.iter().map(|alarm| Fault::Alarm(*alarm));
    let all = errors.chain(alarms).chain((0..=u8::MAX).flat_map(own));
    all.filter(|fault| !fault.message().is_empty())
        .map(|fault| (fault.to_string(), [fault.message(), fault.explanation()]))
        .collect()
}

/// Spelled as GRBL spells it.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Error(_) | Self::TooLong => write!(f, "error:{}", self.code()),
            Self::Alarm(_) => write!(f, "ALARM:{}", self.code()),
            Self::CannotFit | Self::LeavesFrame | Self::Unanswered | Self::Program => {
                f.write_str("error")
            }
            Self::Remark(_) => f.write_str("warning"),
        }
    }
}

/// A fault and the line that it belongs to.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Complaint {
    /// The job's file name.
    pub file: String,
    /// The line's number, from 1.
    pub line: u64,
    /// The character of `text`, from 0, at which the fault is, if that is known.
    pub column: Option<usize>,
    /// The mistake.
    pub fault: Fault,
    /// The line's text.
    pub text: String,
    /// Details of this case, for example the distance beyond a soft limit.
    pub detail: Option<String>,
}

/// Characters of a line that are shown on each side of the caret.
const CONTEXT: usize = 50;

impl fmt::Display for Complaint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file, self.line)?;
        if let Some(column) = self.column {
            write!(f, ":{}", column + 1)?;
        }
        writeln!(f, ": {}: {}", self.fault, self.fault.message())?;
        self.quote(f)?;
        if let Some(detail) = &self.detail {
            writeln!(f, "  {detail}")?;
        }
        let mut lines = self.remedy().lines();
        write!(f, "  {}", lines.next().unwrap_or_default())?;
        lines.try_for_each(|line| write!(f, "\n    {line}"))
    }
}

impl Complaint {
    /// Makes a fault in a line of a file; `byte` is its place in the line.
    pub fn new(file: &str, line: u64, byte: Option<usize>, fault: Fault, text: &[u8]) -> Self {
        Self {
            file: file.to_owned(),
            line,
            column: byte.map(|byte| character(text, byte)),
            fault,
            text: String::from_utf8_lossy(text).into_owned(),
            detail: None,
        }
    }

    /// The fault that ends a program.
    pub(crate) fn of_program(file: &str, fault: &ProgramFault) -> Self {
        let column = Some(fault.column);
        let text = fault.text.trim_ascii_start();
        let hint = match text.starts_with(b"#") && !text.contains(&b'=') {
            true => "; a comment stands in ( ) or behind ;",
            false => "",
        };
        Self {
            detail: Some(format!("{}{hint}", fault.kind)),
            ..Self::new(file, fault.line, column, Fault::Program, &fault.text)
        }
    }

    /// The short text, with the details of this case.
    pub(crate) fn message(&self) -> Cow<'_, str> {
        let message = self.fault.message();
        match &self.detail {
            Some(detail) => format!("{message}: {detail}").into(),
            None => message.into(),
        }
    }

    /// Returns the complaint as an annotation that GitHub's workflows show beside the line.
    pub fn annotation(&self) -> String {
        let level = if self.fault.is_remark() {
            "warning"
        } else {
            "error"
        };
        let column = self
            .column
            .map_or(String::new(), |column| format!(",col={}", column + 1));
        let title = property(&format!("{}: {}", self.fault, self.fault.message()));
        let mut message = self.remedy().to_owned();
        if let Some(detail) = &self.detail {
            message = format!("{detail}\n{message}");
        }
        let (file, line, message) = (property(&self.file), self.line, data(&message));
        format!("::{level} file={file},line={line}{column},title={title}::{message}")
    }

    /// Returns the text from the column on; empty if the fault has no place.
    pub fn from_column(&self) -> &str {
        let begin = self
            .column
            .and_then(|column| self.text.char_indices().nth(column));
        let rest = begin.and_then(|(byte, _)| self.text.get(byte..));
        rest.unwrap_or_default()
    }

    /// Returns the user's remedy for the fault. The lines of a machine file stand each on a line of
    /// its own.
    pub fn remedy(&self) -> &'static str {
        let own = match self.fault {
            Fault::Error(status) => remedy(status, self.from_column()),
            Fault::Alarm(_)
            | Fault::TooLong
            | Fault::CannotFit
            | Fault::LeavesFrame
            | Fault::Unanswered
            | Fault::Program
            | Fault::Remark(_) => None,
        };
        own.unwrap_or_else(|| self.fault.explanation())
    }

    /// Writes the part of the line near the fault, and a caret under the fault.
    fn quote(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown: Vec<char> = self.text.chars().map(printable).collect();
        let caret = self.column.unwrap_or(0).min(shown.len());
        let from = caret.saturating_sub(CONTEXT);
        let to = (caret + CONTEXT).min(shown.len());
        let before = if from > 0 { "…" } else { "" };
        let after = if to < shown.len() { "…" } else { "" };
        let part: String = shown.get(from..to).unwrap_or_default().iter().collect();
        writeln!(f, "{:>6} | {before}{part}{after}", self.line)?;
        if self.column.is_some() {
            let blanks = caret - from + before.chars().count();
            writeln!(f, "       | {:blanks$}^", "")?;
        }
        Ok(())
    }
}

/// The number of the character at `byte` of a line.
fn character(line: &[u8], byte: usize) -> usize {
    let before = line.get(..byte).unwrap_or(line);
    String::from_utf8_lossy(before).chars().count()
}

/// Text of an annotation, escaped.
fn data(text: &str) -> String {
    text.replace('%', "%25")
        .replace('\r', "%0D")
        .replace('\n', "%0A")
}

/// The value of an annotation's property, escaped.
fn property(text: &str) -> String {
    data(text).replace(':', "%3A").replace(',', "%2C")
}

/// A character of the line as it is shown: a control character becomes a dot, so that columns stay
/// the same.
fn printable(c: char) -> char {
    match c {
        '\t' => ' ',
        c if c.is_control() => '·',
        c => c,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complaint(text: &str, column: Option<usize>) -> Complaint {
        Complaint {
            file: "job.nc".to_owned(),
            line: 12,
            column,
            fault: Fault::Error(Status::BadNumber),
            text: text.to_owned(),
            detail: None,
        }
    }

    #[test]
    fn the_caret_stands_under_the_column() {
        let text = complaint("G1 X-- Y2", Some(3)).to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[0].starts_with("job.nc:12:4: error:2: "));
        assert_eq!(lines[1], "    12 | G1 X-- Y2");
        assert_eq!(lines[2].find('^'), lines[1].find("X--"));
    }

    #[test]
    fn columns_are_characters_of_the_text() {
        for (line, byte) in [
            (b"G0 (gr\xc3\xb6\xc3\x9fe) Q1".as_slice(), 13),
            (b"G0 (gr\xf6\xdfe) Q1", 11),
            (b"G0 X\xe2\x88\x921 Q1", 9),
        ] {
            let fault = Fault::Error(Status::UnusedWords);
            let complaint = Complaint::new("job.nc", 1, Some(byte), fault, line);
            assert_eq!(complaint.from_column(), "Q1");
            let shown = complaint.to_string();
            let lines: Vec<&str> = shown.lines().collect();
            let before = lines[1].split("Q1").next().unwrap().chars().count();
            assert_eq!(lines[2].find('^'), Some(before), "{shown}");
        }
        let end = Complaint::new("job.nc", 1, Some(9), Fault::TooLong, "X\u{fc}".as_bytes());
        assert_eq!((end.column, end.from_column()), (Some(2), ""));
    }

    #[test]
    fn a_long_line_is_cut_around_the_caret() {
        let text = complaint(&"X1".repeat(500_000), Some(700)).to_string();
        assert!(text.lines().all(|line| line.chars().count() < 200));
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[1].contains('…') && lines[2].ends_with('^'));
    }

    #[test]
    fn control_characters_are_not_sent_to_the_terminal() {
        assert!(!complaint("G1\x1b[31mX", None).to_string().contains('\x1b'));
    }
}
