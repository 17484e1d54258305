//! The safety door: stop, switch off, get out of the way; and back again.
//!
//! ```text
//!  Door:2  stop --> pull out --> spindle, coolant off --> park      Door:1 / Door:0 (open / shut)
//!  Door:3  unpark --> spindle on, 4 s --> coolant on, 1 s --> back into the work
//!                                                             --> laser on, Run or Idle
//! ```
//!
//! The motions are left out on machines without parking or without homing (`$22`), while parking is
//! forbidden (M56 P0), and if the spindle is already higher than the parking place. There is no
//! wait for an output that was off. A laser needs no wait either: it comes on again with the
//! program. `$SLP` does the same up to `park`.

use super::door_cycle::{DoorCycle, Step};
use crate::board::{Board, Duration, Instant};
use crate::config::ParkingConfig;
use crate::extension::Extension;
use crate::machine::Machine;
use crate::motion::own_feed;
use crate::settings::table::Setting;
use crate::state::{Door, State};
use leadscrew_planner::{Kinematics, Move, MoveKind, MovePower, THREE_DECIMALS};
use leadscrew_stepper::OutputChange;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Goes on with the door's sequence. Main loop.
    pub(crate) fn advance_door<B: Board>(&mut self, board: &mut B, now: Instant) {
        match self.state {
            State::Door(Door::Retracting) => self.retract(board, now),
            State::Door(Door::Restoring) => self.restore(board, now),
            State::Sleep => self.retract_to_sleep(board),
            State::Door(Door::Stopping | Door::Parked)
            | State::Idle
            | State::Run
            | State::Jog(_)
            | State::Hold(_)
            | State::Home
            | State::Alarm(_)
            | State::Check => {}
        }
    }

    fn retract<B: Board>(&mut self, board: &mut B, now: Instant) {
        if !self.motion.is_aside_idle() {
            return;
        }
        match self.activity.door.map(|door| door.step) {
            None => self.begin_retracting(now),
            Some(Step::PullOut) => {
                self.suspend_outputs(board);
                self.move_spindle_axis(Step::Park);
            }
            Some(Step::Park | Step::Parked) => self.set_door_step(Step::Parked, Door::Parked),
            // The door opened again on the way back.
            Some(Step::Unpark | Step::SpindleRunsUp(_) | Step::CoolantFlows(_) | Step::Plunge) => {
                self.set_door_step(Step::PullOut, Door::Retracting);
                self.move_spindle_axis(Step::PullOut);
            }
        }
    }

    /// Retracts on the way to sleep, from which only a reset leads back.
    fn retract_to_sleep<B: Board>(&mut self, board: &mut B) {
        if !self.motion.is_aside_idle() {
            return;
        }
        match self.activity.door.map(|door| door.step) {
            None => {}
            Some(Step::PullOut) => {
                self.suspend_outputs(board);
                self.move_spindle_axis(Step::Park);
            }
            Some(_) => {
                self.activity.door = None;
                self.motion.forget();
                self.take_position();
                self.fall_asleep(board);
            }
        }
    }

    /// Returns true if retracting moves the spindle axis out of the way.
    pub(crate) fn parks(&self) -> bool {
        let position = self.motion.position();
        self.parking()
            .is_some_and(|parking| parking.is_worth_it(&position))
    }

    pub(crate) fn begin_retracting(&mut self, now: Instant) {
        let left_at = self.parks().then(|| self.motion.position());
        self.activity.door = Some(DoorCycle {
            step: Step::PullOut,
            since: Some(now),
            left_at,
        });
        self.move_spindle_axis(Step::PullOut);
    }

    pub(crate) fn suspend_outputs<B: Board>(&mut self, board: &mut B) {
        self.tool.spindle.suspend();
        self.update_power();
        self.tool.coolant.suspend(board);
        self.console.cadence.overrides_changed();
    }

    /// Begins the way back: the door is shut and the operator resumes.
    pub(crate) fn begin_restoring(&mut self) {
        self.enter(State::Door(Door::Restoring));
        self.move_spindle_axis(Step::Unpark);
    }

    fn restore<B: Board>(&mut self, board: &mut B, now: Instant) {
        if !self.motion.is_aside_idle() {
            return;
        }
        match self.activity.door.map(|door| door.step) {
            None => self.leave_door(),
            Some(Step::PullOut | Step::Park | Step::Parked | Step::Unpark) => {
                let delay = self.restore_spindle_after_door();
                self.set_door_step(Step::SpindleRunsUp(now + delay), Door::Restoring);
            }
            Some(Step::SpindleRunsUp(ready)) if now >= ready => {
                let delay = self.restore_coolant_after_door(board);
                self.set_door_step(Step::CoolantFlows(now + delay), Door::Restoring);
            }
            Some(Step::CoolantFlows(ready)) if now >= ready => {
                self.move_spindle_axis(Step::Plunge);
            }
            Some(Step::SpindleRunsUp(_) | Step::CoolantFlows(_)) => {}
            Some(Step::Plunge) => self.leave_door(),
        }
    }

    fn leave_door(&mut self) {
        self.activity.door = None;
        self.motion.end_aside();
        self.go_on();
    }

    /// Switches the spindle on again; returns how long to wait until it is up to speed. A laser has
    /// no delay; its gate stays shut until motion goes on.
    fn restore_spindle_after_door(&mut self) -> Duration {
        self.restore_spindle();
        if self.tool.spindle.is_wanted() && !self.tool.spindle.is_laser() {
            self.config.spindle_delay
        } else {
            NO_DELAY
        }
    }

    fn restore_coolant_after_door<B: Board>(&mut self, board: &mut B) -> Duration {
        if self.is_aside() {
            return NO_DELAY;
        }
        self.tool.coolant.restore(board);
        if !self.tool.coolant.is_wanted() {
            return NO_DELAY;
        }
        self.console.cadence.overrides_changed();
        self.config.coolant_delay
    }

    fn set_door_step(&mut self, step: Step, phase: Door) {
        if let Some(door) = &mut self.activity.door {
            door.step = step;
        }
        self.enter(State::Door(phase));
    }

    /// Plans the motion of `step`, if the machine parks at all.
    fn move_spindle_axis(&mut self, step: Step) {
        let Some(door) = &mut self.activity.door else {
            return;
        };
        door.step = step;
        let (Some(left_at), Some(parking)) = (door.left_at, self.config.options.parking) else {
            return;
        };
        let (height, rate) = match step {
            Step::PullOut => (parking.pulled_out(&left_at), parking.pull_out_rate),
            Step::Park => (parking.target(), parking.rate),
            Step::Unpark => (parking.pulled_out(&left_at), parking.rate),
            Step::Plunge => (parking.of(&left_at), parking.pull_out_rate),
            Step::Parked | Step::SpindleRunsUp(_) | Step::CoolantFlows(_) => return,
        };
        let mut target = left_at;
        if let Some(axis) = target.get_mut(parking.axis) {
            *axis = height;
        }
        // If the axis is there already, nothing is planned and the step ends at once.
        let _ = self.motion.push_aside(&Move {
            target,
            feed: own_feed(rate),
            // This keeps a laser dark. A spindle does not take its power from moves.
            power: MovePower::Off,
            curve: None,
            rounding: THREE_DECIMALS,
            outputs: OutputChange::NONE,
            line_number: None,
            kind: MoveKind::System,
        });
    }

    /// Returns how to park; `None` if parking is not allowed now.
    fn parking(&self) -> Option<ParkingConfig> {
        let allowed = self.program.parking_allowed && self.settings.is_on(Setting::Homing);
        self.config.options.parking.filter(|_| allowed)
    }
}

const NO_DELAY: Duration = Duration::from_ticks(0);
