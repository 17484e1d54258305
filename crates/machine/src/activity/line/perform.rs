//! Carries commands out: some are done at once, others are begun and waited for.

use super::arc::{ArcFeed, CHORDS_A_POLL};
use super::feed::stretched;
use super::{LineKind, Progress, Wait};
use crate::board::{Board, CoolantOutput, Duration, Instant};
use crate::console::Discard;
use crate::extension::{Event, Extension};
use crate::interpreter::{
    ArcShape, Command, Feed, OffsetId, OverrideControl, Rotation, Spindle, Travel,
};
use crate::machine::Machine;
use crate::protocol::alarm::Alarm;
use crate::protocol::message::Message;
use crate::protocol::report::StatusReport;
use crate::protocol::status::Status;
use crate::settings::table::Setting;
use crate::soft_limits;
use crate::state::{Hold, Jog, State};
use leadscrew_gcode::Number;
use leadscrew_planner::{
    self as planner, ArcError, Coordinate, Kinematics, Move, MoveKind, PushError, Pushed,
};
use leadscrew_stepper::OutputChange;

/// Commands carried out in one poll: bounds its time.
const COMMANDS_A_POLL: usize = 4;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Goes on with the line under way; answers it once all its commands are carried out. Main
    /// loop.
    pub(crate) fn execute<B: Board>(&mut self, board: &mut B, now: Instant) {
        if !self.activity.line.is_busy() || !self.state.takes_lines() || self.is_storing() {
            return;
        }
        if self.activity.line.moves_next() && !self.motion.wants_more() {
            return self.motion.release();
        }
        for _ in 0..COMMANDS_A_POLL {
            match self.perform(board, now) {
                Some(Progress::Done) => self.activity.line.advance(),
                Some(Progress::Wait) => return,
                None if self.activity.line.has_rest() && self.begin_rest() => {}
                None => return self.complete_line(board, now),
            }
        }
    }

    fn complete_line<B: Board>(&mut self, board: &mut B, now: Instant) {
        let then_restart = self.activity.line.then_restart();
        let stored = match core::mem::take(&mut self.store.failed) {
            true => Err(Status::StoreUnreadable),
            false => Ok(()),
        };
        if let Some(origin) = self.activity.line.finish() {
            self.answer(origin, stored);
        }
        if then_restart {
            self.restart(Discard::Nothing, board, now);
        }
    }

    /// Returns true if the line that is being carried out waits for [`Machine::save`]. A machine
    /// without a store never waits for it.
    fn is_storing(&self) -> bool {
        self.activity.line.is_storing() && self.has_unsaved()
    }

    /// Carries out the next command; `None` once there is none. Of a command only the part that its
    /// kind has is copied: this is done for each line.
    #[inline(never)] // inlined into the loop, a raster's pixel takes 26 instructions more
    fn perform<B: Board>(&mut self, board: &mut B, now: Instant) -> Option<Progress> {
        let kind = self.activity.line.kind();
        Some(match *self.activity.line.current()? {
            Command::Line(travel) => self.perform_line(&travel, kind, board, now),
            Command::Arc { travel, arc } if cfg!(feature = "arcs") => {
                self.perform_arc(&travel, &arc, board, now)
            }
            Command::Cycle { travel, cycle } if cfg!(feature = "cycles") => {
                self.perform_cycle(&travel, &cycle, board, now)
            }
            Command::Probe { travel, kind } if cfg!(feature = "probing") => {
                self.perform_probe(&travel, kind, board, now)
            }
            // A build without them refuses the lines that ask for them.
            Command::Arc { .. } | Command::Cycle { .. } | Command::Probe { .. } => Progress::Done,
            Command::Dwell(seconds) => self.perform_dwell(seconds, now),
            Command::Spindle(spindle) => self.perform_spindle(&spindle, now),
            Command::Coolant(coolant) => self.perform_coolant(coolant, board),
            Command::StoreOffset { id, value: _ } => self.perform_store(id),
            Command::StoreTool { tool, length } => self.perform_store_tool(tool, length),
            Command::WorkOffset(offset) => self.perform_work_offset(&offset),
            Command::ParkingControl(allowed) => {
                self.program.parking_allowed = allowed;
                Progress::Done
            }
            Command::OverrideControl(acts) => self.perform_override_control(acts),
            Command::Own(call) => self.perform_own(&call, board, now),
            Command::Pause => self.perform_pause(),
            Command::ProgramEnd => self.perform_program_end(board),
        })
    }

    /// Returns true if all motion has ended. Motion that waits for further lines begins at once.
    pub(crate) fn is_motion_over(&mut self) -> bool {
        self.motion.release();
        self.motion.is_idle()
    }

    fn perform_line<B: Board>(
        &mut self,
        travel: &Travel<AXES>,
        kind: LineKind,
        board: &mut B,
        now: Instant,
    ) -> Progress {
        if kind == LineKind::Program && !self.is_within_travel(&travel.target) {
            return self.leave_travel(board, now);
        }
        if self.state == State::Check {
            return Progress::Done;
        }
        if let Some(not_yet) = self.ask_move(travel, kind) {
            return not_yet;
        }
        let spindle = self.light_of(travel, kind);
        let next = Move {
            target: travel.target,
            feed: self.feed_to(&travel.target, feed(travel.feed, 1.0)),
            power: self.move_power(&spindle),
            curve: None,
            rounding: self.program.interpreter.rounding(),
            outputs: self.outputs_of(kind),
            line_number: self.line_of(travel, kind),
            kind: move_kind(travel.feed, kind),
        };
        let more = self.activity.line.has_more();
        self.push(&next, &spindle, more, board, now)
    }

    fn perform_arc<B: Board>(
        &mut self,
        travel: &Travel<AXES>,
        shape: &ArcShape,
        board: &mut B,
        now: Instant,
    ) -> Progress {
        if let Some(not_yet) = self.ask_move(travel, LineKind::Program) {
            return not_yet;
        }
        if matches!(self.activity.line.wait, Wait::Nothing) {
            let Ok(arc) = self.arc(travel, shape) else {
                return self.refuse_move();
            };
            self.activity.line.wait = Wait::Arc(arc);
        }
        let Wait::Arc(arc) = &self.activity.line.wait else {
            return Progress::Done;
        };
        let feed = feed(travel.feed, arc.shares(travel.feed));
        let spindle = self.light_of(travel, LineKind::Program);
        let whole = Move {
            target: travel.target,
            feed,
            power: self.move_power(&spindle),
            curve: None,
            rounding: self.program.interpreter.rounding(),
            outputs: OutputChange::NONE,
            line_number: self.line_of(travel, LineKind::Program),
            kind: MoveKind::Feed,
        };
        for _ in 0..CHORDS_A_POLL {
            match self.perform_chord(&whole, &spindle, board, now) {
                Some(Progress::Done) => {}
                Some(Progress::Wait) => return Progress::Wait,
                None => return Progress::Done,
            }
        }
        Progress::Wait
    }

    /// Plans the next chord of the arc under way; `None` once there is none. `whole`: what all its
    /// chords have in common, with the arc's end.
    fn perform_chord<B: Board>(
        &mut self,
        whole: &Move<AXES>,
        spindle: &Spindle,
        board: &mut B,
        now: Instant,
    ) -> Option<Progress> {
        let Wait::Arc(arc) = &self.activity.line.wait else {
            return None;
        };
        let target = arc.peek()?;
        let stretch = self.stretch_to(&target);
        let next = Move {
            target,
            feed: stretched(whole.feed, stretch),
            curve: arc.curve_of(stretch),
            outputs: self.outputs_of(LineKind::Program),
            ..*whole
        };
        let more = target != whole.target || self.activity.line.has_more();
        if !self.is_within_travel(&target) {
            return Some(self.leave_travel(board, now));
        }
        if self.state != State::Check
            && self.push(&next, spindle, more, board, now) == Progress::Wait
        {
            return Some(Progress::Wait);
        }
        if let Wait::Arc(arc) = &mut self.activity.line.wait {
            arc.advance();
        }
        Some(Progress::Done)
    }

    fn arc(&self, travel: &Travel<AXES>, shape: &ArcShape) -> Result<ArcFeed<AXES>, ArcError> {
        let config = self.motion.config();
        let (first, second) = shape.plane.axes();
        let of = |axis: usize| config.acceleration.get(axis).copied().unwrap_or(0.0);
        let acceleration = of(first).min(of(second));
        let tolerance = config.arc_tolerance;
        ArcFeed::new(self.motion.path_end, travel, shape, acceleration, tolerance)
    }

    /// The line number that reports show for a move: its `N` word, or else the count of the
    /// program's lines if `$10` asks for line numbers.
    pub(super) fn line_of(&self, travel: &Travel<AXES>, kind: LineKind) -> Option<u32> {
        let counted = kind == LineKind::Program && self.reports(StatusReport::<AXES>::LINE);
        let count = Some(self.program.lines).filter(|_| counted);
        travel.line_number.or(count)
    }

    /// Plans a move, or waits for room.
    pub(crate) fn push<B: Board>(
        &mut self,
        next: &Move<AXES>,
        spindle: &Spindle,
        more: bool,
        board: &mut B,
        now: Instant,
    ) -> Progress {
        match self.motion.push(next, more, now) {
            Ok(pushed @ (Pushed::Queued | Pushed::Merged)) => {
                self.work.count_move(pushed);
                if !next.outputs.is_none() {
                    self.motion.outputs = OutputChange::NONE;
                }
                self.explain_move(next, board);
                self.motion.path_end = next.target;
                // While a jog moves, a laser burns in every motion mode. At rest afterwards it
                // burns in a cutting motion mode only.
                let cuts = !self.activity.line.is_jogging()
                    || self.program.interpreter.modal().motion.is_cutting();
                self.want_spindle(Spindle {
                    cutting: spindle.cutting && cuts,
                    ..*spindle
                });
                if self.activity.line.is_jogging() && self.state == State::Idle {
                    self.enter(State::Jog(Jog::Moving));
                }
                Progress::Done
            }
            Ok(Pushed::TooShort) => self.stay(next, spindle),
            Err(PushError::Full) => {
                self.motion.release();
                Progress::Wait
            }
            Err(PushError::TooFar | PushError::Invalid(_)) => self.refuse_move(),
        }
    }

    /// Carries out a move of less than one step. A laser at constant power still changes its power,
    /// once motion has ended.
    fn stay(&mut self, next: &Move<AXES>, spindle: &Spindle) -> Progress {
        if !self.tool.spindle.is_laser() || self.activity.line.is_jogging() {
            self.motion.path_end = next.target;
            return Progress::Done;
        }
        let changes = spindle.rotation == Rotation::Clockwise && self.changes_spindle(spindle);
        if changes && !self.is_motion_over() {
            return Progress::Wait;
        }
        self.motion.path_end = next.target;
        self.want_spindle(*spindle);
        Progress::Done
    }

    /// Refuses a move whose steps a motor's counter cannot hold, and with it the rest of its line.
    fn refuse_move(&mut self) -> Progress {
        self.program.interpreter.set_position(self.motion.path_end);
        if let Some(origin) = self.activity.line.finish() {
            self.answer(origin, Err(Status::InvalidTarget));
        }
        Progress::Wait
    }

    /// Begins the stop that ends in ALARM:2; the line under way stays unanswered until the reset.
    pub(crate) fn leave_travel<B: Board>(&mut self, board: &mut B, now: Instant) -> Progress {
        if self.motion.is_idle() {
            self.switch_outputs_off(board);
            self.raise(Alarm::SoftLimit, board);
        } else {
            self.motion.hold();
            self.enter(State::Hold(Hold::Stopping {
                since: now,
                then_alarm: true,
            }));
        }
        Progress::Wait
    }

    #[inline(never)] // it has many callers
    pub(crate) fn is_within_travel(&self, target: &[Coordinate; AXES]) -> bool {
        !self.settings.is_on(Setting::SoftLimits)
            || soft_limits::allow(target, &self.motion.bounds, &self.config.axes)
    }

    fn perform_dwell(&mut self, seconds: Number, now: Instant) -> Progress {
        if self.state == State::Check {
            return Progress::Done;
        }
        match self.activity.line.wakes() {
            Some(end) if now >= end => Progress::Done,
            Some(_) => Progress::Wait,
            None => {
                if self.is_motion_over() {
                    let micros = seconds.nanos().unsigned_abs() / 1_000;
                    let end = now + Duration::from_ticks(micros);
                    self.activity.line.wait = Wait::Dwell(end);
                }
                Progress::Wait
            }
        }
    }

    /// Notes an offset for the store, and waits until it is stored: an `ok` promises that the
    /// offset survives a power loss. The store is written at rest, so the command waits for motion
    /// to end, as in GRBL.
    fn perform_store(&mut self, id: OffsetId) -> Progress {
        if self.activity.line.is_storing() {
            return Progress::Done;
        }
        if self.is_motion_over() {
            self.store.unsaved.add_offset::<AXES>(id);
            self.activity.line.wait = Wait::Stored {
                then_restart: false,
            };
        }
        if self.activity.line.is_storing() && !self.is_storing() {
            Progress::Done
        } else {
            Progress::Wait
        }
    }

    /// Puts a work offset into effect once motion has ended, as GRBL does: reports subtract one
    /// offset from all positions. A change of the extruder's offset alone (`G92 E0` in mid-job)
    /// does not wait.
    fn perform_work_offset(&mut self, offset: &[Coordinate; AXES]) -> Progress {
        let moves_on = self.state == State::Check || self.is_offset_of_e(offset);
        if !moves_on && !self.is_motion_over() {
            return Progress::Wait;
        }
        self.program.work_offset = *offset;
        self.console.cadence.work_offset_changed();
        Progress::Done
    }

    fn perform_pause(&mut self) -> Progress {
        if self.state == State::Check || self.activity.line.is_paused() {
            return Progress::Done;
        }
        if self.is_motion_over() {
            self.activity.line.wait = Wait::Pause;
            self.enter(State::Hold(Hold::AT_REST));
        }
        Progress::Wait
    }

    fn perform_program_end<B: Board>(&mut self, board: &mut B) -> Progress {
        if self.state != State::Check {
            if !self.is_motion_over() {
                return Progress::Wait;
            }
            self.want_spindle(Spindle::default());
            self.set_coolant(CoolantOutput::default(), board);
            self.console.cadence.work_offset_changed();
            self.motion.outputs = OutputChange::NONE;
            self.tell_extension(Event::ProgramEnd);
            self.program.overrides = OverrideControl::ALL;
            self.reset_overrides();
        }
        self.program.lines = 0;
        self.console.message(Message::ProgramEnd);
        Progress::Done
    }
}

/// The planner's feed for one of `shares` equal parts of a motion.
pub(super) fn feed(feed: Feed, shares: f32) -> planner::Feed {
    match feed {
        Feed::Rapid => planner::Feed::Rapid,
        Feed::PerMinute(rate) => planner::Feed::PerMinute(rate.to_f32() / 60.0),
        Feed::InverseTime(rate) => planner::Feed::InverseTime(rate.to_f32() * shares / 60.0),
    }
}

fn move_kind(feed: Feed, kind: LineKind) -> MoveKind {
    match (kind, feed) {
        (LineKind::Jog, _) => MoveKind::Jog,
        (LineKind::Program, Feed::Rapid) => MoveKind::Rapid,
        (LineKind::Program, Feed::PerMinute(_) | Feed::InverseTime(_)) => MoveKind::Feed,
    }
}
