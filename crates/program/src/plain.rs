//! Lines without an O word: their values are written out, their assignments made.

use crate::cursor::Cursor;
use crate::expression::Reader;
use crate::fault::{ErrorKind, Expected, Fault};
use crate::label::Label;
use crate::numbered::OWN;
use crate::parameters::{Scope, Set};
use crate::program::{Outcome, Program};
use crate::recognise::has_values;
use crate::value::Value;
use crate::world::World;
use core::fmt::Write as _;
use heapless::Vec;
use leadscrew_gcode::{words, Letter, Number, Word};

/// The decimals of a word that was calculated: in millimetres a millionth of a micrometre less than
/// nobody measures, and short enough for lines of 80 characters.
const PLACES: u32 = 6;

impl<
        const CALLS: usize,
        const LOOPS: usize,
        const NUMBERED: usize,
        const NAMED: usize,
        const LINE: usize,
    > Program<CALLS, LOOPS, NUMBERED, NAMED, LINE>
{
    /// Runs a line without an O word.
    pub(crate) fn plain(&mut self, line: &[u8], world: &dyn World) -> Result<Outcome, Fault> {
        self.out.clear();
        let line = line.trim_ascii_end();
        if line.trim_ascii_start().first() == Some(&b'%') {
            return Ok(Outcome::Nothing);
        }
        let mut set = Set::new();
        if has_values(line) {
            let parameters = &self.parameters;
            let scope = Scope { parameters, world };
            let reader = Reader::new(Cursor::new(line), &scope);
            write_out(line, reader, &mut set, &mut self.out)?;
        } else {
            copy(line, &mut self.out)?;
        }
        for (target, value, column) in &set {
            let is_set = self.parameters.set(target, *value);
            let column = *column;
            is_set.map_err(|kind| Fault { kind, column })?;
        }
        match Code::of(&self.out)? {
            Some(code) => self.act(&code),
            None if self.out.trim_ascii().is_empty() => Ok(Outcome::Nothing),
            // Of a line that only sets parameters, a comment is left.
            None if !set.is_empty() && Cursor::new(&self.out).peek().is_none() => {
                Ok(Outcome::Nothing)
            }
            None => Ok(Outcome::Line),
        }
    }

    fn act(&mut self, code: &Code) -> Result<Outcome, Fault> {
        let column = code.column;
        let fault = |kind| Fault { kind, column };
        match code.kind {
            Kind::End => {
                self.end();
                return Ok(Outcome::Line);
            }
            Kind::Return => self.leave(None).map_err(fault)?,
            Kind::Repeat => self.enter(code.label()?, None, column, code.times()?)?,
            Kind::Macro => {
                let mut arguments = [Value::ZERO; OWN];
                for word in words(&self.out).map_while(Result::ok) {
                    let room = argument(word.letter()).and_then(|at| arguments.get_mut(at));
                    if let Some(room) = room {
                        *room = Value::from_number(word.value());
                    }
                }
                self.enter(code.label()?, Some(arguments), column, 1)?;
            }
        }
        Ok(Outcome::Nothing)
    }
}

/// Writes a line with the values of its words into `out`, and what it sets into `set`.
pub(crate) fn write_out<const LINE: usize>(
    line: &[u8],
    mut reader: Reader<'_, '_>,
    set: &mut Set,
    out: &mut Vec<u8, LINE>,
) -> Result<(), Fault> {
    if reader.cursor.take(b'/') {
        push(b"/", &reader.cursor, out)?;
    }
    loop {
        let before = reader.cursor.at();
        let byte = reader.cursor.peek();
        // A comment that has no room is left out whole: its words are nobody's command.
        let _ = out.extend_from_slice(line.get(before..reader.cursor.at()).unwrap_or(&[]));
        match byte {
            None => return Ok(()),
            Some(b'#') => {
                let start = reader.cursor;
                let (target, value) = reader.assignment()?;
                set.push((target, value, start.at()))
                    .map_err(|_| start.fault(ErrorKind::ManyAssignments))?;
            }
            Some(letter @ b'A'..=b'Z') => {
                push(&[letter], &reader.cursor, out)?;
                reader.cursor.pass();
                write_value(line, &mut reader, out)?;
            }
            Some(_) => return Err(reader.cursor.expected(Expected::Word)),
        }
    }
}

/// Writes the value of a word: as it stands, if it is a plain number.
fn write_value<const LINE: usize>(
    line: &[u8],
    reader: &mut Reader<'_, '_>,
    out: &mut Vec<u8, LINE>,
) -> Result<(), Fault> {
    reader.cursor.peek();
    let start = reader.cursor;
    let value = reader.value()?;
    let text = line.get(start.at()..reader.cursor.at()).unwrap_or(&[]);
    let text = text.trim_ascii_end();
    let digits = text.strip_prefix(b"-").unwrap_or(text);
    if digits.iter().all(|byte| matches!(byte, b'0'..=b'9' | b'.')) {
        return push(text, &start, out);
    }
    let number = value.to_number(PLACES);
    let number = number.ok_or_else(|| start.fault(ErrorKind::TooLarge))?;
    write!(out, "{number}").map_err(|_| start.fault(ErrorKind::LongLine))
}

