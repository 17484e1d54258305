//! Runs programs with parameters, expressions and O words for their plain lines, as
//! [`leadscrew_program`] does, with a desk's memory.

use leadscrew_program::{ErrorKind, Item, Program, Step, Texts, Value, World};
use std::cell::Cell;
use std::collections::BTreeMap;

/// Calls within each other, loops within each other, numbered parameters above #30, named ones,
/// bytes of a plain line: some 150 KB.
type Desk = Program<32, 64, 2000, 300, 1024>;

/// Lines that a program may run. One that goes on after so many has no end.
const MOST_LINES: u64 = 10_000_000;

/// A program that is run.
pub(crate) struct Running {
    program: Box<Desk>,
    text: Vec<u8>,
    /// Lines of the file before this text.
    before: u64,
    /// Lines of this text.
    lines: u64,
    branches: BTreeMap<u64, Branch>,
    /// The first line of the file that has read what only the machine knows.
    asks: Option<u64>,
}

/// The machine of a program, and whether the program has read what only the machine knows: a place,
/// an offset, a tool, a probe. The program's own lines set the modes.
struct Asked<'w> {
    world: &'w dyn World,
    asks: Cell<bool>,
}

impl World for Asked<'_> {
    fn read(&self, item: Item) -> Option<Value> {
        let is_mode = match item {
            Item::Feed | Item::Speed | Item::SpindleOn | Item::System => true,
            Item::Metric | Item::Incremental | Item::Plane => true,
            Item::Probed(_) | Item::ProbeState | Item::Tool | Item::ToolOffset(_) => false,
            Item::First(_) | Item::Second(_) | Item::G92(_) | Item::Zero(..) => false,
            Item::Position(_) | Item::Absolute(_) => false,
        };
        self.asks.set(self.asks.get() || !is_mode);
        self.world.read(item)
    }
}

impl std::fmt::Debug for Running {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Running")
            .field(&self.program.line())
            .finish()
    }
}

/// The number of times that the branch of a condition was run, and how often it was not.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct Branch {
    /// Times that it was run.
    pub taken: u64,
    /// Times that it was passed over.
    pub passed: u64,
}

/// The reason why a program cannot go on.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ProgramFault {
    /// The line of the file, from 1.
    pub line: u64,
    /// The byte of the line, from 0.
    pub column: usize,
    /// The line's text.
    pub text: Vec<u8>,
    /// The fault.
    pub kind: ErrorKind,
}

/// The next part of a job.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Next {
    /// A line.
    Line,
    /// No line: a program begins, which may read its machine. Whoever sends lines waits until those
    /// before it are answered.
    Begins,
    /// A fault of its program, which ends it.
    Fault(ProgramFault),
    /// Its end.
    End,
}

impl Running {
    /// Begins the program that `text` is, which stands behind `before` lines of its file.
    pub(crate) fn new(text: Vec<u8>, before: u64) -> Self {
        let lines = lines_of(&text).count() as u64;
        Self {
            program: Box::new(Desk::new(MOST_LINES)),
            text,
            before,
            lines,
            branches: BTreeMap::new(),
            asks: None,
        }
    }

    /// Lines of the whole file.
    pub(crate) fn count(&self) -> u64 {
        self.before + self.lines
    }

    /// The line of the file that was read last.
    pub(crate) fn number(&self) -> u64 {
        self.before + u64::from(self.program.line().1)
    }

    /// The conditions that were met, each with the line of the file.
    pub(crate) fn branches(&self) -> &BTreeMap<u64, Branch> {
        &self.branches
    }

    /// The first line that has read what only the machine knows.
    pub(crate) fn asks(&self) -> Option<u64> {
        self.asks
    }

    /// Runs the program up to its next plain line, which is put into `line`.
    pub(crate) fn next(&mut self, line: &mut Vec<u8>, world: &dyn World) -> Next {
        line.clear();
        let asks = Cell::new(false);
        let world = Asked { world, asks };
        let next = self.next_of(line, &world);
        if world.asks.get() {
            self.asks.get_or_insert(self.number());
        }
        next
    }

    fn next_of(&mut self, line: &mut Vec<u8>, world: &dyn World) -> Next {
        let mut text: &[u8] = &self.text;
        loop {
            let step = self.program.step(&mut text as &mut dyn Texts, world);
            match step {
                Ok(Step::Line(plain)) => {
                    line.extend_from_slice(plain);
                    return Next::Line;
                }
                Ok(Step::Branch(taken)) => {
                    let number = self.before + u64::from(self.program.line().1);
                    let branch = self.branches.entry(number).or_default();
                    match taken {
                        true => branch.taken += 1,
                        false => branch.passed += 1,
                    }
                }
                Ok(Step::Busy) => {}
                Ok(Step::End) => return Next::End,
                Err(error) => {
                    let index = (error.line as usize).saturating_sub(1);
                    let bytes = lines_of(&self.text).nth(index).unwrap_or_default();
                    return Next::Fault(ProgramFault {
                        line: self.before + u64::from(error.line),
                        column: error.column,
                        text: bytes.to_vec(),
                        kind: error.kind,
                    });
                }
            }
        }
    }
}

/// The lines of a text whose lines end with LF.
fn lines_of(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.strip_suffix(b"\n")
        .unwrap_or(text)
        .split(|byte| *byte == b'\n')
}
