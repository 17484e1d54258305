//! The states and times in which a laser is lit: one gate, and one rule.
//!
//! ```text
//!   Machine::enter(State) --> may_burn --no--> the gate is shut: neither a tick nor the main
//!                                | yes         loop puts out power
//!                                +--> in motion: the power of each segment
//!                                +--> at rest: beam()
//! ```
//!
//! A switch that stops the machine shuts the gate, too, in its interrupt ([`crate::inputs`]). The
//! gate is also shut while an M code is set aside (a tool change).

use crate::board::SpindleOutput;
use crate::state::{Door, Hold, Jog, State};
use crate::tool::scale::SpindleScale;
use leadscrew_stepper::Power;

/// The output of a laser.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Beam {
    /// Nothing.
    Dark,
    /// This power at any speed, and at rest (M3).
    Constant(Power),
    /// This power at the programmed speed, less when motion is slower, none at rest (M4).
    WithSpeed(Power),
}

/// The program's command to a laser.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Wanted {
    /// M3, M4 or M5.
    pub output: SpindleOutput,
    /// `S`, in the unit of `$30`.
    pub speed: f32,
    /// The motion mode burns: G1, G2 or G3.
    pub cutting: bool,
}

impl Wanted {
    /// Returns the beam of a move, at `percent` of the programmed `S`.
    pub fn beam(self, percent: u8, scale: &SpindleScale) -> Beam {
        let power = || scale.power(self.speed * f32::from(percent) / 100.0);
        match self.output {
            SpindleOutput::Clockwise if self.cutting => Beam::Constant(power()),
            SpindleOutput::CounterClockwise if self.cutting => Beam::WithSpeed(power()),
            SpindleOutput::Clockwise | SpindleOutput::CounterClockwise | SpindleOutput::Off => {
                Beam::Dark
            }
        }
    }
}

/// Returns the beam at rest. It is lit only in states in which a program or a jog may go on.
pub fn beam(state: State, wanted: Wanted, percent: u8, scale: &SpindleScale) -> Beam {
    match state {
        State::Idle | State::Run | State::Jog(Jog::Moving) => wanted.beam(percent, scale),
        State::Jog(Jog::Cancelling { .. })
        | State::Hold(_)
        | State::Home
        | State::Door(_)
        | State::Alarm(_)
        | State::Check
        | State::Sleep => Beam::Dark,
    }
}

/// Returns true if the gate is open. A motion that slows down on its path still burns with its
/// steps.
pub fn may_burn(state: State) -> bool {
    match state {
        State::Idle
        | State::Run
        | State::Jog(_)
        | State::Hold(Hold::Stopping { .. })
        | State::Door(Door::Stopping) => true,
        State::Hold(Hold::Complete { .. })
        | State::Home
        | State::Door(Door::Retracting | Door::Parked | Door::Restoring)
        | State::Alarm(_)
        | State::Check
        | State::Sleep => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Instant;
    use crate::state::Lock;
    use SpindleOutput::{Clockwise, CounterClockwise, Off};

    const SCALE: SpindleScale = SpindleScale {
        max: 1000.0,
        min: 0.0,
    };
    const SINCE: Instant = Instant::from_ticks(0);

    /// Each state, whether the gate is open in it, and whether a beam may stand.
    const STATES: [(State, bool, bool); 17] = [
        (State::Idle, true, true),
        (State::Run, true, true),
        (State::Jog(Jog::Moving), true, true),
        (
            State::Jog(Jog::Cancelling { then_door: false }),
            true,
            false,
        ),
        (State::Jog(Jog::Cancelling { then_door: true }), true, false),
        (hold_stopping(false), true, false),
        (hold_stopping(true), true, false),
        (State::Hold(Hold::AT_REST), false, false),
        (State::Home, false, false),
        (State::Door(Door::Stopping), true, false),
        (State::Door(Door::Retracting), false, false),
        (State::Door(Door::Parked), false, false),
        (State::Door(Door::Restoring), false, false),
        (State::Alarm(Lock::Unlockable), false, false),
        (State::Alarm(Lock::Critical), false, false),
        (State::Check, false, false),
        (State::Sleep, false, false),
    ];

    const fn hold_stopping(then_alarm: bool) -> State {
        State::Hold(Hold::Stopping {
            since: SINCE,
            then_alarm,
        })
    }

    fn wanted(output: SpindleOutput, cutting: bool) -> Wanted {
        Wanted {
            output,
            speed: 500.0,
            cutting,
        }
    }

    #[test]
    fn the_gate_is_open_where_a_program_or_a_jog_goes_on_or_slows_down() {
        for (state, open, _) in STATES {
            assert_eq!(may_burn(state), open, "{state:?}");
        }
    }

    #[test]
    fn at_rest_a_beam_stands_under_m3_in_a_cut_alone() {
        let half = SCALE.power(500.0);
        for (state, _, stands) in STATES {
            for output in [Off, Clockwise, CounterClockwise] {
                for cutting in [false, true] {
                    let expected = match (output, cutting && stands) {
                        (Clockwise, true) => Beam::Constant(half),
                        (CounterClockwise, true) => Beam::WithSpeed(half),
                        _ => Beam::Dark,
                    };
                    let found = beam(state, wanted(output, cutting), 100, &SCALE);
                    assert_eq!(found, expected, "{state:?} {output:?} {cutting}");
                }
            }
        }
    }

    #[test]
    fn no_beam_stands_where_the_gate_is_shut() {
        for (state, open, stands) in STATES {
            assert!(open || !stands, "{state:?}");
        }
    }

    #[test]
    fn the_override_acts_on_the_beam() {
        let found = beam(State::Idle, wanted(Clockwise, true), 150, &SCALE);
        assert_eq!(found, Beam::Constant(SCALE.power(750.0)));
    }
}
