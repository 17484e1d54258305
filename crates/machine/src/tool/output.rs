//! The tool follows the state: the laser's gate, and the output of spindle or laser at rest.
//!
//! [`Machine::enter`] is the only writer of the state, [`Machine::put_out_tool`] the only place
//! at which power comes on out of motion. The rule for a laser is in [`mod@crate::tool::beam`].

use crate::board::{Board, SpindleOutput};
use crate::extension::{Event, Extension};
use crate::machine::Machine;
use crate::motion::PowerRule;
use crate::state::State;
use leadscrew_planner::Kinematics;
use leadscrew_stepper::Power;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Changes the state, and the laser's gate with it.
    pub(crate) fn enter(&mut self, state: State) {
        self.history.leaves(self.state);
        self.state = state;
        if state != State::Idle {
            self.tool.spindle.show_that_it_stands();
        }
        self.set_gate();
        self.tell_extension(Event::Enters(state));
    }

    /// Opens or shuts the laser's gate, as the state wants it. After a switch has stopped the
    /// machine, the gate stays shut until the main loop has dealt with that edge, which it may not
    /// have seen yet.
    pub(crate) fn set_gate(&mut self) {
        let shut = self.tool.spindle.is_shut(self.state);
        if shut != self.motion.shared.is_laser_off() {
            self.motion.shared.set_laser_off(shut);
        }
        // Looked at after the gate was set: an edge in between is seen here, and the interrupt
        // shuts the gate for a later one.
        if self.switches.inputs.edges().stops() != self.switches.edges.stops() {
            self.motion.shared.set_laser_off(true);
        }
    }

    /// Puts out the direction and the power that belong to the state, while motion rests. Main
    /// loop.
    pub(crate) fn put_out_tool<B: Board>(&mut self, board: &mut B) {
        if !self.motion.is_at_rest() {
            return;
        }
        let output = self.tool.spindle.output(self.state);
        if self.tool.rest_output != Some(output) {
            board.set_spindle(output);
            self.tool.rest_output = Some(output);
        }
        let power = self.power_at_rest();
        // Moves that wait bring their own power along; until they begin, no laser lights up for
        // them.
        let of_moves =
            self.tool.spindle.is_laser() && power != Power::OFF && !self.motion.is_idle();
        if !of_moves && self.tool.rest_power != Some(power) {
            board.set_power(power);
            self.tool.rest_power = Some(power);
            // A switch may have shut the gate since the power was computed.
            if self.motion.shared.is_laser_off() {
                board.set_power(Power::OFF);
                self.tool.rest_power = None;
            }
        }
    }

    /// The power while motion rests.
    pub(crate) fn power_at_rest(&self) -> Power {
        if self.motion.shared.is_laser_off() {
            Power::OFF
        } else {
            self.tool.spindle.power_at_rest(self.state)
        }
    }

    /// Switches the spindle off, and its power at once: M5, until a line says otherwise.
    pub(crate) fn switch_spindle_off<B: Board>(&mut self, board: &mut B) {
        self.program.interpreter.stop_spindle();
        self.want_spindle(crate::interpreter::Spindle::default());
        self.tool.spindle.restore();
        self.update_power();
        board.set_power(Power::OFF);
        self.tool.rest_power = None;
        board.set_spindle(SpindleOutput::Off);
        self.tool.rest_output = None;
    }

    /// Gives the segments made from now on the power that the spindle is to have.
    pub(crate) fn update_power(&mut self) {
        let rule = if self.tool.spindle.is_laser() {
            PowerRule::Laser {
                percent: self.overrides.spindle,
            }
        } else {
            PowerRule::Spindle(self.tool.spindle.power())
        };
        self.motion.set_power_rule(rule);
    }
}
