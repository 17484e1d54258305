//! Faults of programs, and their places.

use core::fmt;

/// A fault of a program, and its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Error {
    /// The fault.
    pub kind: ErrorKind,
    /// The number of the text it stands in, as [`Texts`](crate::Texts) counts them; 0 is the
    /// program itself.
    pub text: u8,
    /// The line in that text, from 1.
    pub line: u32,
    /// The offset in the line, in bytes from 0.
    pub column: usize,
}

/// A fault in a line, before it is known which one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Fault {
    pub(crate) kind: ErrorKind,
    pub(crate) column: usize,
}

/// The ways in which a program can be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorKind {
    /// Something else had to stand here; the byte found, or the end of the line.
    Expected(Expected, Option<u8>),
    /// The calculation has no result.
    Math(Math),
    /// There is no parameter of this number.
    NoParameter,
    /// No parameter of this name has been set.
    UnknownName,
    /// The machine does not know the value.
    UnknownHere,
    /// The parameter belongs to the machine.
    ReadOnly,
    /// The number of a parameter, of an O word or of repetitions must be whole.
    NotWhole,
    /// The value is too large for a word.
    TooLarge,
    /// A name is longer than [`NAME_LENGTH`](crate::NAME_LENGTH) characters.
    LongName,
    /// There is no such function.
    UnknownFunction,
    /// There is no such keyword of an O word.
    UnknownKeyword,
    /// No subprogram of this name or number was found.
    NoSubprogram,
    /// This O word ends or belongs to something that has not begun.
    NotOpen,
    /// What this O word begins does not end, or ends in another subprogram.
    NotClosed,
    /// Brackets, operators or `#` stand too deep within each other: brackets alone may stand 31
    /// deep, in a line of a stream 8.
    DeepBrackets,
    /// Subprograms call each other deeper than there is room for.
    DeepCalls,
    /// Loops and conditions are nested deeper than there is room for.
    DeepLoops,
    /// There is no room for another numbered parameter.
    ManyParameters,
    /// There is no room for another named parameter.
    ManyNames,
    /// More than 16 parameters are set in one line.
    ManyAssignments,
    /// A call has more than 30 arguments.
    ManyArguments,
    /// The plain line has no room.
    LongLine,
    /// M98, M99 and G65 take no other words than their own.
    OtherWords,
    /// So many lines were run that the program seems to have no end.
    Endless,
}

/// The thing that had to stand at a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// A number, a parameter, a function or `[`.
    Value,
    /// A letter with its value, or `#`.
    Word,
    /// An operator or `]`.
    Operator,
    /// `[`.
    Bracket,
    /// `/` between the two arguments of ATAN.
    Slash,
    /// `=`.
    Equals,
    /// `#`.
    Parameter,
    /// A name and `>`.
    Name,
    /// The number or name of an O word.
    Label,
    /// The end of the line.
    End,
    /// The word P with the number of a subprogram.
    Number,
}

/// The reason why a calculation has no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Math {
    /// A division by 0.
    ByZero,
    /// The result is beyond ±10¹⁹.
    TooLarge,
    /// The square root of a number below 0.
    NegativeRoot,
    /// The logarithm of 0 or of a number below it.
    NoLogarithm,
    /// ASIN or ACOS of a number beyond ±1.
    NoAngle,
    /// A number below 0 to a power that is not whole.
    NoPower,
}

impl From<Math> for ErrorKind {
    fn from(math: Math) -> Self {
        Self::Math(math)
    }
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Value => "a number, a parameter, a function or `[`",
            Self::Word => "a letter with its value, or `#`",
            Self::Operator => "an operator or `]`",
            Self::Bracket => "`[`",
            Self::Slash => "`/` and the second argument of ATAN",
            Self::Equals => "`=`",
            Self::Parameter => "`#` and a parameter",
            Self::Name => "a name and `>`",
            Self::Label => "the number of the O word, or its <name>",
            Self::End => "the end of the line",
            Self::Number => "P with the number of a subprogram",
        })
    }
}

impl fmt::Display for Math {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ByZero => "a division by 0",
            Self::TooLarge => "the result is beyond 10 000 000 000 000 000 000",
            Self::NegativeRoot => "the square root of a number below 0",
            Self::NoLogarithm => "the logarithm of a number that is not above 0",
            Self::NoAngle => "ASIN and ACOS take a number from -1 to 1",
            Self::NoPower => "a number below 0 takes whole powers only",
        })
    }
}

impl fmt::Display for ErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Expected(expected, found) => return describe(*expected, *found, f),
            Self::Math(math) => return math.fmt(f),
            Self::NoParameter => "parameters have the numbers 1 to 5602",
            Self::UnknownName => "no parameter of this name has been set",
            Self::UnknownHere => "the machine does not know this value",
            Self::ReadOnly => "this parameter belongs to the machine: a program can only read it",
            Self::NotWhole => "this number must be whole",
            Self::TooLarge => "the value is too large for a word",
            Self::LongName => "a name has 32 characters at most",
            Self::UnknownFunction => "there is no such function",
            Self::UnknownKeyword => {
                "expected sub, endsub, call, return, if, elseif, else, endif, while, endwhile, do, \
                 repeat, endrepeat, break or continue"
            }
            Self::NoSubprogram => "there is no subprogram of this name or number",
            Self::NotOpen => "this belongs to something that has not begun here",
            Self::NotClosed => "what begins here does not end",
            Self::DeepBrackets => "brackets are nested too deep",
            Self::DeepCalls => "subprograms call each other too deep",
            Self::DeepLoops => "loops and conditions are nested too deep",
            Self::ManyParameters => "too many numbered parameters are in use",
            Self::ManyNames => "too many named parameters are in use",
            Self::ManyAssignments => "a line sets 16 parameters at most",
            Self::ManyArguments => "a call has 30 arguments at most",
            Self::LongLine => "the line has no room once its values are written out",
            Self::OtherWords => "a call or its end stands alone on its line",
            Self::Endless => "the program runs more lines than it may: it seems to have no end",
        })
    }
}

fn describe(expected: Expected, found: Option<u8>, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match found {
        Some(byte) => write!(f, "expected {expected}, found `{}`", byte.escape_ascii()),
        None => write!(f, "expected {expected}, found the end of the line"),
    }
}

impl fmt::Display for Error {
    /// Counts the column from 1, as people and editors do.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let column = self.column.saturating_add(1);
        write!(f, "line {}, column {column}: {}", self.line, self.kind)
    }
}

impl core::error::Error for Error {}
