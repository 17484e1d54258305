//! The tool: spindle or laser, and the coolant.
//!
//! This file says which output is wanted of spindle or laser.
//!
//! | file | it says |
//! |---|---|
//! | [`beam`](mod@beam) | when a laser is lit |
//! | `scale` | which power an `S` is |
//! | [`coolant`] | which valves are open |
//! | `output` | which direction and power go out at rest |

pub mod beam;
pub mod coolant;
mod output;
pub(crate) mod scale;

use crate::board::{Instant, SpindleOutput};
use crate::interpreter;
use crate::state::State;
use beam::{beam, may_burn, Beam, Wanted};
use coolant::Coolant;
use leadscrew_stepper::Power;

pub use scale::SpindleScale;

/// Spindle or laser, and coolant: the wishes of program and operator, and the outputs as they are.
pub(crate) struct Tool {
    pub(crate) spindle: Spindle,
    pub(crate) coolant: Coolant,
    /// The time at which a spindle that was switched on again in a hold is up to speed.
    pub(crate) up_to_speed_at: Option<Instant>,
    /// The program's last command to the spindle.
    pub(crate) told: interpreter::Spindle,
    /// The power that was put out in this rest; `None` in motion, and if it has to be put out
    /// anew.
    rest_power: Option<Power>,
    /// The direction that was put out in this rest; `None` as for the power.
    rest_output: Option<SpindleOutput>,
}

impl Tool {
    /// Makes a tool that is off. `laser`: whether a laser stands in the spindle's place.
    pub(crate) fn new(scale: SpindleScale, laser: bool) -> Self {
        Self {
            spindle: Spindle::new(scale, laser),
            coolant: Coolant::default(),
            up_to_speed_at: None,
            told: interpreter::Spindle::default(),
            rest_power: None,
            rest_output: None,
        }
    }

    /// Motion begins, and brings its own power: in the next rest, direction and power are put out
    /// anew.
    pub(crate) fn leave_rest(&mut self) {
        self.rest_power = None;
        self.rest_output = None;
    }
}

/// The spindle, or the laser in its place: the output that is wanted, and the reason that keeps it
/// off for now.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Spindle {
    wanted: Wanted,
    /// The override of the spindle, percent.
    percent: u8,
    /// Kept off by the door, 0x9E or an M code that is set aside, whatever is wanted.
    suspended: bool,
    /// `Some` while the spindle stands until the next move or spindle command: the speed that
    /// reports show meanwhile, RPM.
    stands_at: Option<f32>,
    scale: SpindleScale,
    /// A laser stands in its place (`$32`).
    laser: bool,
}

impl Spindle {
    /// Makes a spindle that stands.
    pub fn new(scale: SpindleScale, laser: bool) -> Self {
        Self {
            wanted: Wanted {
                output: SpindleOutput::Off,
                speed: 0.0,
                cutting: false,
            },
            percent: 100,
            suspended: false,
            stands_at: None,
            scale,
            laser,
        }
    }

    /// Puts new settings into effect.
    pub fn configure(&mut self, scale: SpindleScale, laser: bool) {
        self.scale = scale;
        self.laser = laser;
    }

    /// Notes the wanted state from now on; moves bring the power of a laser along.
    pub fn want(&mut self, wanted: Wanted) {
        self.stands_at = None;
        self.wanted = wanted;
    }

    /// Stops until the next move or spindle command wants something; reports show `speed`
    /// meanwhile, RPM: a spindle's as long as nothing else happens, as in Grbl. A laser's tell that
    /// it is dark.
    pub fn stand(&mut self, speed: f32) {
        self.stands_at = Some(speed);
    }

    /// Makes reports tell that it stands, if it does.
    pub fn show_that_it_stands(&mut self) {
        self.stands_at = self.stands_at.and(Some(0.0));
    }

    /// Returns true if it waits for the next move or spindle command.
    pub fn stands(&self) -> bool {
        self.stands_at.is_some()
    }

    /// Sets the override in percent.
    pub fn set_override(&mut self, percent: u8) {
        self.percent = percent;
    }

    /// Switches off until [`Spindle::restore`]; the wanted state is kept.
    pub fn suspend(&mut self) {
        self.suspended = true;
    }

    /// Switches the wanted state on again.
    pub fn restore(&mut self) {
        self.suspended = false;
    }

    /// Returns true if the laser's gate is to be shut.
    pub fn is_shut(&self, state: State) -> bool {
        self.laser && (self.suspended || !may_burn(state))
    }

    /// Returns the direction to put out.
    pub fn output(&self, state: State) -> SpindleOutput {
        if self.suspended || self.stands() || self.is_shut(state) {
            SpindleOutput::Off
        } else {
            self.wanted.output
        }
    }

    /// Returns true if a laser stands in the spindle's place.
    pub fn is_laser(&self) -> bool {
        self.laser
    }

    /// Returns true if it is meant to be on.
    pub fn is_wanted(&self) -> bool {
        self.wanted.output != SpindleOutput::Off
    }

    /// Returns true if it is kept off, although it may be wanted.
    pub fn is_suspended(&self) -> bool {
        self.suspended
    }

