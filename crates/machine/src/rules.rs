//! Rules of limit switches that Grbl has not: they hold if the machine's build asks for them
//! ([`SwitchRules`](crate::config::SwitchRules)).
//!
//! ```text
//!   edge --> stopped at its step --> [MSG:X high] --> back off (X, Y) --> ALARM:1, `$X` unlocks
//! ```

use crate::activity::line::Origin;
use crate::activity::switch_cycle::{LastMove, Phase, SwitchCycle, Wait};
use crate::board::{Board, Instant};
use crate::config::AxisMask;
use crate::extension::Extension;
use crate::inputs::{ActiveSwitches, InputConfig};
use crate::machine::Machine;
use crate::motion::own_feed;
use crate::protocol::alarm::Alarm;
use crate::protocol::report::AXIS_LETTERS;
use crate::settings::table::Setting;
use crate::state::State;
use core::cmp::Ordering;
use core::fmt;
use leadscrew_planner::{Coordinate, Kinematics, Move, MoveKind, MovePower, THREE_DECIMALS};
use leadscrew_stepper::{MotorMask, OutputChange};

/// The axes that back off: X and Y.
const BACK_OFF: AxisMask = 0b11;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Names the switches that have stopped the machine. Then the machine backs off, or is locked.
    /// Main loop.
    pub(crate) fn leave_limit<B: Board>(&mut self, board: &mut B, now: Instant) {
        self.motion.stop();
        self.switch_outputs_off(board);
        let closed = self.switches.ends.closed;
        let mut back = 0;
        for (axis, (end, letter)) in closed.iter().zip(AXIS_LETTERS).enumerate() {
            let Some(end) = end else { continue };
            let word = match end {
                Ordering::Greater => " high",
                Ordering::Less => " low",
                Ordering::Equal => "",
            };
            self.console.say(format_args!("[MSG:{letter}{word}]"));
            if *end != Ordering::Equal {
                back |= MotorMask::only(axis).bits();
            }
        }
        let back = back & BACK_OFF;
        if back == 0 || self.config.rules.back_off_mm <= 0.0 {
            return self.abort(Alarm::HardLimit, board, now);
        }
        self.take_position();
        self.switches.inputs.configure(&InputConfig {
            hard_limits: false,
            ..self.input_config()
        });
        self.enter(State::Home);
        self.activity.switch_cycle = Some(SwitchCycle {
            origin: Origin::Nobody,
            groups: [0; 4],
            one_by_one: 0,
            last: LastMove::BackOff(back),
            phase: Phase::Search,
            wait: Wait::Settled(now),
        });
    }

    /// Goes on with the last move of homing, or with the way off a limit switch; then ends the
    /// cycle.
    pub(crate) fn advance_last_move<B: Board>(
        &mut self,
        cycle: &SwitchCycle,
        board: &mut B,
        now: Instant,
    ) {
        if cycle.last == LastMove::None {
            return self.end_homing();
        }
        match cycle.wait {
            Wait::Settled(instant) if now < instant || self.motion.is_stopping() => {}
            Wait::Settled(_) => {
                self.motion.shared.set_motor_lock(MotorMask::NONE);
                let next = self.last_move(cycle.last);
                // A distance of 0 plans nothing: the move then ends at once.
                let _ = self.motion.push_aside(&next);
                if let Some(cycle) = &mut self.activity.switch_cycle {
                    cycle.wait = Wait::Motion;
                }
            }
            Wait::Motion if !self.motion.is_aside_idle() => {}
            Wait::Motion => {
                self.motion.end_aside();
                self.take_position();
                match cycle.last {
                    LastMove::BackOff(_) => self.end_back_off(board, now),
                    LastMove::ToZero(_) | LastMove::None => self.end_homing(),
                }
            }
        }
    }

    fn end_back_off<B: Board>(&mut self, board: &mut B, now: Instant) {
        self.activity.switch_cycle = None;
        self.release_homing();
        self.enter(State::Run);
        self.abort(Alarm::HardLimit, board, now);
    }

    fn last_move(&self, last: LastMove) -> Move<AXES> {
        let back = Coordinate::from_mm(self.config.rules.back_off_mm).unwrap_or_default();
        let (axes, is_back) = match last {
            LastMove::BackOff(axes) => (axes, true),
            LastMove::ToZero(axes) => (axes, false),
            LastMove::None => (0, false),
        };
        let mut target = self.motion.position();
        let ends = self.switches.ends.closed;
        for (axis, (target, end)) in target.iter_mut().zip(ends).enumerate() {
            *target = match end {
                _ if axes >> axis & 1 == 0 => *target,
                _ if !is_back => Coordinate::ZERO,
                Some(Ordering::Greater) => *target - back,
                Some(Ordering::Less) => *target + back,
                Some(Ordering::Equal) | None => *target,
            };
        }
        let rate = self.settings.value(Setting::HomingSeek).to_f32();
        Move {
            target,
            feed: own_feed(rate * libm::sqrtf(axes.count_ones() as f32)),
            power: MovePower::Off,
            curve: None,
            rounding: THREE_DECIMALS,
            outputs: OutputChange::NONE,
            line_number: None,
            kind: MoveKind::System,
        }
    }

    /// The field `Sw:`, if the build asks for it.
    pub(crate) fn closed_switches(&self, active: &ActiveSwitches) -> ClosedSwitches<AXES> {
        let axes = match self.config.rules.reported {
            true => self.switches.axes_at_limits(active),
            false => MotorMask::NONE,
        };
        ClosedSwitches {
            axes,
            ends: self.switches.ends.closed,
        }
    }
}

/// Switches that are closed, with their ends; displayed as `|Sw:X+,Z-`, or nothing.
pub(crate) struct ClosedSwitches<const AXES: usize> {
    axes: MotorMask,
    ends: [Option<Ordering>; AXES],
}

impl<const AXES: usize> fmt::Display for ClosedSwitches<AXES> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "|Sw:";
        for (axis, (end, letter)) in self.ends.iter().zip(AXIS_LETTERS).enumerate() {
            if !self.axes.contains(axis) {
                continue;
            }
            let sign = match end {
                Some(Ordering::Greater) => "+",
                Some(Ordering::Less) => "-",
                Some(Ordering::Equal) | None => "",
            };
            write!(f, "{separator}{letter}{sign}")?;
            separator = ",";
        }
        Ok(())
    }
}
