//! A place in a line of a program.

use crate::fault::{ErrorKind, Expected, Fault};
use crate::label::Name;
use crate::value::Value;

/// Reads a line from left to right. Blanks and comments are passed over wherever they stand.
#[derive(Clone, Copy)]
pub(crate) struct Cursor<'t> {
    line: &'t [u8],
    at: usize,
}

impl<'t> Cursor<'t> {
    pub(crate) fn new(line: &'t [u8]) -> Self {
        Self { line, at: 0 }
    }

    /// The next byte that is no gap, as a capital; `None` at the end of the line.
    pub(crate) fn peek(&mut self) -> Option<u8> {
        while let Some(byte) = self.line.get(self.at) {
            match byte {
                0..=b' ' => self.at += 1,
                b'(' => {
                    let rest = self.line.get(self.at..).unwrap_or(&[]);
                    let end = rest.iter().position(|byte| *byte == b')');
                    self.at = end.map_or(self.line.len(), |end| self.at + end + 1);
                }
                b';' => self.at = self.line.len(),
                _ => return Some(byte.to_ascii_uppercase()),
            }
        }
        None
    }

    /// Passes over the byte that [`peek`](Self::peek) has shown.
    pub(crate) fn pass(&mut self) {
        self.at = (self.at + 1).min(self.line.len());
    }

    /// Takes this byte if it is the next one.
    pub(crate) fn take(&mut self, byte: u8) -> bool {
        let is_next = self.peek() == Some(byte);
        if is_next {
            self.pass();
        }
        is_next
    }

    /// Takes this byte, which must be the next one.
    pub(crate) fn need(&mut self, byte: u8, expected: Expected) -> Result<(), Fault> {
        match self.take(byte) {
            true => Ok(()),
            false => Err(self.expected(expected)),
        }
    }

    /// Makes sure that the line ends here.
    pub(crate) fn need_end(&mut self) -> Result<(), Fault> {
        match self.peek() {
            None => Ok(()),
            Some(_) => Err(self.expected(Expected::End)),
        }
    }

    /// The place of the byte that comes next, gaps included.
    pub(crate) fn at(&self) -> usize {
        self.at
    }

    /// The fault that something else had to stand here.
    pub(crate) fn expected(&mut self, expected: Expected) -> Fault {
        let found = self.peek();
        self.fault(ErrorKind::Expected(expected, found))
    }

    /// A fault at this place.
    pub(crate) fn fault(&self, kind: ErrorKind) -> Fault {
        let column = self.at;
        Fault { kind, column }
    }

    /// Reads letters: an operator, a function or a keyword. What is longer than a name is cut, as no
    /// word of the language is that long.
    pub(crate) fn letters(&mut self) -> Name {
        let mut letters = Name::EMPTY;
        while let Some(letter @ b'A'..=b'Z') = self.peek() {
            letters.push(letter);
            self.pass();
        }
        letters
    }

    /// Reads `name>`.
    pub(crate) fn name(&mut self) -> Result<Name, Fault> {
        let mut name = Name::EMPTY;
        loop {
            match self.peek() {
                Some(b'>') if !name.as_bytes().is_empty() => {
                    self.pass();
                    return Ok(name);
                }
                None | Some(b'<' | b'>') => return Err(self.expected(Expected::Name)),
                Some(byte) if name.push(byte) => self.pass(),
                Some(_) => return Err(self.fault(ErrorKind::LongName)),
            }
        }
    }

    /// Reads a decimal without a sign. The places after the eighteenth are dropped.
    #[inline(never)] // its numbers are not on the stack of each value
    pub(crate) fn decimal(&mut self) -> Result<Value, Fault> {
        let (mut count, mut digits, mut unit) = (0_i128, 0_u32, None);
        let start = *self;
        let mut end = *self;
        loop {
            match (self.peek(), unit) {
                (Some(digit @ b'0'..=b'9'), None) => {
                    let digit = i128::from(digit - b'0') * Value::ONE.count();
                    count = count.saturating_mul(10).saturating_add(digit);
                }
                (Some(digit @ b'0'..=b'9'), Some(place)) => {
                    count = count.saturating_add(i128::from(digit - b'0') * place);
                    unit = Some(place / 10);
                }
                (Some(b'.'), None) => {
                    unit = Some(Value::ONE.count() / 10);
                    self.pass();
                    end = *self;
                    continue;
                }
                _ if digits == 0 => return Err(self.expected(Expected::Value)),
                _ => break,
            }
            digits = digits.saturating_add(1);
            self.pass();
            end = *self;
        }
        // A gap behind the number stays, for whoever copies the line.
        *self = end;
        Value::new(count).map_err(|math| start.fault(math.into()))
    }

    /// Reads a number of digits only.
    pub(crate) fn digits(&mut self) -> Option<u32> {
        let mut number = None;
        while let Some(digit @ b'0'..=b'9') = self.peek() {
            let tens = number.unwrap_or(0_u32).saturating_mul(10);
            number = Some(tens.saturating_add(u32::from(digit - b'0')));
            self.pass();
        }
        number
    }
}
