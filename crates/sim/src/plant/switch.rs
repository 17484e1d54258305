//! Inputs, and the switches that carriages work.
//!
//! A switch changes its level when the carriage passes the switch's place. The positions between
//! two such places are a *window* in which no level changes, so that a step costs two comparisons
//! however many switches there are.

use leadscrew_machine::board::Switches;
use leadscrew_stepper::MotorMask;

/// A digital input of the board.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Pin {
    /// The limit switch of a motor.
    Limit(usize),
    /// The probe.
    Probe,
    /// The reset button.
    Reset,
    /// The feed hold button.
    Hold,
    /// The cycle start button.
    Start,
    /// The safety door.
    Door,
}

/// The side of its place on which a switch has its `level`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Side {
    /// At the place and above it.
    AtOrAbove,
    /// At the place and below it.
    AtOrBelow,
}

/// A switch that a carriage works.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Switch {
    /// The input that it is wired to.
    pub pin: Pin,
    /// The motor whose carriage works it; on crossed belts 0 and 1 are X and Y, which both motors
    /// move.
    pub motor: usize,
    /// The side on which the pin has `level`; on the other side it has the opposite level.
    pub side: Side,
    /// Its place in steps of the carriage.
    pub place: i32,
    /// Electrical level on `side`; `false` is a closed switch.
    pub level: bool,
}

impl Switch {
    pub(super) fn level_at(&self, position: i32) -> bool {
        let on_side = match self.side {
            Side::AtOrAbove => position >= self.place,
            Side::AtOrBelow => position <= self.place,
        };
        on_side == self.level
    }

    /// The positions around `position` at which this switch keeps its level.
    pub(super) fn window(&self, position: i32) -> (i32, i32) {
        let last_below = match self.side {
            Side::AtOrAbove => self.place.saturating_sub(1),
            Side::AtOrBelow => self.place,
        };
        if position <= last_below {
            (i32::MIN, last_below)
        } else {
            (last_below.saturating_add(1), i32::MAX)
        }
    }
}

/// Sets the level of a pin.
pub(super) fn set_level(levels: &mut Switches, pin: Pin, high: bool) {
    match pin {
        Pin::Limit(motor) => {
            let only = MotorMask::only(motor);
            levels.limits = if high {
                levels.limits.with(only)
            } else {
                levels.limits.without(only)
            };
        }
        Pin::Probe => levels.probe = high,
        Pin::Reset => levels.reset = high,
        Pin::Hold => levels.hold = high,
        Pin::Start => levels.start = high,
        Pin::Door => levels.door = high,
    }
}