    /// Returns the direction, while the wanted speed is above 0; off otherwise.
    pub fn accessory(&self) -> SpindleOutput {
        self.turning_at(self.wanted_speed())
    }

    /// Returns the direction, as reports show it (`A:S`, `A:C`), at a speed in RPM: a laser that is
    /// dark does not turn.
    pub fn turning_at(&self, speed: f32) -> SpindleOutput {
        if speed > 0.0 && !self.stands() {
            self.wanted.output
        } else {
            SpindleOutput::Off
        }
    }

    /// Returns the speed as reports show it, RPM. A laser's speed follows the power that is put
    /// out, `out`, not `S`.
    pub fn reported_speed(&self, out: Power) -> f32 {
        match self.stands_at {
            Some(speed) if !self.laser => speed,
            Some(_) => 0.0,
            None if !self.laser || out == self.power() => self.actual_speed(),
            None => self.scale.speed(out),
        }
    }

    /// Returns the beam of a move with this command to the laser, without the override.
    pub fn beam_of_move(&self, wanted: Wanted) -> Beam {
        wanted.beam(100, &self.scale)
    }

    /// Returns the power of a spindle in motion and at rest.
    pub fn power(&self) -> Power {
        self.scale.power(self.wanted_speed())
    }

    /// Returns the power at rest.
    pub fn power_at_rest(&self, state: State) -> Power {
        if !self.laser {
            return self.power();
        }
        match beam(state, self.wanted, self.percent, &self.scale) {
            Beam::Constant(_) if self.stands() => Power::OFF,
            Beam::Constant(power) => power,
            Beam::WithSpeed(_) | Beam::Dark => Power::OFF,
        }
    }

    /// Returns the speed that is put out now, between `$31` and `$30`; 0 while off. RPM.
    pub fn actual_speed(&self) -> f32 {
        self.scale.within(self.wanted_speed())
    }

    /// The speed that is wanted now, with the override; 0 while off. RPM.
    fn wanted_speed(&self) -> f32 {
        if self.suspended || self.stands() || !self.is_wanted() {
            return 0.0;
        }
        self.wanted.speed * f32::from(self.percent) / 100.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_stepper::PowerScale;

    const GRBL: SpindleScale = SpindleScale {
        max: 1000.0,
        min: 0.0,
    };

    fn clockwise(speed: f32) -> Wanted {
        Wanted {
            output: SpindleOutput::Clockwise,
            speed,
            cutting: false,
        }
    }

    #[test]
    fn power_is_in_proportion_between_the_two_settings() {
        assert_eq!(GRBL.power(0.0), Power::OFF);
        assert_eq!(GRBL.power(500.0).level(PowerScale::new(1000)), 500);
        assert_eq!(GRBL.power(1000.0), Power::FULL);
        assert_eq!(GRBL.power(5000.0), Power::FULL);
    }

    #[test]
    fn a_speed_at_or_below_the_least_gives_the_least_power() {
        let scale = SpindleScale {
            max: 1000.0,
            min: 200.0,
        };
        assert_eq!(scale.power(1.0), scale.power(200.0));
        assert!(scale.power(1.0) > Power::OFF);
    }

    #[test]
    fn where_the_settings_are_not_in_order_any_speed_is_full_power() {
        for (max, min) in [(0.0, 100.0), (0.0, 0.0), (100.0, 100.0)] {
            let mut spindle = Spindle::new(SpindleScale { max, min }, false);
            spindle.want(clockwise(1.0));
            assert_eq!(spindle.power(), Power::FULL, "$30={max} $31={min}");
            assert_eq!(spindle.accessory(), SpindleOutput::Clockwise);
            assert_eq!(spindle.reported_speed(spindle.power()), max.max(1.0));
            spindle.want(clockwise(0.0));
            assert_eq!(spindle.power(), Power::OFF, "$30={max} $31={min}");
        }
    }

    #[test]
    fn a_speed_out_of_range_is_reported_as_it_is_put_out() {
        let scale = SpindleScale {
            max: 100.0,
            min: 10.0,
        };
        let mut spindle = Spindle::new(scale, false);
        for (speed, reported) in [(5.0, 10.0), (50.0, 50.0), (200.0, 100.0), (0.0, 0.0)] {
            spindle.want(clockwise(speed));
            assert_eq!(
                spindle.reported_speed(spindle.power()),
                reported,
                "S{speed}"
            );
        }
    }

    #[test]
    fn a_spindle_turns_in_every_state_and_a_laser_follows_the_beam() {
        let wanted = Wanted {
            cutting: true,
            ..clockwise(1000.0)
        };
        for (laser, state, power, output) in [
            (true, State::Idle, Power::FULL, SpindleOutput::Clockwise),
            (true, State::Check, Power::OFF, SpindleOutput::Off),
            (false, State::Check, Power::FULL, SpindleOutput::Clockwise),
        ] {
            let mut spindle = Spindle::new(GRBL, laser);
            spindle.want(wanted);
            assert_eq!(spindle.power_at_rest(state), power, "{laser} {state:?}");
            assert_eq!(spindle.output(state), output, "{laser} {state:?}");
        }
    }
}
