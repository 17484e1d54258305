//! The machine's side: asks the extension, and carries its answers out.

use super::{Asked, Call, Cx, Event, Extension, Gate, Out, Step, LONGEST_TEXT};
use crate::activity::line::{LineKind, Origin, OwnWait, Progress};
use crate::board::{Board, ChannelId, Instant};
use crate::console::Console;
use crate::interpreter::Travel;
use crate::machine::Machine;
use crate::protocol::alarm::Alarm;
use crate::protocol::status::Status;
use crate::state::State;
use core::fmt;
use leadscrew_gcode::Number;
use leadscrew_planner::{Coordinate, Feed, Kinematics, Move, MoveKind, MovePower, THREE_DECIMALS};
use leadscrew_stepper::OutputChange;

/// The serial lines, as an extension speaks on them.
struct Voice<'a, 'c> {
    console: &'a mut Console<'c>,
    /// The receiver of a line; `None`: to all.
    to: Option<ChannelId>,
}

impl Out for Voice<'_, '_> {
    fn line(&mut self, line: fmt::Arguments<'_>) {
        match self.to {
            Some(id) => self.console.line(id, Start(line)),
            None => self.console.broadcast(Start(line)),
        }
    }

    fn message(&mut self, text: fmt::Arguments<'_>) {
        self.console.say(format_args!("[MSG:{}]", Start(text)));
    }
}

/// The first [`LONGEST_TEXT`] bytes of a text.
struct Start<'a>(fmt::Arguments<'a>);

impl fmt::Display for Start<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let room = LONGEST_TEXT;
        // The end of the room ends the writing.
        let _ = fmt::write(&mut Room { to: f, room }, self.0);
        Ok(())
    }
}

/// Takes text while there is room.
struct Room<'a, 'f> {
    to: &'a mut fmt::Formatter<'f>,
    room: usize,
}

