//! The machine as an extension sees it.

use crate::board::Instant;
use crate::protocol::alarm::Alarm;
use crate::protocol::line_reader::COMMENT;
use crate::state::State;
use core::fmt;
use heapless::String;
use leadscrew_planner::Coordinate;
use leadscrew_stepper::OutputChange;

/// The comment of a line.
pub type Comment = String<COMMENT>;

/// The receiver of an extension's lines.
pub trait Out {
    /// Sends a line to the sender whose line is carried out, or to all if there is no such
    /// sender. The text comes without a line end, and is cut behind [`LONGEST_TEXT`] bytes.
    fn line(&mut self, line: fmt::Arguments<'_>);
    /// Sends `[MSG:text]` to all; `text` is cut behind [`LONGEST_TEXT`] bytes.
    fn message(&mut self, text: fmt::Arguments<'_>);
}

/// The longest text of an extension's line or message, bytes: with the alarm before it, it fits the
/// room that a message may take. What is longer is cut.
pub const LONGEST_TEXT: usize = 200;

/// The machine as an extension sees it during one call.
pub struct Cx<'a, const AXES: usize> {
    /// The present instant.
    pub now: Instant,
    /// The machine's state.
    pub state: State,
    /// The machine position of the axes.
    pub position: [Coordinate; AXES],
    /// The work offset in force: the place of the program's zero, machine position.
    pub work_offset: [Coordinate; AXES],
    /// True if nothing moves and nothing is planned.
    pub at_rest: bool,
    out: &'a mut dyn Out,
    alarm: Option<Alarm>,
    pub(super) comment: Comment,
    outputs: OutputChange,
}

impl<'a, const AXES: usize> Cx<'a, AXES> {
    /// Made by the machine for each call.
    pub(super) fn new(
        now: Instant,
        state: State,
        (position, work_offset): ([Coordinate; AXES], [Coordinate; AXES]),
        at_rest: bool,
        out: &'a mut dyn Out,
    ) -> Self {
        Self {
            now,
            state,
            position,
            work_offset,
            at_rest,
            out,
            alarm: None,
            comment: Comment::new(),
            outputs: OutputChange::NONE,
        }
    }

    /// Makes a machine that is idle at its origin at `now`: to test an extension alone.
    pub fn idle(now: Instant, out: &'a mut dyn Out) -> Self {
        let zero = [Coordinate::ZERO; AXES];
        Self::new(now, State::Idle, (zero, zero), true, out)
    }

    /// Sends a line to the sender whose line is carried out. In
    /// [`Extension::poll`](super::Extension::poll), sends it to all. At most [`LONGEST_TEXT`] bytes
    /// of it are sent.
    pub fn line(&mut self, line: fmt::Arguments<'_>) {
        self.out.line(line);
    }

    /// Sends `[MSG:text]` to all, with at most [`LONGEST_TEXT`] bytes of `text`.
    pub fn message(&mut self, text: fmt::Arguments<'_>) {
        self.out.message(text);
    }

    /// Makes synchronised outputs change when the next move of the program begins, together with
    /// the changes asked for before. A reset, an alarm and the end of the program forget them.
    pub fn with_next_move(&mut self, change: OutputChange) {
        self.outputs = self.outputs.then(change);
    }

    /// Returns the comment of the line whose M code is carried out, as far as it was kept: 48
    /// characters.
    pub fn comment(&self) -> Comment {
        self.comment.clone()
    }

    /// Returns the changes that were asked for.
    pub fn outputs(&self) -> OutputChange {
        self.outputs
    }

    /// Locks the machine after this call: motion stops at once, spindle and coolant go off, the
    /// line under way is answered: with the error of [`Step::Refuse`](super::Step::Refuse), if the
    /// same call refuses it, and otherwise with `ok`.
    pub fn alarm(&mut self, alarm: Alarm) {
        self.alarm = Some(alarm);
    }

    /// Returns the alarm that was asked for.
    pub fn raised(&self) -> Option<Alarm> {
        self.alarm
    }
}
