//! Commands of the tool: spindle or laser, coolant, what overrides them.

use super::{Progress, Wait};
use crate::board::{Board, CoolantOutput, Duration, Instant, SpindleOutput};
use crate::extension::Extension;
use crate::interpreter::{Coolant, OverrideControl, Rotation, Spindle};
use crate::machine::Machine;
use crate::settings::table::Setting;
use crate::state::State;
use crate::tool::beam::{Beam, Wanted};
use leadscrew_planner::{Kinematics, MovePower};

/// The longest time that a spindle takes, s: an hour.
const LONGEST_RUN: f32 = 3_600.0;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    pub(super) fn perform_spindle(&mut self, spindle: &Spindle, now: Instant) -> Progress {
        if self.state == State::Check {
            return Progress::Done;
        }
        if let Some(end) = self.activity.line.wakes() {
            return match now >= end {
                true => Progress::Done,
                false => Progress::Wait,
            };
        }
        if self.changes_at_rest(spindle) && !self.is_motion_over() {
            return Progress::Wait;
        }
        let wait = self.run_time(spindle);
        self.want_spindle(self.light_at_rest(spindle));
        self.console.cadence.overrides_changed();
        if wait == 0 {
            return Progress::Done;
        }
        self.activity.line.wait = Wait::Dwell(now + Duration::from_ticks(wait.into()));
        Progress::Wait
    }

    /// Returns how long a spindle takes from its present state to this one, µs: `$716` to `$718`. A
    /// laser takes no time.
    fn run_time(&self, to: &Spindle) -> u32 {
        if self.tool.spindle.is_laser() {
            return 0;
        }
        let from = self.tool.told;
        let value = |setting| self.settings.value(setting).to_f32();
        let (mut seconds, mut by) = (0.0, to.speed.to_f32());
        if from.rotation == to.rotation {
            by -= from.speed.to_f32();
        } else {
            if from.rotation != Rotation::Off {
                seconds = value(Setting::SpindleRunDown);
            }
            if to.rotation != Rotation::Off {
                seconds += value(Setting::SpindleRunUp);
            }
        }
        if to.rotation != Rotation::Off {
            seconds += value(Setting::SpindleRunUpBySpeed) * by.abs() / 1_000.0;
        }
        (seconds.min(LONGEST_RUN) * 1e6) as u32
    }

    /// Returns true if a spindle command changes the output at rest. It does not for a laser under
    /// M4, which is off at rest: each of its moves has its own power.
    fn changes_at_rest(&self, spindle: &Spindle) -> bool {
        let dynamic = Rotation::Counterclockwise;
        let rotations = (self.tool.told.rotation, spindle.rotation);
        !self.tool.spindle.is_laser() || rotations != (dynamic, dynamic)
    }

    pub(super) fn perform_override_control(&mut self, acts: OverrideControl) -> Progress {
        if !cfg!(feature = "linuxcnc") || self.state == State::Check {
            return Progress::Done;
        }
        if !self.is_motion_over() {
            return Progress::Wait;
        }
        self.control_overrides(acts);
        Progress::Done
    }

    pub(super) fn perform_coolant<B: Board>(
        &mut self,
        coolant: Coolant,
        board: &mut B,
    ) -> Progress {
        if self.state == State::Check {
            return Progress::Done;
        }
        if !self.is_motion_over() {
            return Progress::Wait;
        }
        self.set_coolant(
            CoolantOutput {
                flood: coolant.flood,
                mist: coolant.mist,
            },
            board,
        );
        Progress::Done
    }

    /// Notes the spindle's state for the moves planned from now on. A spindle that
    /// [`crate::tool::Spindle::stand`] has stopped turns again.
    pub(crate) fn want_spindle(&mut self, spindle: Spindle) {
        if spindle.rotation == Rotation::Off {
            self.guard.is_dark = false;
        }
        if self.changes_spindle(&spindle) || self.tool.spindle.stands() {
            let (stood, before) = (self.tool.spindle.stands(), self.tool.spindle.accessory());
            self.tool.spindle.want(wanted(&spindle));
            self.tool.told = spindle;
            self.update_power();
            if !stood && self.tool.spindle.accessory() != before {
                self.console.cadence.overrides_changed();
            }
        }
    }

    /// Keeps a laser dark at rest until the program cuts again. Called when the machine has moved
    /// by itself, or a motion has not reached its end.
    pub(crate) fn stop_cutting(&mut self) {
        self.want_spindle(Spindle {
            cutting: false,
            ..self.tool.told
        });
    }

    pub(super) fn changes_spindle(&self, spindle: &Spindle) -> bool {
        *spindle != self.tool.told
    }

    pub(super) fn move_power(&self, spindle: &Spindle) -> MovePower {
        if !self.tool.spindle.is_laser() {
            return MovePower::Spindle {
                power: self.tool.spindle.power(),
            };
        }
        match self.tool.spindle.beam_of_move(wanted(spindle)) {
            Beam::Constant(power) => MovePower::Constant { power },
            Beam::WithSpeed(power) => MovePower::Dynamic { power },
            Beam::Dark => MovePower::Off,
        }
    }
}

fn wanted(spindle: &Spindle) -> Wanted {
    Wanted {
        output: match spindle.rotation {
            Rotation::Clockwise => SpindleOutput::Clockwise,
            Rotation::Counterclockwise => SpindleOutput::CounterClockwise,
            Rotation::Off => SpindleOutput::Off,
        },
        speed: spindle.speed.to_f32(),
        cutting: spindle.cutting,
    }
}
