//! Runs a program line by line.

use crate::cursor::Cursor;
use crate::expression::Reader;
use crate::fault::{Error, ErrorKind, Fault};
use crate::frames::{Frame, Loop, Mode};
use crate::label::Label;
use crate::parameters::{Parameters, Scope};
use crate::texts::{Place, Texts};
use crate::world::World;
use heapless::Vec;

/// A program under way.
///
/// Its memory: `CALLS` calls within each other (about 600 bytes each), `LOOPS` loops and conditions
/// within each other (80), `NUMBERED` parameters above #30 (32) and `NAMED` ones with a name (64)
/// that may be set at the same time, and `LINE` bytes for a plain line.
///
/// ```
/// use leadscrew_program::{Program, Step};
///
/// let mut text: &[u8] = b"o1 repeat [2]\n#1 = [#1 + 1/4]\nG0 X#1\no1 endrepeat\n";
/// let mut program = Program::<4, 8, 16, 16, 128>::new(1_000);
/// let mut lines = Vec::new();
/// loop {
///     match program.step(&mut text, &())? {
///         Step::Line(line) => lines.push(line.to_vec()),
///         Step::Branch(_) | Step::Busy => {}
///         Step::End => break,
///     }
/// }
/// assert_eq!(lines, [&b"G0 X0.25"[..], b"G0 X0.5"]);
/// # Ok::<(), leadscrew_program::Error>(())
/// ```
#[derive(Debug)]
pub struct Program<
    const CALLS: usize,
    const LOOPS: usize,
    const NUMBERED: usize,
    const NAMED: usize,
    const LINE: usize,
> {
    pub(crate) parameters: Parameters<NUMBERED, NAMED>,
    pub(crate) frames: Vec<Frame, CALLS>,
    pub(crate) loops: Vec<Loop, LOOPS>,
    pub(crate) mode: Mode,
    /// The text that is being run.
    pub(crate) text: u8,
    /// The line that is being run, and the one after it.
    pub(crate) here: Place,
    pub(crate) next: Place,
    /// The plain line.
    pub(crate) out: Vec<u8, LINE>,
    /// The call whose subprogram is being looked for has been looked for in its caller's text.
    elsewhere: bool,
    /// Lines that may still be read.
    left: u64,
}

/// The outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step<'p> {
    /// A plain line for the interpreter.
    Line(&'p [u8]),
    /// A condition, and whether its branch is run.
    Branch(bool),
    /// Nothing for the interpreter: the next step goes on.
    Busy,
    /// The program has ended.
    End,
}

/// The outcome of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// `out` holds a plain line.
    Line,
    Branch(bool),
    Nothing,
}

impl<
        const CALLS: usize,
        const LOOPS: usize,
        const NUMBERED: usize,
        const NAMED: usize,
        const LINE: usize,
    > Program<CALLS, LOOPS, NUMBERED, NAMED, LINE>
{
    /// Prepares a program, which may read this many lines until it ends; lines that it passes over
    /// count.
    pub const fn new(lines: u64) -> Self {
        Self {
            parameters: Parameters::new(),
            frames: Vec::new(),
            loops: Vec::new(),
            mode: Mode::Run,
            text: 0,
            here: Place::START,
            next: Place::START,
            out: Vec::new(),
            elsewhere: false,
            left: lines,
        }
    }

    /// Returns the line read last, from 1, and the number of its text.
    pub fn line(&self) -> (u8, u32) {
        (self.text, self.next.line)
    }

    /// Reads the next line: bounded by its length. Called again and again until the end or an
    /// error, after which the program has ended.
    ///
    /// # Errors
    /// [`Error`] names the fault and its place.
    pub fn step(&mut self, texts: &mut dyn Texts, world: &dyn World) -> Result<Step<'_>, Error> {
        let stepped = self.try_step(texts, world);
        if stepped.is_err() {
            self.mode = Mode::Ended;
        }
        Ok(match stepped? {
            Outcome::Line => Step::Line(self.out.trim_ascii_start()),
            Outcome::Branch(taken) => Step::Branch(taken),
            Outcome::Nothing if self.mode == Mode::Ended => Step::End,
            Outcome::Nothing => Step::Busy,
        })
    }

    fn try_step(&mut self, texts: &mut dyn Texts, world: &dyn World) -> Result<Outcome, Error> {
        if self.mode == Mode::Ended {
            return Ok(Outcome::Nothing);
        }
        let Some((line, next)) = self.next.read(texts.text(self.text)) else {
            return self.end_of_text(texts);
        };
        (self.here, self.next) = (self.next, next);
        let outcome = match self.left.checked_sub(1) {
            Some(left) => {
                self.left = left;
                self.take(line, world)
            }
            None => Err(Fault {
                kind: ErrorKind::Endless,
                column: 0,
            }),
        };
        outcome.map_err(|fault| Error {
            kind: fault.kind,
            text: self.text,
            line: self.next.line,
            column: fault.column,
        })
    }

    fn take(&mut self, line: &[u8], world: &dyn World) -> Result<Outcome, Fault> {
        match self.mode {
            Mode::Run => self.run(line, world),
            Mode::Skip { label, until, .. } => self.skip(line, world, label, until),
            Mode::Seek => {
                self.seek(line);
                Ok(Outcome::Nothing)
            }
            Mode::Ended => Ok(Outcome::Nothing),
        }
    }

    fn run(&mut self, line: &[u8], world: &dyn World) -> Result<Outcome, Fault> {
        let parameters = &self.parameters;
        let scope = Scope { parameters, world };
        let mut reader = Reader::new(Cursor::new(line), &scope);
        let head = reader.head()?;
        match head {
            Some(head) => self.flow(world, head),
            None => self.plain(line, world),
        }
    }

    /// The text has no further line.
    fn end_of_text(&mut self, texts: &mut dyn Texts) -> Result<Outcome, Error> {
        let open = |text, line| Error {
            kind: ErrorKind::NotClosed,
            text,
            line,
            column: 0,
        };
        match (self.mode, self.frames.last()) {
            (Mode::Seek, Some(frame)) => {
                let (label, error) = (frame.label, frame.error(ErrorKind::NoSubprogram));
                self.look_elsewhere(texts, &label).ok_or(error)?;
            }
            (Mode::Skip { opened, .. }, _) => return Err(open(self.text, opened)),
            (Mode::Run, Some(frame)) => return Err(frame.error(ErrorKind::NotClosed)),
            (Mode::Run | Mode::Seek | Mode::Ended, _) => {
                if let Some(open_loop) = self.loops.last() {
                    return Err(open(self.text, open_loop.begin.line + 1));
                }
                self.mode = Mode::Ended;
            }
        }
        Ok(Outcome::Nothing)
    }

    /// Goes on looking for a subprogram in another text, if there is one.
    fn look_elsewhere(&mut self, texts: &mut dyn Texts, label: &Label) -> Option<()> {
        if self.elsewhere {
            return None;
        }
        self.text = texts.find(label)?;
        self.elsewhere = true;
        self.next = Place::START;
        Some(())
    }

    /// Begins to look for a subprogram in the text of its call.
    pub(crate) fn begin_seek(&mut self) {
        self.elsewhere = false;
        self.next = Place::START;
        self.mode = Mode::Seek;
    }

    /// Ends the program.
    pub(crate) fn end(&mut self) {
        self.mode = Mode::Ended;
    }
}
