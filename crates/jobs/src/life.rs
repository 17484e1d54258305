//! The end of a job, and the things that it waits for on its way: one account for the command line,
//! JSON and Python. The page says the same words (`web/life.js` of `leadscrew-page`).

use crate::complaint::Fault;
use schemars::JsonSchema;
use serde::Serialize;

/// Why a job ended before its last line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Cause {
    /// The machine refused a line, or locked itself.
    Fault(Fault),
    /// A byte of the job reset the machine: what waited, such as a tool change, is given up.
    Reset,
    /// The job sent the machine to sleep (`$SLP`).
    Sleep,
    /// The door is open, and nobody is there to close it.
    Door,
    /// The machine owes an answer and gives none.
    Silence,
}

impl Cause {
    /// The cause as the wire spells it.
    fn name(self) -> String {
        match self {
            Self::Fault(fault) => fault.to_string(),
            Self::Reset => "a reset".to_owned(),
            Self::Sleep => "Sleep".to_owned(),
            Self::Door => "an open door".to_owned(),
            Self::Silence => "the machine's silence".to_owned(),
        }
    }

    /// The cause in words: an error with its short text, since few know its number.
    fn words(self) -> String {
        match self {
            Self::Fault(
                fault @ (Fault::Error(_) | Fault::TooLong | Fault::CannotFit | Fault::LeavesFrame),
            ) => {
                format!("{fault} ({})", fault.message())
            }
            Self::Fault(_) | Self::Reset | Self::Sleep | Self::Door | Self::Silence => self.name(),
        }
    }
}

/// The end of a job.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum End {
    /// Every line was sent and answered, and motion rests.
    Done {
        /// The last line that was answered.
        line: u64,
        /// Lines that were refused; the job went on after them.
        refused: u64,
    },
    /// Lines are left, or motion was cut short.
    Stopped {
        /// The cause.
        by: Cause,
        /// The line at which the machine was.
        line: u64,
    },
}

impl End {
    /// Returns the end in a few words.
    pub fn words(self) -> String {
        match self {
            Self::Done { refused: 0, .. } => "done".to_owned(),
            Self::Done { refused: 1, .. } => "done, 1 line refused".to_owned(),
            Self::Done { refused, .. } => format!("done, {refused} lines refused"),
            Self::Stopped { by, line } => format!("stopped by {} at line {line}", by.words()),
        }
    }

    /// Returns the end for JSON.
    pub fn json(self) -> JsonEnd {
        let (at, by, line) = match self {
            Self::Done { line, .. } => ("done", None, line),
            Self::Stopped { by, line } => ("stopped", Some(by.name()), line),
        };
        JsonEnd {
            at,
            by,
            line,
            words: self.words(),
        }
    }
}

/// The end of a job in JSON.
#[derive(Serialize, JsonSchema)]
pub struct JsonEnd {
    /// `done` or `stopped`.
    at: &'static str,
    /// What stopped it, as the wire spells it; `null` for a job that is done.
    by: Option<String>,
    /// The line at which the machine was: from 1, 0 for a job without lines.
    line: u64,
    /// The same as a person reads it.
    words: String,
}

/// A line at which a job waited for a person.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, JsonSchema)]
pub struct Wait {
    /// The line, from 1.
    pub line: u64,
    /// What the person has to do.
    pub why: String,
}

impl Wait {
    /// The wait at a line with this text, while `message` is what the machine said last.
    pub(crate) fn new(line: u64, text: &[u8], message: &str) -> Self {
        let text = String::from_utf8_lossy(text);
        let why = tool(message).or_else(|| pause(&text));
        let why = why.unwrap_or_else(|| "Resume goes on".to_owned());
        Self { line, why }
    }
}

/// The tool that a tool change asks for.
fn tool(message: &str) -> Option<String> {
    let tool = message.strip_prefix("Tool ")?.strip_suffix(", then ~")?;
    let (number, name) = tool.split_once(": ").unwrap_or((tool, ""));
    let comma = if name.is_empty() { "" } else { ", " };
    Some(format!("insert tool {number}{comma}{name}, then Resume"))
}

/// The comment of a program pause.
fn pause(text: &str) -> Option<String> {
    let (code, comment) = match text.find(['(', ';']) {
        None => (text, ""),
        Some(at) => text.split_at(at),
    };
    let end = comment.find(')').filter(|_| comment.starts_with('('));
    let comment = comment.get(1..end.unwrap_or(comment.len()));
    let comment = comment.unwrap_or_default().trim();
    let bare: String = code.chars().filter(|c| !c.is_whitespace()).collect();
    let bare = bare.to_ascii_uppercase();
    let is_pause = bare.split('M').skip(1).any(|rest| {
        let digits = rest.find(|c: char| !c.is_ascii_digit());
        let number = rest.get(..digits.unwrap_or(rest.len())).unwrap_or_default();
        matches!(number.parse(), Ok(0u32 | 1))
    });
    let comma = if comment.is_empty() { "" } else { ", " };
    is_pause.then(|| format!("the program pauses{comma}{comment}: Resume goes on"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_machine::protocol::alarm::Alarm;
    use leadscrew_machine::protocol::status::Status;

    #[test]
    fn an_end_reads_as_on_the_page() {
        let stopped = |by| End::Stopped { by, line: 7 }.words();
        let alarm = Cause::Fault(Fault::Alarm(Alarm::HardLimit));
        assert_eq!(stopped(alarm), "stopped by ALARM:1 at line 7");
        let error = stopped(Cause::Fault(Fault::Error(Status::UnsupportedCommand)));
        assert!(error.starts_with("stopped by error:20 ("), "{error}");
        assert!(error.ends_with(") at line 7"), "{error}");
        assert_eq!(stopped(Cause::Reset), "stopped by a reset at line 7");
        let done = |refused| End::Done { line: 7, refused }.words();
        assert_eq!(done(0), "done");
        assert_eq!(done(2), "done, 2 lines refused");
    }

    #[test]
    fn a_wait_says_what_the_person_has_to_do() {
        let why = |text: &str, message: &str| Wait::new(1, text.as_bytes(), message).why;
        let tool = why("M6 T2", "Tool 2: 0.8 mm, then ~");
        assert_eq!(tool, "insert tool 2, 0.8 mm, then Resume");
        assert_eq!(why("M6T2", "Tool 2, then ~"), "insert tool 2, then Resume");
        let pause = "the program pauses, turn the board: Resume goes on";
        for text in [
            "M0 (turn the board)",
            "m00;turn the board",
            "G4P0 M 1 (turn the board)",
        ] {
            assert_eq!(why(text, "Pgm End"), pause, "{text}");
        }
        assert_eq!(why("M0", ""), "the program pauses: Resume goes on");
        assert_eq!(why("G1 X5 (M0)", ""), "Resume goes on");
        assert_eq!(why("M10", ""), "Resume goes on");
    }
}
