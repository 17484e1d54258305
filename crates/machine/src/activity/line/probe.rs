//! G38.2 to G38.5: straight on until the probe says stop.
//!
//! ```text
//!   wrong state at the start: ALARM:4
//!   Moving --contact latched by the switch interrupt--> Stopping --at rest--> [PRB:x,y,z:1]
//!     +--end of the motion without contact--> [PRB:...:0], ALARM:5 if contact was a must
//! ```
//!
//! During a hold, or while the door is open, contact is latched but does not end the probing.
//! Probing ends once motion may go on, without another step.

use super::perform::feed;
use super::{LineKind, Probing, Progress, Wait};
use crate::board::{Board, Instant};
use crate::extension::Extension;
use crate::inputs::ProbeWatch;
use crate::interpreter::{ProbeKind, Travel};
use crate::machine::Machine;
use crate::protocol::alarm::Alarm;
use crate::state::State;
use leadscrew_planner::{Kinematics, Move, MoveKind};

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    pub(super) fn perform_probe<B: Board>(
        &mut self,
        travel: &Travel<AXES>,
        kind: ProbeKind,
        board: &mut B,
        now: Instant,
    ) -> Progress {
        match self.activity.line.wait {
            Wait::Probe(Probing::Moving) => self.watch_probe(kind, board),
            Wait::Probe(Probing::Stopping) => {
                if self.motion.is_at_rest() {
                    self.end_probe(true, kind, board);
                    return Progress::Done;
                }
                Progress::Wait
            }
            Wait::Nothing
            | Wait::Arc(_)
            | Wait::Dwell(_)
            | Wait::Pause
            | Wait::Own(_)
            | Wait::Stored { .. } => self.begin_probe(travel, kind, board, now),
        }
    }

    fn begin_probe<B: Board>(
        &mut self,
        travel: &Travel<AXES>,
        kind: ProbeKind,
        board: &mut B,
        now: Instant,
    ) -> Progress {
        if !self.is_within_travel(&travel.target) {
            return self.leave_travel(board, now);
        }
        if self.state == State::Check {
            return Progress::Done;
        }
        if let Some(not_yet) = self.ask_move(travel, LineKind::Program) {
            return not_yet;
        }
        if !self.is_motion_over() {
            return Progress::Wait;
        }
        let contact = self.switches.inputs.active(&board.switches()).probe;
        if contact == kind.toward {
            self.program.interpreter.set_position(self.motion.path_end);
            self.raise(Alarm::ProbeContactTooEarly, board);
            return Progress::Done;
        }
        self.switches.inputs.watch_probe(if kind.toward {
            ProbeWatch::Contact
        } else {
            ProbeWatch::Release
        });
        let next = Move {
            target: travel.target,
            feed: self.feed_to(&travel.target, feed(travel.feed, 1.0)),
            power: self.move_power(&travel.spindle),
            curve: None,
            rounding: self.program.interpreter.rounding(),
            outputs: self.outputs_of(LineKind::Program),
            line_number: self.line_of(travel, LineKind::Program),
            kind: MoveKind::System,
        };
        if self.push(&next, &travel.spindle, false, board, now) == Progress::Done {
            self.motion.release();
            self.activity.line.wait = Wait::Probe(Probing::Moving);
        }
        Progress::Wait
    }

    fn watch_probe<B: Board>(&mut self, kind: ProbeKind, board: &mut B) -> Progress {
        if self.switches.inputs.latched().is_some() {
            self.motion.hold();
            self.activity.line.wait = Wait::Probe(Probing::Stopping);
            if self.motion.is_at_rest() {
                self.end_probe(true, kind, board);
                return Progress::Done;
            }
        } else if self.motion.is_idle() {
            self.end_probe(false, kind, board);
            return Progress::Done;
        }
        Progress::Wait
    }

    /// Reports a probing motion that has come to rest, and goes on from the place at which it
    /// stopped.
    fn end_probe<B: Board>(&mut self, contact: bool, kind: ProbeKind, board: &mut B) {
        let latched = self.switches.inputs.latched();
        self.switches.inputs.watch_probe(ProbeWatch::Off);
        self.motion.forget();
        self.take_position();
        self.program.probed.contact = contact;
        match latched {
            Some(steps) if contact => self.program.probed.position = self.motion.axes(&steps),
            _ if kind.must_trigger => self.raise(Alarm::ProbeNoContact, board),
            _ => self.program.probed.position = self.motion.position(),
        }
        self.report_probe();
    }
}