fn push<const LINE: usize>(
    text: &[u8],
    at: &Cursor<'_>,
    out: &mut Vec<u8, LINE>,
) -> Result<(), Fault> {
    out.extend_from_slice(text)
        .map_err(|_| at.fault(ErrorKind::LongLine))
}

/// Copies a line, without its comments if it has no room for them.
fn copy<const LINE: usize>(line: &[u8], out: &mut Vec<u8, LINE>) -> Result<(), Fault> {
    if out.extend_from_slice(line).is_ok() {
        return Ok(());
    }
    let mut cursor = Cursor::new(line);
    while let Some(byte) = cursor.peek() {
        push(&[byte], &cursor, out)?;
        cursor.pass();
    }
    Ok(())
}

/// A word of a plain line that the program itself obeys.
struct Code {
    kind: Kind,
    column: usize,
    /// The P word, which names a subprogram, and the L word, the number of its calls.
    number: Option<Word>,
    times: Option<Word>,
}

enum Kind {
    /// M2, M30.
    End,
    /// M98.
    Repeat,
    /// M99.
    Return,
    /// G65.
    Macro,
}

impl Code {
    /// Finds the word in a plain line. A line that cannot be read has none: the interpreter
    /// complains about it.
    fn of(line: &[u8]) -> Result<Option<Self>, Fault> {
        let all = || words(line).map_while(Result::ok);
        let Some((kind, column)) = all().find_map(Self::kind) else {
            return Ok(None);
        };
        let find = |letter| all().find(|word| word.letter() == letter);
        let code = Self {
            kind,
            column,
            number: find(Letter::P),
            times: find(Letter::L),
        };
        match all().find(|word| !code.takes(word)) {
            Some(word) => Err(Fault {
                kind: ErrorKind::OtherWords,
                column: word.column(),
            }),
            None => Ok(Some(code)),
        }
    }

    fn kind(word: Word) -> Option<(Kind, usize)> {
        let whole = word.value() == Number::from_int(word.value().trunc() as i32);
        let kind = match (word.letter(), word.value().trunc()) {
            (Letter::M, 2 | 30) => Kind::End,
            (Letter::M, 98) => Kind::Repeat,
            (Letter::M, 99) => Kind::Return,
            (Letter::G, 65) => Kind::Macro,
            _ => return None,
        };
        whole.then_some((kind, word.column()))
    }

    /// Returns true if this word may stand beside the code.
    fn takes(&self, word: &Word) -> bool {
        let is_itself = word.column() == self.column || word.letter() == Letter::N;
        is_itself
            || match self.kind {
                Kind::End => true,
                Kind::Repeat => matches!(word.letter(), Letter::P | Letter::L),
                Kind::Return => false,
                Kind::Macro => word.letter() == Letter::P || argument(word.letter()).is_some(),
            }
    }

    fn label(&self) -> Result<Label, Fault> {
        let missing = ErrorKind::Expected(Expected::Number, None);
        whole(self.number, missing, self.column).map(Label::Number)
    }

    fn times(&self) -> Result<u32, Fault> {
        match self.times {
            Some(_) => whole(self.times, ErrorKind::NotWhole, self.column),
            None => Ok(1),
        }
    }
}

/// Reads the whole number of a word.
fn whole(word: Option<Word>, missing: ErrorKind, column: usize) -> Result<u32, Fault> {
    let kind = missing;
    let word = word.ok_or(Fault { kind, column })?;
    let number = Value::from_number(word.value()).whole();
    let number = number.and_then(|number| u32::try_from(number).ok());
    number.ok_or(Fault {
        kind: ErrorKind::NotWhole,
        column: word.column(),
    })
}

/// The place, from 0, of the parameter that an argument of G65 sets, as Fanuc has it.
fn argument(letter: Letter) -> Option<usize> {
    let number = match letter {
        Letter::A => 1,
        Letter::B => 2,
        Letter::C => 3,
        Letter::I => 4,
        Letter::J => 5,
        Letter::K => 6,
        Letter::D => 7,
        Letter::E => 8,
        Letter::F => 9,
        Letter::H => 11,
        Letter::M => 13,
        Letter::Q => 17,
        Letter::R => 18,
        Letter::S => 19,
        Letter::T => 20,
        Letter::U => 21,
        Letter::V => 22,
        Letter::W => 23,
        Letter::X => 24,
        Letter::Y => 25,
        Letter::Z => 26,
        Letter::G | Letter::L | Letter::N | Letter::O | Letter::P => return None,
    };
    Some(number - 1)
}
