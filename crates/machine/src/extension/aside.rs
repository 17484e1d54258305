//! The machine's side of [`Step::SetAside`](super::Step::SetAside): keeps the sender's lines, obeys
//! the operator, goes on at `~`.

use super::{Call, Event, Extension, Shown};
use crate::activity::aside::{Aside, Kept, Phase, LONGEST, SETTLE};
use crate::activity::line::{LineKind, Origin, OwnWait, Progress};
use crate::board::{Board, Instant};
use crate::interpreter::Command;
use crate::machine::Machine;
use crate::protocol::status::Status;
use crate::protocol::system_command::SystemCommand;
use crate::state::State;
use leadscrew_planner::Kinematics;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Returns true if the operator has the machine, until `~`: a tool change.
    pub fn is_aside(&self) -> bool {
        X::IN_USE
            && matches!(
                self.activity.aside,
                Some(Aside {
                    phase: Phase::Waiting,
                    ..
                })
            )
    }

    /// Returns true if an M code is put aside, and has not been taken back: the sender's lines are
    /// collected for it, or the operator has the machine.
    pub(crate) fn is_put_aside(&self) -> bool {
        let aside = self.activity.aside.filter(|_| X::IN_USE);
        aside.is_some_and(|aside| aside.phase != Phase::Returning)
    }

    /// Puts the M code under way aside. Refuses its line unless the code comes first on its line
    /// and motion rests.
    pub(super) fn begin_aside(&mut self, call: &Call, shown: Shown, now: Instant) -> Progress {
        let first = self.extension.m_code(call.code);
        let fits = first.is_some_and(|code| code.is_first()) && self.motion.is_idle();
        let kept_for = self.activity.kept.map(|kept| Origin::Channel(kept.id));
        let fits = |origin: &Origin| fits && kept_for.is_none_or(|of| of == *origin);
        let Some(origin) = self.activity.line.origin().filter(fits) else {
            return self.refuse_own(Status::InvalidStatement);
        };
        // The sender's lines are collected first. Nothing turns or burns at rest meanwhile.
        self.tool.spindle.suspend();
        self.set_gate();
        let kept = self.keep_further();
        self.activity.aside = Some(Aside {
            call: *call,
            phase: Phase::Collecting {
                since: now,
                last: now,
            },
            origin,
            shown,
            modal: *self.program.interpreter.modal(),
            has_rest: self.activity.line.has_rest(),
            kept,
        });
        self.wait_own(OwnWait::Turn(Some(now + SETTLE)))
    }

    /// Goes on keeping the lines that an earlier code has kept and that are not taken yet. They go
    /// to the front of the memory, before the lines that come now. Returns their number of bytes.
    fn keep_further(&mut self) -> usize {
        let Some(Kept { id, next, end }) = self.activity.kept.take() else {
            return 0;
        };
        self.console.block(id, false);
        let memory = self.extension.kept();
        if next > end || end > memory.len() {
            return 0;
        }
        memory.copy_within(next..end, 0);
        end - next
    }

    /// Keeps the lines that the sender had on the way; hands the machine to the operator once
    /// nothing more comes. `None`: there is nothing to collect.
    pub(super) fn collect<B: Board>(&mut self, board: &mut B, now: Instant) -> Option<Progress> {
        let Some(Aside {
            phase: Phase::Collecting { since, last },
            origin,
            kept,
            ..
        }) = self.activity.aside
        else {
            return None;
        };
        let mut taken = 0;
        if let Origin::Channel(id) = origin {
            let room = self.extension.kept().get_mut(kept..);
            taken = self.console.keep(id, room.unwrap_or_default());
        }
        if let Some(aside) = &mut self.activity.aside {
            aside.kept = kept + taken;
        }
        let last = if taken > 0 { now } else { last };
        if now >= (last + SETTLE).min(since + LONGEST) {
            self.hand_over(board, now);
            return Some(Progress::Wait);
        }
        if let Some(aside) = &mut self.activity.aside {
            aside.phase = Phase::Collecting { since, last };
        }
        Some(self.wait_own(OwnWait::Turn(Some(last + SETTLE))))
    }

    fn hand_over<B: Board>(&mut self, board: &mut B, now: Instant) {
        if let Some(aside) = &mut self.activity.aside {
            aside.phase = Phase::Waiting;
            let call = aside.call;
            let ((), raised) =
                self.ask_of_line(now, |extension, cx| extension.set_aside(&call, cx));
            if let Some(alarm) = raised {
                self.stop_for(alarm, board, now);
            }
        }
        if !self.activity.line.is_busy() {
            return; // the extension raised an alarm, which ended its line
        }
        let _answered_later = self.activity.line.finish();
        self.suspend_outputs(board);
        self.tell_extension(Event::SetAside);
        self.enter(State::Idle);
    }

    /// `~`: gives the machine back to the program. Returns whether the operator had it.
    pub(crate) fn take_back<B: Board>(&mut self, board: &mut B) -> bool {
        if !self.is_aside() || self.activity.line.is_busy() || !self.motion.is_idle() {
            return false;
        }
        let Some(aside) = &mut self.activity.aside else {
            return false;
        };
        aside.phase = Phase::Returning;
        let (call, origin, modal) = (aside.call, aside.origin, aside.modal);
        let has_rest = aside.has_rest;
        self.program.interpreter.restore_modes(&modal);
        self.program.work_offset = *self.program.interpreter.work_offset();
        self.console.cadence.work_offset_changed();
        if !self.tool.spindle.is_laser() {
            self.restore_spindle();
        }
        self.tool.coolant.restore(board);
        self.tell_extension(Event::TakesBack);
        let commands = self.activity.line.commands();
        commands.clear();
        // The first of an empty list always fits.
        let _ = commands.push(Command::Own(call));
        self.activity.line.begin(origin, LineKind::Program);
        self.activity.line.set_rest(has_rest);
        self.wait_own(OwnWait::Turn(None));
        true
    }

    /// Ends the M code that was put aside; the kept lines follow. If the operator still has the
    /// machine, returns the origin of the code's line: that line still waits for its answer.
    pub(crate) fn end_aside(&mut self) -> Option<Origin> {
        if !X::IN_USE {
            return None;
        }
        let aside = self.activity.aside.take()?;
        self.restore_spindle();
        self.set_gate();
        self.activity.kept = aside.lines();
        (aside.phase == Phase::Waiting).then_some(aside.origin)
    }

    /// Reads the kept lines, before any that came later. Once the first is begun, the channel's own
    /// bytes wait for the end of the last.
    pub(crate) fn read_kept(&mut self) {
        let Some(Kept { id, next, end }) = self.activity.kept.filter(|_| X::IN_USE) else {
            return;
        };
        let bytes = self.extension.kept().get(next..end).unwrap_or_default();
        let read = self.console.read_kept(id, bytes, next > 0);
        let next = next + read;
        self.activity.kept = (next < end).then_some(Kept { id, next, end });
        self.console.block(id, next < end && next > 0);
    }

    /// Checks that a `$` line or a line of G-code may be obeyed: while the operator has the
    /// machine, it has to be one of the lines that serve a tool change.
    ///
    /// # Errors
    /// [`Status::Locked`]: the line does not serve a tool change.
    pub(crate) fn admit(&self, line: &[u8]) -> Result<(), Status> {
        if !self.is_aside() {
            return Ok(());
        }
        let admitted = match line.first() {
            None => true,
            Some(b'$') => match SystemCommand::parse(line, &self.circumstances()) {
                Ok(command) => command.serves_operator(),
                Err(_) => true, // answered with its own fault
            },
            Some(_) => self.serves_operator(line),
        };
        match admitted {
            true => Ok(()),
            false => Err(Status::Locked),
        }
    }
}