impl fmt::Write for Room<'_, '_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let end = text.floor_char_boundary(self.room);
        self.room -= end;
        self.to.write_str(text.get(..end).unwrap_or_default())?;
        match end == text.len() {
            true => Ok(()),
            false => Err(fmt::Error),
        }
    }
}

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Lets the extension do its regular work; returns when it wants the next turn at the latest.
    /// Main loop.
    pub(crate) fn poll_extension<B: Board>(
        &mut self,
        board: &mut B,
        now: Instant,
    ) -> Option<Instant> {
        if !X::IN_USE {
            return None;
        }
        self.ask(None, board, now, |extension, cx| extension.poll(cx))
    }

    /// Hands a realtime byte to the extension.
    pub(crate) fn own_realtime<B: Board>(
        &mut self,
        from: ChannelId,
        byte: u8,
        board: &mut B,
        now: Instant,
    ) {
        if X::IN_USE {
            self.ask(Some(from), board, now, |extension, cx| {
                extension.realtime(byte, cx);
            });
        }
    }

    /// Returns true if the extension lets `~` take effect.
    pub(crate) fn extension_resumes<B: Board>(&mut self, board: &mut B, now: Instant) -> bool {
        !X::IN_USE || self.ask(None, board, now, |extension, cx| extension.resumes(cx))
    }

    /// Tells the extension of an event.
    pub(crate) fn tell_extension(&mut self, event: Event) {
        if X::IN_USE {
            self.extension.event(event);
        }
    }

    /// Carries out an M code of the extension, or goes on with it.
    pub(crate) fn perform_own<B: Board>(
        &mut self,
        call: &Call,
        board: &mut B,
        now: Instant,
    ) -> Progress {
        if !X::IN_USE || self.state == State::Check {
            return Progress::Done;
        }
        if !self.is_own_due() {
            return Progress::Wait;
        }
        if let Some(not_yet) = self.collect(board, now) {
            return not_yet;
        }
        if let Some(not_yet) = self.ask_gate(&Asked::Code(call)) {
            return not_yet;
        }
        let (step, raised) = self.ask_of_line(now, |extension, cx| extension.perform(call, cx));
        let Some(alarm) = raised else {
            return self.follow(step, call, board, now);
        };
        // The alarm ends the line. If it is refused, too, its answer is the refusal.
        let refused = match step {
            Step::Refuse(status) => self.activity.line.finish().zip(Some(status)),
            _ => None,
        };
        self.stop_for(alarm, board, now);
        if let Some((origin, status)) = refused {
            self.refuse(origin, status.into());
        }
        Progress::Wait
    }

    /// Returns true if the M code under way may be asked again.
    fn is_own_due(&mut self) -> bool {
        match self.activity.line.own_wait() {
            Some(OwnWait::Rest) => self.is_motion_over(),
            Some(OwnWait::Stop) => {
                let rests = self.motion.is_at_rest();
                if rests {
                    self.motion.forget();
                    self.take_position();
                }
                rests
            }
            Some(OwnWait::Turn(_) | OwnWait::Gate) | None => true,
        }
    }

    fn follow<B: Board>(
        &mut self,
        step: Step<AXES>,
        call: &Call,
        board: &mut B,
        now: Instant,
    ) -> Progress {
        let wait = match step {
            Step::Done => {
                let _is_under_way = self.end_aside();
                return Progress::Done;
            }
            Step::SetAside(shown) => return self.begin_aside(call, shown, now),
            Step::Refuse(status) => return self.refuse_own(status),
            Step::Move { target, rate } => return self.move_own(target, rate, call, board, now),
            Step::Wait(at) => OwnWait::Turn(at),
            Step::Rest => OwnWait::Rest,
            Step::Stop => {
                self.motion.hold();
                OwnWait::Stop
            }
        };
        self.wait_own(wait)
    }

    /// Makes the line under way wait; an idle machine shows `Run` meanwhile.
    pub(super) fn wait_own(&mut self, wait: OwnWait) -> Progress {
        self.activity.line.wait_own(wait);
        if self.state == State::Idle && self.motion.is_idle() {
            self.enter(State::Run);
        }
        Progress::Wait
    }

    /// Asks the extension whether a move may be planned, or an M code be begun. `None`: it may.
    pub(crate) fn ask_gate(&mut self, asked: &Asked<'_, AXES>) -> Option<Progress> {
        if !X::IN_USE || self.activity.line.has_passed() {
            return None;
        }
        match self.extension.gate(asked) {
            Gate::Open => {
                self.activity.line.pass();
                None
            }
            Gate::Wait => {
                self.motion.release();
                Some(self.wait_own(OwnWait::Gate))
            }
            Gate::Refuse(status) => Some(self.refuse_own(status)),
        }
    }

    /// Asks the extension whether a move may be planned; `None`: it may.
    pub(crate) fn ask_move(&mut self, travel: &Travel<AXES>, kind: LineKind) -> Option<Progress> {
        if !X::IN_USE || self.state == State::Check {
            return None;
        }
        let from = self.motion.path_end;
        self.ask_gate(&Asked::Move {
            from: &from,
            target: &travel.target,
            jog: kind == LineKind::Jog,
        })
    }

    /// The outputs that change with the next move.
    pub(crate) fn outputs_of(&self, kind: LineKind) -> OutputChange {
        match kind {
            LineKind::Program if X::IN_USE => self.motion.outputs,
            LineKind::Program | LineKind::Jog => OutputChange::NONE,
        }
    }

    /// The text of an error; the extension has those of its own errors.
    pub(crate) fn error_text(&self, status: Status) -> &'static str {
        match status {
            Status::Own(number) if X::IN_USE => {
                let mut errors = self.extension.errors();
                errors
                    .find(|code| code.number == number)
                    .map_or("", |code| code.text)
            }
            _ => status.text(),
        }
    }

    /// The text of an alarm; the extension has those of its own alarms.
    pub(crate) fn alarm_text(&self, alarm: Alarm) -> &'static str {
        match alarm {
            Alarm::Own(number) if X::IN_USE => {
                let mut alarms = self.extension.alarms();
                alarms
                    .find(|code| code.number == number)
                    .map_or("", |code| code.text)
            }
            _ => alarm.text(),
        }
    }

    pub(crate) fn refuse_own(&mut self, status: Status) -> Progress {
        let _is_under_way = self.end_aside();
        self.program.interpreter.set_position(self.motion.path_end);
        if let Some(origin) = self.activity.line.finish() {
            self.refuse(origin, status.into());
        }
        Progress::Wait
    }

    /// Plans a motion that the extension asks for.
    fn move_own<B: Board>(
        &mut self,
        target: [Coordinate; AXES],
        rate: Number,
        call: &Call,
        board: &mut B,
        now: Instant,
    ) -> Progress {
        let first = self
            .extension
            .m_code(call.code)
            .is_some_and(|code| code.is_first());
        if !first || !self.motion.is_idle() || rate <= Number::default() {
            return self.refuse_own(Status::InvalidTarget);
        }
        if !self.is_within_travel(&target) {
            return self.leave_travel(board, now);
        }
        let next = Move {
            target,
            feed: self.feed_to(&target, Feed::PerMinute(rate.to_f32() / 60.0)),
            power: match self.tool.spindle.is_laser() {
                true => MovePower::Off,
                false => MovePower::Spindle {
                    power: self.tool.spindle.power(),
                },
            },
            curve: None,
            rounding: THREE_DECIMALS,
            outputs: OutputChange::NONE,
            line_number: None,
            kind: MoveKind::System,
        };
        let told = self.tool.told;
        if self.push(&next, &told, false, board, now) == Progress::Done {
            self.program.interpreter.set_position(target);
            self.motion.release();
            return self.wait_own(OwnWait::Turn(None));
        }
        Progress::Wait
    }

    /// Calls the extension with a [`Cx`]; locks the machine if the extension asks for that.
    fn ask<B: Board, R>(
        &mut self,
        to: Option<ChannelId>,
        board: &mut B,
        now: Instant,
        call: impl FnOnce(&mut X, &mut Cx<'_, AXES>) -> R,
    ) -> R {
        let (answer, raised) = self.call(to, now, call);
        if let Some(alarm) = raised {
            self.stop_for(alarm, board, now);
        }
        answer
    }

    /// Calls the extension with a [`Cx`]; returns its answer and the alarm that it asks for.
    fn call<R>(
        &mut self,
        to: Option<ChannelId>,
        now: Instant,
        call: impl FnOnce(&mut X, &mut Cx<'_, AXES>) -> R,
    ) -> (R, Option<Alarm>) {
        let (position, at_rest) = (self.motion.position(), self.motion.is_idle());
        let console = &mut self.console;
        let mut voice = Voice { console, to };
        let places = (position, *self.program.interpreter.work_offset());
        let mut cx = Cx::new(now, self.state, places, at_rest, &mut voice);
        let answer = call(&mut self.extension, &mut cx);
        let (raised, outputs) = (cx.raised(), cx.outputs());
        self.motion.outputs = self.motion.outputs.then(outputs);
        (answer, raised)
    }

    /// Calls the extension for the line under way: its answers go to the sender of the line, and it
    /// can read the line's comment.
    pub(super) fn ask_of_line<R>(
        &mut self,
        now: Instant,
        call: impl FnOnce(&mut X, &mut Cx<'_, AXES>) -> R,
    ) -> (R, Option<Alarm>) {
        let asker = match self.activity.line.origin() {
            Some(Origin::Channel(id)) => Some(id),
            Some(Origin::Startup(_) | Origin::Nobody) | None => None,
        };
        let comment = asker.map(|id| self.console.comment(id));
        self.call(asker, now, |extension, cx| {
            cx.comment = comment.unwrap_or_default();
            call(extension, cx)
        })
    }

    /// Stops the machine for an alarm of the extension, once: the extension may ask for the alarm
    /// at every turn.
    pub(super) fn stop_for<B: Board>(&mut self, alarm: Alarm, board: &mut B, now: Instant) {
        if !matches!(self.state, State::Alarm(_)) {
            self.abort(alarm, board, now);
        }
    }
}
