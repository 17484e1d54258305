//! O words: conditions and loops.

use crate::expression::Reader;
use crate::fault::{ErrorKind, Fault};
use crate::frames::{Loop, LoopKind, Mode, Until};
use crate::head::Head;
use crate::label::{Keyword, Label};
use crate::parameters::Scope;
use crate::program::{Outcome, Program};
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
    /// Runs a line with an O word.
    pub(crate) fn flow(&mut self, world: &dyn World, head: Head<'_>) -> Result<Outcome, Fault> {
        let mut head = head;
        let label = head.label;
        match head.keyword {
            Keyword::Sub => self.pass_until(label, Until::Past(Keyword::EndSub)),
            Keyword::Call => return self.call(world, head).map(|()| Outcome::Nothing),
            Keyword::EndSub | Keyword::Return => {
                let value = self.argument(world, &mut head, true)?;
                if head.keyword == Keyword::EndSub && !self.own_loops().is_empty() {
                    return Err(head.fault(ErrorKind::NotClosed));
                }
                self.parameters.returned = value;
                self.leave(Some(label)).map_err(|kind| head.fault(kind))?;
            }
            Keyword::If | Keyword::ElseIf => return self.condition(world, head),
            Keyword::While => return self.while_line(world, head),
            Keyword::Repeat => self.repeat(world, &mut head)?,
            keyword => {
                head.cursor.need_end()?;
                self.bare(keyword, &head)?;
            }
        }
        Ok(Outcome::Nothing)
    }

    /// Runs an O word without an argument.
    fn bare(&mut self, keyword: Keyword, head: &Head<'_>) -> Result<(), Fault> {
        let label = head.label;
        match keyword {
            Keyword::Do => self.open(head, LoopKind::Do)?,
            Keyword::Else => match self.innermost(head)?.kind {
                LoopKind::If { done: true } => self.pass_until(label, Until::At(Keyword::EndIf)),
                LoopKind::If { done: false } => self.branch_taken(),
                _ => return Err(head.fault(ErrorKind::NotOpen)),
            },
            Keyword::EndIf => self.close(head, |kind| matches!(kind, LoopKind::If { .. }))?,
            Keyword::EndWhile => {
                let begin = self.innermost(head)?.begin;
                self.close(head, |kind| *kind == LoopKind::While)?;
                self.next = begin;
            }
            Keyword::EndRepeat => self.end_repeat(head)?,
            Keyword::Break => self.jump_out(head, false)?,
            Keyword::Continue => self.jump_out(head, true)?,
            // The number of a program, as Fanuc writes it at its beginning.
            _ if self.frames.is_empty() => {}
            _ => return Err(head.fault(ErrorKind::NotClosed)),
        }
        Ok(())
    }

    /// Passes over a line, unless it is the one to go on with.
    pub(crate) fn skip(
        &mut self,
        line: &[u8],
        world: &dyn World,
        label: Label,
        until: Until,
    ) -> Result<Outcome, Fault> {
        match Head::bare(line) {
            Some(head) if head.label == label && until.is_met(head.keyword) => {
                self.mode = Mode::Run;
                match until {
                    Until::Past(_) => Ok(Outcome::Nothing),
                    Until::Branch | Until::At(_) => self.flow(world, head),
                }
            }
            _ => Ok(Outcome::Nothing),
        }
    }

    fn pass_until(&mut self, label: Label, until: Until) {
        let opened = self.next.line;
        self.mode = Mode::Skip {
            label,
            until,
            opened,
        };
    }

    /// Reads the argument of an O word; 0 if it may be missing and is.
    fn argument(
        &self,
        world: &dyn World,
        head: &mut Head<'_>,
        optional: bool,
    ) -> Result<Option<Value>, Fault> {
        if optional && head.cursor.peek().is_none() {
            return Ok(None);
        }
        let parameters = &self.parameters;
        let scope = Scope { parameters, world };
        let mut reader = Reader::new(head.cursor, &scope);
        let value = reader.bracket()?;
        reader.cursor.need_end()?;
        Ok(Some(value))
    }

    fn test(&self, world: &dyn World, head: &mut Head<'_>) -> Result<bool, Fault> {
        let value = self.argument(world, head, false)?;
        Ok(value.is_some_and(|value| !value.is_zero()))
    }

    fn condition(&mut self, world: &dyn World, head: Head<'_>) -> Result<Outcome, Fault> {
        let mut head = head;
        if head.keyword == Keyword::If {
            let taken = self.test(world, &mut head)?;
            self.open(&head, LoopKind::If { done: taken })?;
            if !taken {
                self.pass_until(head.label, Until::Branch);
            }
            return Ok(Outcome::Branch(taken));
        }
        match self.innermost(&head)?.kind {
            LoopKind::If { done: true } => {
                self.pass_until(head.label, Until::At(Keyword::EndIf));
                Ok(Outcome::Nothing)
            }
            LoopKind::If { done: false } => {
                let taken = self.test(world, &mut head)?;
                match taken {
                    true => self.branch_taken(),
                    false => self.pass_until(head.label, Until::Branch),
                }
                Ok(Outcome::Branch(taken))
            }
            _ => Err(head.fault(ErrorKind::NotOpen)),
        }
    }

    fn branch_taken(&mut self) {
        if let Some(condition) = self.loops.last_mut() {
            condition.kind = LoopKind::If { done: true };
        }
    }

    /// Runs the `while` that begins a loop, or that ends one which began with `do`.
    fn while_line(&mut self, world: &dyn World, head: Head<'_>) -> Result<Outcome, Fault> {
        let mut head = head;
        let goes_on = self.test(world, &mut head)?;
        let last = self.own_loops().last().copied();
        match last.filter(|last| last.label == head.label && last.kind == LoopKind::Do) {
            Some(last) if goes_on => self.next = last.inside,
            Some(_) => {
                self.loops.pop();
            }
            None if goes_on => self.open(&head, LoopKind::While)?,
            None => self.pass_until(head.label, Until::Past(Keyword::EndWhile)),
        }
        Ok(Outcome::Nothing)
    }

    fn repeat(&mut self, world: &dyn World, head: &mut Head<'_>) -> Result<(), Fault> {
        let count = self.argument(world, head, false)?.unwrap_or_default();
        // Half a time is none, as in LinuxCNC.
        let half = Value::constant(Value::ONE.count() / 2);
        let count = count.minus(half).and_then(|count| {
            let whole = count.negative().floor()?.negative();
            Ok(u32::try_from(whole.whole().unwrap_or(i64::MAX).max(0)).unwrap_or(u32::MAX))
        });
        match count
            .map_err(|math| head.fault(math.into()))?
            .checked_sub(1)
        {
            Some(again) => self.open(head, LoopKind::Repeat { again }),
            None => {
                self.pass_until(head.label, Until::Past(Keyword::EndRepeat));
                Ok(())
            }
        }
    }

    fn end_repeat(&mut self, head: &Head<'_>) -> Result<(), Fault> {
        let begun = self.innermost(head)?;
        let LoopKind::Repeat { again } = begun.kind else {
            return Err(head.fault(ErrorKind::NotOpen));
        };
        let Some(again) = again.checked_sub(1) else {
            self.loops.pop();
            return Ok(());
        };
        if let Some(last) = self.loops.last_mut() {
            last.kind = LoopKind::Repeat { again };
        }
        self.next = begun.inside;
        Ok(())
    }

    /// Leaves a loop, or its present turn, whatever stands open inside.
    fn jump_out(&mut self, head: &Head<'_>, goes_on: bool) -> Result<(), Fault> {
        let is_it =
            |one: &Loop| one.label == head.label && !matches!(one.kind, LoopKind::If { .. });
        let from = self.frames.last().map_or(0, |frame| frame.loops);
        let found = self.own_loops().iter().rposition(is_it);
        let found = found.ok_or_else(|| head.fault(ErrorKind::NotOpen))?;
        self.loops.truncate(from + found + 1);
        let (kind, begin) = {
            let target = self.innermost(head)?;
            (target.kind, target.begin)
        };
        if goes_on {
            match kind {
                LoopKind::Do => self.pass_until(head.label, Until::At(Keyword::While)),
                LoopKind::Repeat { .. } => return self.end_of_turn(head),
                LoopKind::While | LoopKind::If { .. } => {
                    self.loops.pop();
                    self.next = begin;
                }
            }
            return Ok(());
        }
        self.loops.pop();
        let end = match kind {
            LoopKind::Do => Keyword::While,
            LoopKind::Repeat { .. } => Keyword::EndRepeat,
            LoopKind::While | LoopKind::If { .. } => Keyword::EndWhile,
        };
        self.pass_until(head.label, Until::Past(end));
        Ok(())
    }

    /// Ends a turn of a loop with a count from within: its last turn passes over the rest.
    fn end_of_turn(&mut self, head: &Head<'_>) -> Result<(), Fault> {
        let open = self.loops.len();
        self.end_repeat(head)?;
        if self.loops.len() < open {
            self.pass_until(head.label, Until::Past(Keyword::EndRepeat));
        }
        Ok(())
    }

    /// Loops and conditions of the subprogram that is being run.
    fn own_loops(&self) -> &[Loop] {
        let from = self.frames.last().map_or(0, |frame| frame.loops);
        self.loops.get(from..).unwrap_or(&[])
    }

    /// The innermost loop or condition, which must have the label of the line.
    fn innermost(&self, head: &Head<'_>) -> Result<Loop, Fault> {
        let last = self.own_loops().last().copied();
        last.filter(|last| last.label == head.label)
            .ok_or_else(|| head.fault(ErrorKind::NotOpen))
    }

    fn open(&mut self, head: &Head<'_>, kind: LoopKind) -> Result<(), Fault> {
        let begun = Loop {
            label: head.label,
            kind,
            begin: self.here,
            inside: self.next,
        };
        self.loops
            .push(begun)
            .map_err(|_| head.fault(ErrorKind::DeepLoops))
    }

    fn close(&mut self, head: &Head<'_>, is_it: fn(&LoopKind) -> bool) -> Result<(), Fault> {
        match is_it(&self.innermost(head)?.kind) {
            true => {
                self.loops.pop();
                Ok(())
            }
            false => Err(head.fault(ErrorKind::NotOpen)),
        }
    }
}
