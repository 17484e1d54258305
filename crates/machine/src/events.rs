//! Realtime commands and switches, which cannot wait for a line.

use crate::board::{Board, ChannelId, CoolantOutput, Duration, Instant};
use crate::config::CHANNELS;
use crate::console::Discard;
use crate::extension::Extension;
use crate::interpreter::{Coolant, OverrideControl};
use crate::machine::Machine;
use crate::protocol::alarm::Alarm;
use crate::protocol::message::Message;
use crate::protocol::realtime::Realtime;
use crate::protocol::serial::Request;
use crate::settings::table::Setting;
use crate::state::{Door, Hold, Jog, State};
use leadscrew_planner::Kinematics;

/// Realtime commands handled in one poll: bounds its time. Each channel has its share: at least one.
const REQUESTS_A_POLL: usize = 8;
const _: () = assert!(REQUESTS_A_POLL >= CHANNELS);

/// A resume within 2 ms after a hold in motion was sent in one burst with it. It is ignored, unless
/// a report has shown meanwhile that motion is at rest.
const BURST: Duration = Duration::from_ticks(2_000);

/// A resume this soon after the begin of the door's sequence was sent in one burst with 0x84. It is
/// ignored, unless a report has shown that the sequence is over. At rest Grbl takes one that comes
/// 1 ms later, and none right behind 0x84, which is 87 µs at 115 200 baud.
const DOOR_BURST: Duration = Duration::from_ticks(500);

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Handles realtime commands in the order in which each channel received them. Main loop.
    pub(crate) fn take_requests<B: Board>(&mut self, board: &mut B, now: Instant) {
        if self.console.has_requests() {
            self.handle_requests(board, now);
        }
    }

    #[inline(never)] // a raster's pixel takes 6978 instructions with it, 7015 without
    fn handle_requests<B: Board>(&mut self, board: &mut B, now: Instant) {
        while let Some(id) = self.console.next_opened() {
            self.say_lost(Some(id));
        }
        let overrides = self.overrides;
        for _ in 0..REQUESTS_A_POLL {
            let Some((channel, request)) = self.console.next_request() else {
                break;
            };
            self.work.requests = self.work.requests.wrapping_add(1);
            self.handle(channel, request, board, now);
        }
        if self.overrides != overrides {
            // Once for all overrides of this poll: each call plans the queue anew.
            self.override_motion();
        }
    }

    fn handle<B: Board>(&mut self, from: ChannelId, request: Request, board: &mut B, now: Instant) {
        match request.realtime {
            Realtime::Reset => self.reset(Discard::Before(from, request.mark), board, now),
            Realtime::Report => {
                if let Some(channel) = self.console.channel(from) {
                    channel.report_due = true;
                }
            }
            Realtime::Hold => self.feed_hold(now),
            Realtime::Resume => self.resume(board, now),
            Realtime::Door => self.open_door(board, now),
            Realtime::JogCancel => {
                if let Some(channel) = self.console.channel(from) {
                    channel.jogs_cancelled = Some(request.mark);
                }
                self.cancel_jog();
            }
            Realtime::Feed(step) => {
                if self.program.overrides.feed && self.overrides.step_feed(step) {
                    self.console.cadence.overrides_changed();
                }
            }
            Realtime::Rapid(rapid) => {
                if self.overrides.set_rapid(rapid) {
                    self.console.cadence.overrides_changed();
                }
            }
            Realtime::Spindle(step) => {
                let acts = self.program.overrides.spindle;
                let changed = acts && self.overrides.step_spindle(step);
                self.override_spindle(changed);
            }
            Realtime::SpindleStop => self.stop_spindle(now),
            Realtime::Flood => self.toggle_coolant(false, board),
            Realtime::Mist => self.toggle_coolant(true, board),
            Realtime::Own(byte) => self.own_realtime(from, byte, board, now),
        }
    }

    /// Handles switch edges since the last poll. Main loop.
    pub(crate) fn take_edges<B: Board>(&mut self, board: &mut B, now: Instant) {
        let edges = self.switches.inputs.edges();
        let before = core::mem::replace(&mut self.switches.edges, edges);
        let limit_hit = self.watch_limits(edges.limit_hits != before.limit_hits, board);
        if edges == before && !limit_hit {
            return;
        }
        if limit_hit {
            self.stop_at_limit(board, now);
        }
        if edges.resets != before.resets {
            self.reset(Discard::All, board, now);
        }
        if edges.doors != before.doors {
            self.open_door(board, now);
        }
        let held = edges.holds != before.holds;
        if held {
            self.feed_hold(now);
        }
        // Hold and start together, or start while hold is pressed: the hold stays.
        let hold_pressed = self.switches.inputs.active(&board.switches()).hold;
        if edges.starts != before.starts && !held && !hold_pressed {
            self.resume(board, now);
        }
        // The interrupt may have shut the laser's gate for an edge that has changed no state.
        self.set_gate();
    }

    fn stop_at_limit<B: Board>(&mut self, board: &mut B, now: Instant) {
        if self.config.rules.named && !matches!(self.state, State::Alarm(_) | State::Home) {
            return self.leave_limit(board, now);
        }
        self.motion.stop();
        if !matches!(self.state, State::Alarm(_)) {
            self.switch_outputs_off(board);
            self.raise(Alarm::HardLimit, board);
        }
    }

    pub(crate) fn feed_hold(&mut self, now: Instant) {
        let moving = !self.motion.is_idle();
        if let Some(next) = self.state.feed_hold(moving, now) {
            self.motion.hold();
            self.enter(next);
        }
    }

    fn cancel_jog(&mut self) {
        if let Some(next) = self.state.jog_cancel() {
            self.motion.hold();
            self.enter(next);
        }
    }

    /// Goes on after a hold, a pause or a closed door.
    fn resume<B: Board>(&mut self, board: &mut B, now: Instant) {
        if !self.extension_resumes(board, now) {
            return;
        }
        match self.state {
            State::Hold(Hold::Stopping {
                then_alarm: true, ..
            }) => {}
            State::Hold(Hold::Complete {
                goes_on_at: Some(_),
                ..
            }) => {}
            State::Hold(Hold::Complete { since: None, .. }) => self.end_hold(board, now),
            State::Hold(
                Hold::Stopping { since, .. }
                | Hold::Complete {
                    since: Some(since), ..
                },
            ) => {
                if now >= since + BURST {
                    self.end_hold(board, now);
                }
            }
            State::Door(Door::Parked) => {
                let began = self.activity.door.and_then(|door| door.since);
                let in_burst = began.is_some_and(|began| now < began + DOOR_BURST);
                if !in_burst && !self.is_door_open(board) {
                    self.begin_restoring();
                }
            }
            State::Idle | State::Run => {
                if !self.take_back(board) {
                    self.motion.release();
                }
            }
            State::Jog(_)
            | State::Home
            | State::Door(Door::Stopping | Door::Retracting | Door::Restoring)
            | State::Alarm(_)
            | State::Check
            | State::Sleep => {}
        }
    }

    /// Ends a hold; motion waits until a spindle that 0x9E has stopped is up to speed again.
    fn end_hold<B: Board>(&mut self, board: &mut B, now: Instant) {
        if self.is_aside() {
            return self.go_on();
        }
        self.tool.coolant.restore(board);
        if self.tool.spindle.is_suspended() || self.tool.spindle.is_shut(self.state) {
            self.restore_held_spindle(now);
        }
        match self.tool.up_to_speed_at.filter(|at| *at > now) {
            None => self.go_on(),
            goes_on_at => self.enter(State::Hold(Hold::Complete {
                since: None,
                goes_on_at,
            })),
        }
    }

    /// Goes on after a hold once the spindle is up to speed. Main loop, at every turn.
    pub(crate) fn end_spin_up(&mut self, now: Instant) {
        if self.spin_up_ends_at().is_some_and(|at| now >= at) {
            self.go_on();
        }
    }

    /// Returns when motion goes on after a hold, while it waits for the spindle.
    pub(crate) fn spin_up_ends_at(&self) -> Option<Instant> {
        match self.state {
            State::Hold(hold) => hold.goes_on_at(),
            _ => None,
        }
    }

    /// Notes that a report shows the state. A sender that has read that motion is at rest means its
    /// next `~`, however soon that comes.
    pub(crate) fn state_is_shown(&mut self) {
        match (&mut self.state, &mut self.activity.door) {
            (State::Hold(Hold::Complete { since, .. }), _) => *since = None,
            (State::Door(Door::Parked), Some(door)) => door.since = None,
            (_, _) => {}
        }
    }

    /// Takes up the motion that a hold or the door interrupted.
    pub(crate) fn go_on(&mut self) {
        self.motion.resume();
        self.enter(if self.motion.is_idle() {
            State::Idle
        } else {
            State::Run
        });
    }

    /// Begins the door's sequence, after 0x84 or an edge of the door's switch.
    pub(crate) fn open_door<B: Board>(&mut self, board: &mut B, now: Instant) {
        if self.state == State::Home {
            return self.fail_homing(Alarm::HomingDoor, board, now);
        }
        let moving = !self.motion.is_at_rest();
        let Some(next) = self.state.door_opens(moving) else {
            return;
        };
        self.console.message(Message::CheckDoor);
        if next != self.state {
            self.motion.hold();
            self.enter(next);
        }
    }

    fn override_motion(&mut self) {
        self.motion.set_overrides(leadscrew_planner::Overrides {
            feed: self.overrides.feed,
            rapid: self.overrides.rapid,
        });
    }

    /// In check mode the override changes in reports only: what turns goes on as it is.
    fn override_spindle(&mut self, changed: bool) {
        if changed {
            self.console.cadence.overrides_changed();
        }
        if changed && self.state != State::Check {
            self.tool.spindle.set_override(self.overrides.spindle);
            self.update_power();
        }
    }

    /// Lets overrides act, or not; one that does not is 100 %.
    pub(crate) fn control_overrides(&mut self, acts: OverrideControl) {
        self.program.overrides = acts;
        let (feed, spindle) = (self.overrides.feed, self.overrides.spindle);
        self.overrides.feed = if acts.feed { feed } else { 100 };
        if !acts.spindle {
            self.overrides.spindle = 100;
            self.override_spindle(spindle != 100);
        }
        self.console.cadence.overrides_changed();
        self.override_motion();
    }

    /// All overrides back to 100 %.
    pub(crate) fn reset_overrides(&mut self) {
        self.overrides = crate::overrides::Overrides::NONE;
        self.tool.spindle.set_override(100);
        self.update_power();
        self.console.cadence.overrides_changed();
        self.override_motion();
    }

    /// 0x9E: in a completed hold, switches the spindle off, or on again. A laser that is held stays
    /// dark until it is resumed.
    fn stop_spindle(&mut self, now: Instant) {
        let held = matches!(self.state, State::Hold(Hold::Complete { .. }));
        if !held || !self.tool.spindle.is_wanted() || self.tool.spindle.is_laser() {
            return;
        }
        if self.tool.spindle.is_suspended() {
            self.restore_held_spindle(now);
        } else {
            if self.spin_up_ends_at().is_some() {
                self.enter(State::Hold(Hold::AT_REST));
            }
            self.tool.spindle.suspend();
            self.update_power();
            self.console.cadence.overrides_changed();
        }
    }

    /// Switches the wanted spindle on again, out of a hold.
    fn restore_held_spindle(&mut self, now: Instant) {
        let stood = self.tool.spindle.is_suspended() && !self.tool.spindle.is_laser();
        self.restore_spindle();
        if self.tool.spindle.is_wanted() && !self.tool.spindle.is_suspended() {
            self.console.message(Message::RestoringSpindle);
            self.tool.up_to_speed_at = stood.then(|| now + self.spin_up());
        }
    }

    /// The time that a spindle takes to get up to speed: `$712`.
    fn spin_up(&self) -> Duration {
        let seconds = self.settings.value(Setting::SpinUp);
        Duration::from_ticks(seconds.nanos().unsigned_abs() / 1_000)
    }

    /// Switches the wanted spindle on again, unless an M code that is put aside keeps it off.
    pub(crate) fn restore_spindle(&mut self) {
        if self.is_put_aside() {
            return;
        }
        self.tool.spindle.restore();
        self.update_power();
        if self.tool.spindle.is_wanted() {
            self.console.cadence.overrides_changed();
        }
    }

    fn toggle_coolant<B: Board>(&mut self, mist: bool, board: &mut B) {
        match self.state {
            State::Idle | State::Run | State::Jog(_) | State::Hold(_) => {}
            State::Home | State::Door(_) | State::Alarm(_) | State::Check | State::Sleep => return,
        }
        if mist && !self.config.dialect.mist {
            return;
        }
        let mut wanted = self.tool.coolant.wanted();
        if mist {
            wanted.mist = !wanted.mist;
        } else {
            wanted.flood = !wanted.flood;
        }
        self.set_coolant(wanted, board);
    }

    /// Sets the valves, for the program or the operator; `$G` shows the last change.
    pub(crate) fn set_coolant<B: Board>(&mut self, wanted: CoolantOutput, board: &mut B) {
        self.program.interpreter.set_coolant(Coolant {
            mist: wanted.mist,
            flood: wanted.flood,
        });
        if wanted != self.tool.coolant.wanted() {
            self.tool.coolant.set(wanted, board);
            self.console.cadence.overrides_changed();
        }
    }

    /// Changes the state when moves, holds or cancels have ended. If segments ran out in
    /// motion, or the step interrupt does not come, raises an alarm. Main loop.
    pub(crate) fn watch_motion<B: Board>(&mut self, board: &mut B, now: Instant) {
        if self.motion.take_underrun() {
            return self.abort(Alarm::AbortedMotion, board, now);
        }
        if self.motion.take_stall() && !self.is_locked() {
            self.abort(Alarm::AbortedMotion, board, now);
            return self.console.message(Message::NoStepInterrupt);
        }
        match self.state {
            State::Hold(Hold::Stopping { .. })
            | State::Door(Door::Stopping)
            | State::Jog(Jog::Cancelling { .. }) => {
                if self.motion.is_at_rest() {
                    self.come_to_rest(board);
                }
            }
            State::Run => {
                if self.motion.is_idle() && !self.activity.line.is_running() {
                    self.enter(State::Idle);
                }
            }
            State::Jog(Jog::Moving) => {
                if self.motion.is_idle() && !self.activity.line.is_busy() {
                    self.enter(State::Idle);
                }
            }
            State::Idle
            | State::Hold(Hold::Complete { .. })
            | State::Home
            | State::Door(Door::Retracting | Door::Parked | Door::Restoring)
            | State::Alarm(_)
            | State::Check
            | State::Sleep => {}
        }
    }

    /// Enters the next state after a hold, a cancel or an opening door has brought motion to rest.
    fn come_to_rest<B: Board>(&mut self, board: &mut B) {
        let Some(next) = self.state.stopped() else {
            return;
        };
        if matches!(self.state, State::Jog(_)) {
            self.forget_jog();
        }
        self.enter(next);
        match next {
            State::Alarm(_) => {
                self.motion.forget();
                self.take_position();
                self.switch_outputs_off(board);
                self.raise(Alarm::SoftLimit, board);
            }
            State::Idle
            | State::Run
            | State::Jog(_)
            | State::Hold(_)
            | State::Home
            | State::Door(_)
            | State::Check
            | State::Sleep => {}
        }
    }

    /// Drops the rest of a cancelled jog, and answers its line if that is still under way.
    fn forget_jog(&mut self) {
        self.motion.forget();
        self.take_position();
        self.stop_cutting();
        if self.activity.line.is_jogging() {
            if let Some(origin) = self.activity.line.finish() {
                self.answer(origin, Ok(()));
            }
        }
    }
}
