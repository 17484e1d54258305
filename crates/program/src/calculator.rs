//! The lines of a stream: parameters and expressions, no flow.

use crate::cursor::Cursor;
use crate::expression::Reader;
use crate::fault::{Error, Fault};
use crate::parameters::{Parameters, Scope, Set};
use crate::plain::write_out;
use crate::world::World;
use heapless::Vec;

/// Writes out lines that come one by one: their values are calculated, their assignments kept.
///
/// Its memory: as a [`Program`](crate::Program) has it for `NUMBERED` and `NAMED` parameters, and
/// 2 KB.
///
/// ```
/// use leadscrew_program::Calculator;
///
/// let mut calculator = Calculator::<16, 8>::new();
/// let mut plain = heapless::Vec::<u8, 128>::new();
/// calculator.line(b"#<depth> = [10 / 4]", &(), &mut plain)?;
/// assert!(plain.is_empty());
/// calculator.keep();
/// calculator.line(b"G1 Z-#<depth> F100", &(), &mut plain)?;
/// assert_eq!(plain, b"G1 Z-2.5 F100");
/// # Ok::<(), leadscrew_program::Error>(())
/// ```
#[derive(Debug)]
pub struct Calculator<const NUMBERED: usize, const NAMED: usize> {
    parameters: Parameters<NUMBERED, NAMED>,
    /// The parameters that the line read last sets.
    set: Set,
}

impl<const NUMBERED: usize, const NAMED: usize> Calculator<NUMBERED, NAMED> {
    /// Makes a calculator without a parameter set.
    pub const fn new() -> Self {
        Self {
            parameters: Parameters::new(),
            set: Set::new(),
        }
    }

    /// Writes a line out: replaces `plain` by its words with their values. What it sets counts once
    /// [`keep`](Self::keep) is called. Nothing is written of a line that only sets parameters.
    ///
    /// Brackets may stand eight deep: a microcontroller has little stack. O words, M98 and their like are words as any other: no interpreter takes them.
    ///
    /// # Errors
    /// [`Error`] names the fault and its column; the line counts as line 1. There is always room for
    /// what a sound line sets.
    pub fn line<const LINE: usize>(
        &mut self,
        line: &[u8],
        world: &dyn World,
        plain: &mut Vec<u8, LINE>,
    ) -> Result<(), Error> {
        self.set.clear();
        plain.clear();
        let parameters = &self.parameters;
        let scope = Scope { parameters, world };
        let reader = Reader::shallow(Cursor::new(line), &scope);
        let written = write_out(line, reader, &mut self.set, plain);
        let checked = written.and_then(|()| parameters.has_room(&self.set));
        checked.map_err(|Fault { kind, column }| {
            self.set.clear();
            Error {
                kind,
                text: 0,
                line: 1,
                column,
            }
        })
    }

    /// Makes the assignments of the line read last.
    pub fn keep(&mut self) {
        for (target, value, _) in &self.set {
            // There is room: `line` has looked.
            let _ = self.parameters.set(target, *value);
        }
        self.set.clear();
    }

    /// Forgets all parameters, as after power-up.
    pub fn forget(&mut self) {
        *self = Self::new();
    }
}

impl<const NUMBERED: usize, const NAMED: usize> Default for Calculator<NUMBERED, NAMED> {
    fn default() -> Self {
        Self::new()
    }
}
