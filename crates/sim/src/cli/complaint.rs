//! An error shown to a person: file, line, column, the line itself with a caret, GRBL's number, and what to do.
//!
//! ```text
//! job.nc:12:5: error:2: A number is missing or badly written
//!    12 | G1 X-- Y2
//!       |     ^
//!   A letter, `$` or `=` must be followed by a number such as 10, -0.5 or .25. ...
//! ```

use leadscrew_machine::protocol::alarm::Alarm;
use leadscrew_machine::protocol::status::Status;
use std::fmt;

/// What a line of a job was refused with, or what stopped the machine at it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Fault {
    /// `error:N`.
    Error(Status),
    /// `ALARM:N`.
    Alarm(Alarm),
}

impl Fault {
    /// GRBL's number.
    pub(super) fn code(self) -> u8 {
        match self {
            Self::Error(status) => status.number(),
            Self::Alarm(alarm) => alarm.number(),
        }
    }

    /// The short text.
    pub(super) fn message(self) -> &'static str {
        match self {
            Self::Error(status) => status.text(),
            Self::Alarm(alarm) => alarm.text(),
        }
    }

    fn explanation(self) -> &'static str {
        match self {
            Self::Error(status) => status.explanation(),
            Self::Alarm(alarm) => alarm.explanation(),
        }
    }
}

/// A fault and the line that it belongs to.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Complaint {
    /// The job's file name.
    pub(super) file: String,
    /// The line's number, from 1.
    pub(super) line: u64,
    /// Where in the line, bytes from 0, if that is known.
    pub(super) column: Option<usize>,
    /// What is wrong.
    pub(super) fault: Fault,
    /// The line's text.
    pub(super) text: String,
    /// What is particular about this case, such as how far a soft limit was passed.
    pub(super) detail: Option<String>,
}

/// Characters of a line that are shown on each side of the caret.
const CONTEXT: usize = 50;

impl fmt::Display for Complaint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file, self.line)?;
        if let Some(column) = self.column {
            write!(f, ":{}", column + 1)?;
        }
        let kind = match self.fault {
            Fault::Error(_) => "error",
            Fault::Alarm(_) => "ALARM",
        };
        writeln!(
            f,
            ": {kind}:{}: {}",
            self.fault.code(),
            self.fault.message()
        )?;
        self.quote(f)?;
        if let Some(detail) = &self.detail {
            writeln!(f, "  {detail}")?;
        }
        write!(f, "  {}", self.fault.explanation())
    }
}

impl Complaint {
    /// Writes the line, cut to what is near the caret, and the caret under it.
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

/// A line's character as it may be shown: control characters as a dot, so that columns stay.
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
