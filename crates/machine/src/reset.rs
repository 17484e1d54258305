//! Power-up, soft reset and alarms: the ways into a known state.

use crate::board::{Board, ChannelId, CoolantOutput, Instant};
use crate::console::Discard;
use crate::extension::{Event, Extension};
use crate::inputs::ProbeWatch;
use crate::machine::Machine;
use crate::protocol::alarm::Alarm;
use crate::protocol::cadence::Cadence;
use crate::protocol::message::Message;
use crate::protocol::report::BANNER;
use crate::protocol::status::Status;
use crate::settings::table::Setting;
use crate::state::{Lock, State};
use leadscrew_planner::Kinematics;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Soft reset: 0x18, or the reset button, which locks the machine, too. Main loop.
    ///
    /// Bytes from before are dropped, bytes from after are kept. A line under way is answered
    /// before the banner, never after it.
    pub(crate) fn reset<B: Board>(&mut self, discard: Discard, board: &mut B, now: Instant) {
        if self.state == State::Home {
            return self.reset_homing(discard, board, now);
        }
        let aborted = self.is_in_motion();
        self.motion.stop();
        if aborted {
            self.raise(Alarm::AbortedMotion, board);
            if self.config.rules.drops_drivers {
                self.motion.drivers.drop(board);
            }
        }
        self.restart(discard, board, now);
    }

    /// Ends everything under way with an alarm. Motion stops without a deceleration, if it has not
    /// stopped already: motors may have lost steps. Lines and cycles end as in a reset; modes stay.
    pub(crate) fn abort<B: Board>(&mut self, alarm: Alarm, board: &mut B, now: Instant) {
        if self.state == State::Home {
            return self.fail_homing(alarm, board, now);
        }
        self.motion.stop();
        self.switch_outputs_off(board);
        self.raise(alarm, board);
        self.end_cycles();
        self.complete_lines();
        self.take_position();
    }

    /// Ends everything under way because a part of the board has failed, and tells the reason,
    /// [`Board::locked`]. Main loop, after a [`Machine::poll`].
    pub fn fail<B: Board>(&mut self, board: &mut B, now: Instant) {
        self.abort(Alarm::AbortedMotion, board, now);
        if let Some(why) = board.locked() {
            self.tell(why);
        }
    }

    /// Tells the operator something about the board, in 64 characters at most. Main loop.
    pub fn tell(&mut self, text: &'static str) {
        self.console.message(Message::Board(text));
    }

    /// The reset itself, after any alarm that it raises.
    pub(crate) fn restart<B: Board>(&mut self, discard: Discard, board: &mut B, now: Instant) {
        self.end_cycles();
        self.complete_lines();
        if let Some(kept) = self.activity.kept.take() {
            self.console.block(kept.id, false);
        }
        self.console.discard(discard);
        self.switch_outputs_off(board);
        self.program.reset();
        self.guard.is_gone = false;
        self.take_position();
        self.reset_overrides();
        self.tell_extension(Event::Reset);
        self.console.time_left = None;
        self.enter(match self.state {
            // Whoever presses the button wants the machine to stand still.
            _ if discard == Discard::All => State::Alarm(Lock::Unlockable),
            State::Alarm(_) | State::Sleep => State::Alarm(Lock::Unlockable),
            State::Idle
            | State::Run
            | State::Jog(_)
            | State::Hold(_)
            | State::Home
            | State::Door(_)
            | State::Check => State::Idle,
        });
        self.greet(board, now);
    }

    /// The banner and the lines after it: warnings, then startup lines unless locked.
    pub(crate) fn greet<B: Board>(&mut self, board: &mut B, now: Instant) {
        self.console.cadence = Cadence::new();
        if self.store.lost {
            let status = Status::StoreUnreadable.number();
            self.console.broadcast(format_args!("error:{status}"));
        }
        self.console.broadcast("");
        self.console.broadcast(BANNER);
        if let Some(why) = board.locked() {
            self.enter(State::Alarm(Lock::Unlockable));
            return self.console.message(Message::Board(why));
        }
        if self.is_at_limit(board) {
            self.enter(State::Alarm(Lock::Unlockable));
            self.console.message(Message::CheckLimits);
        }
        let active = self.switches.inputs.active(&board.switches());
        if active.reset {
            self.enter(State::Alarm(Lock::Unlockable));
            self.console.message(Message::ResetHeld);
        }
        if let State::Alarm(_) = self.state {
            self.console.message(Message::Locked);
            return self.say_lost(None);
        }
        if active.door {
            self.open_door(board, now);
        }
        self.program.startup.begin(None);
    }

    /// Says that stored values are lost, if that is so and nobody has unlocked the machine
    /// since: to one channel, or to all.
    pub(crate) fn say_lost(&mut self, to: Option<ChannelId>) {
        match to {
            _ if !self.store.lost => {}
            Some(id) => self.console.tell(id, Message::SettingsLost),
            None => self.console.message(Message::SettingsLost),
        }
    }

    /// Locks the machine and says why. A laser goes off, until a line after the lock wants it. A
    /// spindle goes on, as in Grbl: an alarm alone does not stop it.
    pub(crate) fn raise<B: Board>(&mut self, alarm: Alarm, board: &mut B) {
        if self.tool.spindle.is_laser() {
            self.switch_spindle_off(board);
        }
        self.history.last_alarm = Some(alarm);
        self.console
            .broadcast(format_args!("ALARM:{}", alarm.number()));
        let unknown = X::IN_USE && matches!(alarm, Alarm::Own(_));
        if unknown || self.settings.is_on(Setting::FaultTexts) {
            let text = self.alarm_text(alarm);
            self.console.say(format_args!("[MSG:{text}]"));
        }
        let is_kept = self.config.rules.named && alarm == Alarm::HardLimit;
        let lock = if alarm.needs_reset() && !is_kept {
            self.console.message(Message::ResetToContinue);
            Lock::Critical
        } else {
            Lock::Unlockable
        };
        self.enter(State::Alarm(lock));
    }

    /// Switches spindle and coolant off, for good. At rest or after a stop: the power goes off at
    /// once, not with the next step, which may be long in coming. (After a stop the step interrupt
    /// puts out no power.)
    pub(crate) fn switch_outputs_off<B: Board>(&mut self, board: &mut B) {
        self.switch_spindle_off(board);
        self.tool.coolant.restore(board);
        self.set_coolant(CoolantOutput::default(), board);
    }

    /// Takes the place of the motors as the end of the path, from which the program goes on.
    #[inline(never)] // inlined, machine 004 (`examples/machines/004`) takes 712 bytes more
    pub(crate) fn take_position(&mut self) {
        let position = self.motion.position();
        self.motion.path_end = position;
        self.program.interpreter.set_position(position);
    }

    fn is_in_motion(&self) -> bool {
        // The reset button stops the motors before the main loop learns of it: by now they may
        // stand.
        let stopped = self.motion.shared.is_stopped();
        self.state.is_moving() && (stopped || !self.motion.is_at_rest())
    }

    /// Answers the lines under way, before the banner: after it an answer would mean nothing to
    /// their sender.
    fn complete_lines(&mut self) {
        let aside = self.end_aside();
        let waiting = self.program.startup.cancel().into_iter().chain(aside);
        for origin in self.activity.line.finish().into_iter().chain(waiting) {
            self.answer(origin, Ok(()));
        }
    }

    /// Ends homing, probing and the door's sequence, without an answer or a message.
    fn end_cycles(&mut self) {
        self.activity.switch_cycle = None;
        self.activity.door = None;
        self.release_homing();
        self.switches.inputs.watch_probe(ProbeWatch::Off);
    }
}
