//! The rules that hold whenever the main loop has run: position and laser.
use super::Simulation;
use crate::observer::Observer;
use crate::trouble::Violation;
use leadscrew_machine::board::SpindleOutput;
use leadscrew_machine::extension::Extension;
use leadscrew_machine::settings::table::Setting;
use leadscrew_machine::state::{Door, Hold, State};
use leadscrew_planner::Kinematics;
use leadscrew_stepper::Power;

impl<K, O, X, const AXES: usize, const MOTORS: usize, const MOVES: usize>
    Simulation<'_, K, O, AXES, MOTORS, MOVES, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    O: Observer,
    X: Extension<AXES>,
{
    /// Checks the rules that hold whenever the main loop has run. `counted` is the position before
    /// the poll.
    pub(super) fn check(&mut self, counted: &[i32; MOTORS]) {
        let (now, after) = (self.now, self.shared.position());
        let made = self.board.plant.position();
        let invert = self.board.turned();
        if after != *counted || std::mem::take(&mut self.board.rewired) {
            self.position.compare_from_now(after, made);
        }
        if let Some((motor, counted, made)) = self.position.difference(after, made, invert) {
            self.board.violate(Violation::Position {
                cycle: now,
                motor,
                counted,
                made,
            });
            self.position
                .compare_from_now(after, self.board.plant.position());
        }
        self.check_laser();
    }

    /// Checks that the laser is off when it has to be. Power and state change in polls, and during
    /// motion at ticks. So a rule that holds before and after each poll holds at every instant of a
    /// rest.
    pub(super) fn check_laser(&mut self) {
        let on = self.board.power() != Power::OFF && self.has_laser_to_be_off();
        if on && !self.laser_noted {
            self.board.violate(Violation::LaserOn { cycle: self.now });
        }
        self.laser_noted = on;
    }

    fn has_laser_to_be_off(&self) -> bool {
        let resting = !self.shared.is_running();
        let constant = self.board.spindle() == SpindleOutput::Clockwise;
        let dark = match self.machine.state() {
            // A stop takes effect at once, not only with the next step. The laser is also off
            // during motion that the machine makes on its own.
            State::Alarm(_)
            | State::Sleep
            | State::Check
            | State::Home
            | State::Hold(Hold::Complete { .. })
            | State::Door(Door::Retracting | Door::Parked | Door::Restoring) => true,
            State::Idle
            | State::Run
            | State::Jog(_)
            | State::Hold(Hold::Stopping { .. })
            | State::Door(Door::Stopping) => resting && !constant,
        };
        dark && self.machine.settings().is_on(Setting::Laser)
    }
}
