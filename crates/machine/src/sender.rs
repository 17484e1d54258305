//! Watches over the sender of a job: what it has left on goes off, as [`guard`](crate::guard) says.

use crate::board::{Board, ChannelId, CoolantOutput, Instant, SpindleOutput};
use crate::extension::{Event, Extension};
use crate::guard::{Limits, Load, Why};
use crate::machine::Machine;
use crate::protocol::message::{Message, WentOff};
use crate::state::State;
use leadscrew_planner::Kinematics;
use leadscrew_stepper::Power;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Switches off what is left to itself without its sender for too long. Main loop, at every
    /// turn.
    pub(crate) fn watch_sender<B: Board>(&mut self, board: &mut B, now: Instant) {
        let watched = |load: &Load| self.is_left_on(*load);
        if !self.is_left_to_itself() || !Load::ALL.iter().any(watched) {
            return self.guard.rest();
        }
        let heard = self.console.take_heard(self.program.owner) && !self.guard.is_gone;
        for load in Load::ALL {
            let limits = if self.is_left_on(load) {
                Limits::of(load, &self.settings)
            } else {
                None
            };
            if let Some(why) = self.guard.watch(load, limits, heard, now) {
                self.switch_off(load, board, now);
                self.say_off(load, why);
            }
        }
        self.guard.fed = false;
    }

    /// Returns when a load goes off if nothing is heard until then. `chores`: of those that an
    /// extension has, which works at its own times in any case; otherwise of the others.
    pub(crate) fn load_ends(&self, chores: bool) -> Option<Instant> {
        self.guard
            .end(|load| (load == Load::Heat) == chores, &self.settings)
    }

    fn say_off(&mut self, load: Load, why: Why) {
        let (what, silence, unfed) = load.limits();
        let (why, setting) = match why {
            Why::Silent if load == Load::Heat || load == Load::Outputs => {
                ("their sender is silent", silence)
            }
            Why::Silent => ("its sender is silent", silence),
            Why::Unfed => ("no G-code has come", unfed),
        };
        let setting = setting.row().number;
        self.console
            .message(Message::WentOff(WentOff { what, why, setting }));
    }

    /// Returns true if motion rests, and no line is under way that ends by itself, but for a dwell.
    fn is_left_to_itself(&self) -> bool {
        let runs = self.activity.line.is_running() || self.program.startup.is_running();
        self.motion.is_at_rest() && !(runs && self.state.takes_lines())
    }

    /// Returns true if a load is on at rest, and time counts for it.
    fn is_left_on(&self, load: Load) -> bool {
        let dwells = self.activity.line.is_dwelling() && self.state.takes_lines();
        match load {
            Load::Laser => self.is_lit_at_rest(),
            Load::Spindle => {
                !dwells
                    && !self.tool.spindle.is_laser()
                    && self.tool.spindle.output(self.state) != SpindleOutput::Off
            }
            Load::Coolant => !dwells && self.tool.coolant.output() != CoolantOutput::default(),
            Load::Heat => X::IN_USE && self.extension.is_on(load),
            Load::Outputs => X::IN_USE && !dwells && self.extension.is_on(load),
        }
    }

    fn switch_off<B: Board>(&mut self, load: Load, board: &mut B, now: Instant) {
        if load == Load::Laser {
            self.stop_cutting();
            self.guard.is_dark = true;
            return;
        }
        if load != Load::Heat && !self.is_aside() {
            self.feed_hold(now);
        }
        let resumes = self.is_aside() || matches!(self.state, State::Hold(_) | State::Door(_));
        match load {
            Load::Spindle if resumes => {
                self.tool.spindle.suspend();
                self.update_power();
                self.console.cadence.overrides_changed();
            }
            Load::Spindle => self.switch_spindle_off(board),
            Load::Coolant if resumes => {
                self.tool.coolant.suspend(board);
                self.console.cadence.overrides_changed();
            }
            Load::Coolant => self.set_coolant(CoolantOutput::default(), board),
            Load::Laser | Load::Heat | Load::Outputs => {
                self.tell_extension(Event::LeftAlone { load, resumes });
            }
        }
    }

    /// Returns true if a laser is lit while the machine rests, and no dwell and no startup line is
    /// being carried out: then only the sender can put the laser out.
    pub(crate) fn is_lit_at_rest(&self) -> bool {
        self.state == State::Idle
            && self.tool.spindle.is_laser()
            && self.motion.is_idle()
            && !self.activity.line.is_busy()
            && !self.program.startup.is_running()
            && self.power_at_rest() > Power::OFF
    }

    /// Notes that a line of G-code has come from `id`. A laser that another sender has lit, or that
    /// has gone dark because that sender was silent, is switched off: M5.
    pub(crate) fn take_over<B: Board>(&mut self, id: ChannelId, board: &mut B) {
        let before = self.program.owner.replace(id);
        self.guard.is_gone = false;
        let anothers = before.is_some_and(|before| before != id);
        if anothers && (self.is_lit_at_rest() || self.guard.is_dark) {
            self.switch_spindle_off(board);
        }
    }
}
