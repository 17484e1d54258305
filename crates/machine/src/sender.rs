//! The laser and its sender: the laser goes off when its sender falls silent, goes away, or another
//! sender takes over.
//!
//! The sender is the serial line that sent the last line of G-code. A laser lit by a startup line
//! belongs to every sender.

use crate::activity::line::{LineKind, Origin};
use crate::board::{Board, ChannelId, Duration, Instant};
use crate::extension::Extension;
use crate::interpreter::{Command, Spindle, Travel};
use crate::machine::Machine;
use crate::protocol::message::Message;
use crate::settings::table::Setting;
use crate::state::State;
use crate::tool::dead_man::DeadMan;
use leadscrew_planner::Kinematics;
use leadscrew_stepper::Power;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// How long a laser stays lit at rest although its sender is silent: `$707`.
    pub(crate) fn patience(&self) -> Option<Duration> {
        let nanos = self.settings.value(Setting::LaserPatience).nanos();
        let micros = nanos.unsigned_abs() / 1_000;
        (micros > 0).then(|| Duration::from_ticks(micros))
    }

    /// Puts out a laser that is lit at rest once its sender has been silent for too long. Main
    /// loop, at every turn.
    pub(crate) fn watch_sender(&mut self, now: Instant) {
        let heard = self.console.take_heard(self.program.owner);
        let lit = self.is_lit_at_rest();
        let patience = if lit { self.patience() } else { None };
        if self.tool.dead_man.watch(lit, heard, patience, now) {
            self.stop_cutting();
            self.console.message(Message::SenderSilent);
        }
    }

    /// The spindle for a motion. Once the sender has been silent for too long, a laser stays dark,
    /// until a cut of a program lights it up again.
    pub(crate) fn light_of(&mut self, travel: &Travel<AXES>, kind: LineKind) -> Spindle {
        if kind == LineKind::Program && travel.spindle.cutting {
            self.tool.dead_man = DeadMan::Dark;
        }
        self.light_at_rest(&travel.spindle)
    }

    /// As [`Machine::light_of`], for a line that moves nothing.
    pub(crate) fn light_at_rest(&self, spindle: &Spindle) -> Spindle {
        Spindle {
            cutting: spindle.cutting && self.tool.dead_man != DeadMan::Expired,
            ..*spindle
        }
    }

    /// Notes that a line of G-code has come from `id`. A laser that another sender has lit, or that
    /// has gone dark because that sender was silent, is switched off: M5.
    pub(crate) fn take_over<B: Board>(&mut self, id: ChannelId, board: &mut B) {
        let before = self.program.owner.replace(id);
        let anothers = before.is_some_and(|before| before != id);
        if anothers && (self.is_lit_at_rest() || self.tool.dead_man == DeadMan::Expired) {
            self.switch_spindle_off(board);
        }
    }

    /// Ends the job of `id`, whose other end has gone away: M5 after its last line, where its job
    /// used a laser.
    pub(crate) fn end_job_of<B: Board>(&mut self, id: ChannelId, board: &mut B, now: Instant) {
        if self.program.owner != Some(id) {
            return;
        }
        self.program.owner = None;
        if self.tool.spindle.is_laser() && self.tool.spindle.is_wanted() {
            self.program.interpreter.stop_spindle();
            let commands = self.activity.line.commands();
            commands.clear();
            // The first of an empty list always fits.
            let _ = commands.push(Command::Spindle(Spindle::default()));
            self.activity.line.begin(Origin::Nobody, LineKind::Program);
            self.execute(board, now);
        }
    }

    /// Whether a laser is lit at rest with nothing under way that would end that: no motion, no
    /// dwell, no startup line.
    fn is_lit_at_rest(&self) -> bool {
        self.state == State::Idle
            && self.tool.spindle.is_laser()
            && self.motion.is_idle()
            && !self.activity.line.is_busy()
            && !self.program.startup.is_running()
            && self.power_at_rest() > Power::OFF
    }
}
