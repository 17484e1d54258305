//! Names, and the numbers or names of O words.

use core::fmt;

/// The longest name, in characters without blanks.
pub const NAME_LENGTH: usize = 32;

/// A name of a parameter or of an O word: capitals, no blanks.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Name {
    bytes: [u8; NAME_LENGTH],
    length: u8,
}

impl Name {
    /// A name without a character.
    pub(crate) const EMPTY: Self = Self {
        bytes: [0; NAME_LENGTH],
        length: 0,
    };

    /// Adds a character; returns whether there was room.
    pub(crate) fn push(&mut self, byte: u8) -> bool {
        let Some(place) = self.bytes.get_mut(usize::from(self.length)) else {
            return false;
        };
        *place = byte.to_ascii_uppercase();
        self.length += 1;
        true
    }

    /// Returns the name, in capitals.
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
    }

    /// Returns true if the parameter of this name is the same in all subprograms: `_feed`.
    pub(crate) fn is_global(&self) -> bool {
        self.as_bytes().first() == Some(&b'_')
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut bytes = self.as_bytes().iter();
        bytes.try_for_each(|byte| write!(f, "{}", byte.to_ascii_lowercase().escape_ascii()))
    }
}

impl fmt::Debug for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// The label that tells one O word from another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Label {
    /// `O100`.
    Number(u32),
    /// `O<name>`.
    Name(Name),
}

impl fmt::Display for Label {
    /// Writes the label as a file has it in its name: `100`, `name`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => fmt::Display::fmt(number, f),
            Self::Name(name) => fmt::Display::fmt(name, f),
        }
    }
}

/// The target of an assignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Target {
    /// `#100`.
    Number(u16),
    /// `#<name>`.
    Name(Name),
}

/// The work of an O word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Keyword {
    /// No keyword: the number of a program, as Fanuc has it.
    Program,
    Sub,
    EndSub,
    Return,
    Call,
    If,
    ElseIf,
    Else,
    EndIf,
    While,
    EndWhile,
    Do,
    Repeat,
    EndRepeat,
    Break,
    Continue,
}

impl Keyword {
    /// Reads a keyword in capitals.
    pub(crate) fn from_bytes(text: &[u8]) -> Option<Self> {
        Some(match text {
            b"" => Self::Program,
            b"SUB" => Self::Sub,
            b"ENDSUB" => Self::EndSub,
            b"RETURN" => Self::Return,
            b"CALL" => Self::Call,
            b"IF" => Self::If,
            b"ELSEIF" => Self::ElseIf,
            b"ELSE" => Self::Else,
            b"ENDIF" => Self::EndIf,
            b"WHILE" => Self::While,
            b"ENDWHILE" => Self::EndWhile,
            b"DO" => Self::Do,
            b"REPEAT" => Self::Repeat,
            b"ENDREPEAT" => Self::EndRepeat,
            b"BREAK" => Self::Break,
            b"CONTINUE" => Self::Continue,
            _ => return None,
        })
    }
}
