//! Subprograms: their calls and their ends.

use crate::expression::Reader;
use crate::fault::{ErrorKind, Fault};
use crate::frames::{Frame, Mode};
use crate::head::Head;
use crate::label::{Keyword, Label};
use crate::numbered::{Locals, OWN};
use crate::parameters::Scope;
use crate::program::Program;
use crate::texts::Place;
use crate::value::Value;
use crate::world::World;

impl<
        const CALLS: usize,
        const LOOPS: usize,
        const NUMBERED: usize,
        const NAMED: usize,
        const LINE: usize,
    > Program<CALLS, LOOPS, NUMBERED, NAMED, LINE>
{
    /// Runs `O… call`, with its arguments.
    pub(crate) fn call(&mut self, world: &dyn World, head: Head<'_>) -> Result<(), Fault> {
        let parameters = &self.parameters;
        let scope = Scope { parameters, world };
        let mut reader = Reader::new(head.cursor, &scope);
        let mut arguments = [Value::ZERO; OWN];
        let mut rooms = arguments.iter_mut();
        while reader.cursor.peek() == Some(b'[') {
            let column = reader.cursor;
            let room = rooms.next();
            let room = room.ok_or_else(|| column.fault(ErrorKind::ManyArguments))?;
            *room = reader.bracket()?;
        }
        reader.cursor.need_end()?;
        let column = head.fault(ErrorKind::DeepCalls).column;
        self.enter(head.label, Some(arguments), column, 1)
    }

    /// Begins a subprogram that is to be run so many times. Without arguments, it shares #1 to #30
    /// with its caller.
    pub(crate) fn enter(
        &mut self,
        label: Label,
        arguments: Option<Locals>,
        column: usize,
        times: u32,
    ) -> Result<(), Fault> {
        let Some(again) = times.checked_sub(1) else {
            return Ok(());
        };
        let deep = Fault {
            kind: ErrorKind::DeepCalls,
            column,
        };
        if self.frames.is_full() {
            return Err(deep);
        }
        let frame = Frame {
            label,
            text: self.text,
            back: self.next,
            column,
            callers: arguments.map(|arguments| self.parameters.enter(arguments)),
            loops: self.loops.len(),
            entry: Place::START,
            again,
        };
        self.frames.push(frame).map_err(|_| deep)?;
        self.begin_seek();
        Ok(())
    }

    /// Takes a line of the text in which a subprogram is looked for.
    pub(crate) fn seek(&mut self, line: &[u8]) {
        let Some(mut head) = Head::bare(line) else {
            return;
        };
        let begins = match head.keyword {
            Keyword::Sub => true,
            Keyword::Program => head.cursor.peek().is_none(),
            _ => false,
        };
        if let Some(frame) = self
            .frames
            .last_mut()
            .filter(|frame| frame.label == head.label)
        {
            if begins {
                frame.entry = self.next;
                self.mode = Mode::Run;
            }
        }
    }

    /// Ends the subprogram under way, which must have this label, if one is given.
    pub(crate) fn leave(&mut self, label: Option<Label>) -> Result<(), ErrorKind> {
        let frame = self.frames.last_mut().ok_or(ErrorKind::NotOpen)?;
        if label.is_some_and(|label| label != frame.label) {
            return Err(ErrorKind::NotOpen);
        }
        self.loops.truncate(frame.loops);
        if let Some(again) = frame.again.checked_sub(1) {
            (frame.again, self.next) = (again, frame.entry);
            return Ok(());
        }
        if let Some(callers) = frame.callers {
            self.parameters.leave(callers);
        }
        (self.text, self.next) = (frame.text, frame.back);
        self.frames.pop();
        Ok(())
    }
}
