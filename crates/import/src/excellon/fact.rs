//! Facts that a file states about its numbers. If it contradicts itself, either one statement
//! counts, with a note, or the file is refused.
//!
//! | first | then | the one that counts |
//! |---|---|---|
//! | a comment | a command | the command, with a note |
//! | a command | a comment | the command, with a note |
//! | a comment | a comment | the last one |
//! | `M71` | `M72` | the last one: these switch the unit |
//! | a command | a command | in the header neither, behind it the last one |

use std::fmt::Display;

/// The kind of a statement.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Source {
    /// A comment, such as `; FORMAT={2:4/ absolute / inch / decimal}`.
    Comment,
    /// A word with its properties, such as `METRIC,TZ`.
    Keyword,
    /// `M71` or `M72`.
    Code,
}

/// The place of a statement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) source: Source,
    /// The line's number, from 1.
    pub(super) line: usize,
    /// True if it stands before the first tool is taken.
    pub(super) is_in_header: bool,
}

/// A fact and its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fact<T> {
    pub(super) value: T,
    pub(super) at: Place,
}

/// The fact that counts, and the note about one that does not.
pub(super) struct Settled<T> {
    pub(super) fact: Fact<T>,
    pub(super) note: Option<String>,
}

impl<T: Copy + PartialEq + Display> Fact<T> {
    /// The fact that counts after `self` has been stated behind `before`.
    ///
    /// # Errors
    /// Two commands of a header contradict each other. `option` of the command line could decide.
    pub(super) fn behind(self, before: Option<Self>, option: &str) -> Result<Settled<T>, String> {
        use Source::{Code, Comment};
        let Some(before) = before else {
            return Ok(self.alone());
        };
        let is_same = before.value == self.value;
        match (before.at.source, self.at.source) {
            (Comment, Comment) => Ok(self.alone()),
            (Comment, _) if is_same => Ok(self.alone()),
            _ if is_same => Ok(before.alone()),
            (Comment, _) => Ok(self.against(&before)),
            (_, Comment) => Ok(before.against(&self)),
            (Code, Code) => Ok(self.alone()),
            _ if self.at.is_in_header => Err(format!(
                "{} contradicts line {}, which says {}; {option} tells which one is right",
                self.value, before.at.line, before.value
            )),
            _ => Ok(self.alone()),
        }
    }

    fn alone(self) -> Settled<T> {
        Settled {
            fact: self,
            note: None,
        }
    }

    fn against(self, comment: &Self) -> Settled<T> {
        let note = format!(
            "the comment in line {} says {}, and the command in line {} says {}: the command counts",
            comment.at.line, comment.value, self.at.line, self.value
        );
        Settled {
            fact: self,
            note: Some(note),
        }
    }
}
