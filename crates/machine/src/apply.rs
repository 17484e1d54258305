//! Settings put into effect: from exact decimals in the table to the values of planner, board and
//! inputs.

use crate::board::Board;
use crate::derived::{counts, pacing, planner_config, port_config, reach, spindle_scale};
use crate::extension::Extension;
use crate::home;
use crate::inputs::InputConfig;
use crate::machine::Machine;
use crate::settings::table::Setting;
use leadscrew_planner::Kinematics;
use leadscrew_stepper::Ticks;

impl<K, X, const AXES: usize, const MOTORS: usize> Machine<'_, K, AXES, MOTORS, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    X: Extension<AXES>,
{
    /// Puts all settings into effect. At rest with nothing planned: at boot and after a change.
    pub(crate) fn apply_settings<B: Board>(&mut self, board: &mut B) {
        self.look_at_limits(board);
        let settings = &self.settings;
        self.motion.reach = reach(settings);
        self.motion.bounds = home::bounds(settings, &self.motion.reach);
        self.switches.inputs.configure(&self.input_config());
        let laser = settings.is_on(Setting::Laser);
        let another_tool = laser != self.tool.spindle.is_laser();
        self.tool.spindle.configure(spindle_scale(settings), laser);
        let config = planner_config(settings, &self.config, MOTORS);
        let pacing = pacing(settings, laser);
        let scale = self.motion.config().steps_per_mm;
        // The table takes no value that the planner refuses: a test in `derived.rs` checks each
        // setting.
        let _sound = self.motion.configure(config, pacing);
        if self.motion.config().steps_per_mm != scale {
            // The counted steps stay the same, but they now stand for another position.
            self.take_position();
        }
        self.update_power();
        self.motion.shared.set_direction_wait(self.direction_wait());
        board.configure(&port_config(&self.settings));
        if another_tool {
            // Switching `$32` resets the tool: M3 for a spindle was no order to a laser, and the
            // reverse.
            self.switch_spindle_off(board);
        }
        self.set_gate();
    }

    /// The least time between two ticks when the direction changes between them: the time until
    /// the direction pins have changed, and then `$709`.
    fn direction_wait(&self) -> Ticks {
        let (timing, pulse_us) = (
            &self.config.step_timing,
            port_config(&self.settings).pulse_us,
        );
        let setup_ns = self.settings.whole(Setting::DirectionSetup) * 1_000;
        let wait_ns = timing.direction_out_ns(pulse_us) + setup_ns;
        counts(wait_ns, self.config.timer_hz)
    }

    /// The configuration of the switch inputs, from settings and build.
    pub(crate) fn input_config(&self) -> InputConfig {
        InputConfig {
            limits_invert: self.settings.is_on(Setting::LimitInvert),
            probe_invert: self.settings.is_on(Setting::ProbeInvert),
            hard_limits: self.settings.is_on(Setting::HardLimits),
            door: self.config.options.door,
            absent: self.switches.absent,
        }
    }
}
