//! The texts of a program: its own, and those of subprograms in other files.

use crate::label::Label;

/// Holds the texts of a program.
pub trait Texts {
    /// Returns a text; 0 is the program itself. A text never changes while a program runs.
    fn text(&self, number: u8) -> &[u8];

    /// Looks for the text that holds this subprogram, which the program itself does not; returns
    /// its number.
    fn find(&mut self, label: &Label) -> Option<u8>;
}

/// One text alone.
impl Texts for &[u8] {
    fn text(&self, _: u8) -> &[u8] {
        self
    }

    fn find(&mut self, _: &Label) -> Option<u8> {
        None
    }
}

/// The place of a line that is to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Place {
    /// Its offset in the text, bytes.
    at: usize,
    /// The number of lines before it.
    pub(crate) line: u32,
}

impl Place {
    /// The first line of a text.
    pub(crate) const START: Self = Self { at: 0, line: 0 };

    /// Returns the line here, without its end, and the place of the next one; `None` at the end of
    /// the text. Lines end with LF, CR or CR LF.
    pub(crate) fn read(self, text: &[u8]) -> Option<(&[u8], Self)> {
        let rest = text.get(self.at..).filter(|rest| !rest.is_empty())?;
        let end = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
        let length = end.unwrap_or(rest.len());
        let (line, behind) = rest.split_at_checked(length)?;
        let ending = match behind {
            [b'\r', b'\n', ..] => 2,
            [] => 0,
            _ => 1,
        };
        let next = Self {
            at: self.at + length + ending,
            line: self.line.saturating_add(1),
        };
        Some((line, next))
    }
}
