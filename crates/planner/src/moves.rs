//! The requests to the planner, and its own record of them.

use crate::built::CURVES;
use crate::real::min;
use crate::{Coordinate, Curve, Overrides};
use leadscrew_stepper::{OutputChange, Power};

/// A straight move to an exact target.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Move<const AXES: usize> {
    /// The end of the move, machine position.
    pub target: [Coordinate; AXES],
    /// The speed asked for.
    pub feed: Feed,
    /// Laser or spindle power along the move.
    pub power: MovePower,
    /// The arc that the move is a chord of.
    pub curve: Option<Curve>,
    /// The greatest distance of the target from the curve that was meant, on each axis, because the
    /// program's numbers are rounded, mm, 0 or more. A chord of an arc does not need it.
    pub rounding: f32,
    /// The outputs that change with the move's start: no later than its first step.
    pub outputs: OutputChange,
    /// The `N` word of the line that asked for the move.
    pub line_number: Option<u32>,
    /// The kind of the move: it says which override applies.
    pub kind: MoveKind,
}

/// The speed asked for along the path.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Feed {
    /// As fast as the axes allow.
    Rapid,
    /// `F` in G94, in mm/s, above 0.
    PerMinute(f32),
    /// `F` in G93, in 1/s, above 0: the whole move takes 1/F.
    InverseTime(f32),
}

/// Laser or spindle power along a move, at a planned rest after the move, and when a feed hold
/// stops within the move.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MovePower {
    /// No power: a rapid in laser mode, or a spindle that does not turn.
    #[default]
    Off,
    /// A spindle: the power stays through rests and holds.
    Spindle {
        /// Power during the move, and after it until the next move.
        power: Power,
    },
    /// A laser at constant power (M3). It stays on at a planned rest after the move, and is off
    /// when a feed hold stops.
    Constant {
        /// Power along the move.
        power: Power,
    },
    /// A laser whose power follows the speed (M4); off at any rest.
    Dynamic {
        /// Power at the programmed feed: half of it at half the speed.
        power: Power,
    },
}

impl MovePower {
    /// Returns the power that the program asks for along the move, at its programmed feed.
    pub fn programmed(self) -> Power {
        match self {
            Self::Off => Power::OFF,
            Self::Spindle { power } | Self::Constant { power } | Self::Dynamic { power } => power,
        }
    }

    /// Power at a planned rest after the move.
    pub(crate) fn at_rest(self) -> Power {
        match self {
            Self::Off | Self::Dynamic { .. } => Power::OFF,
            Self::Spindle { power } | Self::Constant { power } => power,
        }
    }

    /// The same kind of power with another value; [`MovePower::Off`] stays off.
    pub(crate) fn with(self, power: Power) -> Self {
        match self {
            Self::Off => Self::Off,
            Self::Spindle { .. } => Self::Spindle { power },
            Self::Constant { .. } => Self::Constant { power },
            Self::Dynamic { .. } => Self::Dynamic { power },
        }
    }

    /// The same power, but a laser's constant power follows the speed.
    pub(crate) fn with_speed(self) -> Self {
        match self {
            Self::Constant { power } => Self::Dynamic { power },
            Self::Off | Self::Spindle { .. } | Self::Dynamic { .. } => self,
        }
    }

    /// Power when a feed hold has stopped.
    pub(crate) fn held(self) -> Power {
        match self {
            Self::Off | Self::Dynamic { .. } | Self::Constant { .. } => Power::OFF,
            Self::Spindle { power } => power,
        }
    }
}

/// The kind of motion of a move: decides which override applies.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MoveKind {
    /// G0: the rapid override.
    Rapid,
    /// G1, G2, G3: the feed override.
    Feed,
    /// `$J=`: none.
    Jog,
    /// Homing, probing, parking: none.
    System,
}

/// A move in the queue. Sized for 1024 of them on the F407: 76 bytes with three motors.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct PlannedMove<const AXES: usize, const MOTORS: usize> {
    /// Signed steps of each motor.
    pub(crate) delta: [i32; MOTORS],
    pub(crate) power: MovePower,
    /// Length of the path, mm.
    pub(crate) length: f32,
    /// Acceleration along the path if the path is straight, mm/s².
    pub(crate) acceleration: f32,
    /// Highest speed along the path whatever the override, mm/s.
    pub(crate) rate: f32,
    /// Speed along the path as programmed, mm/s.
    pub(crate) feed: f32,
    /// Curvature of the path at the move's start, divided by the acceleration of each axis, s²/mm²
    /// (see `polygon`).
    pub(crate) bend: [f32; AXES],
    /// The length of path to each side of the move's start for which `bend` holds, mm; 0: the path
    /// has no curvature there.
    pub(crate) reach: f32,
    /// The limit at the move's start by corner and curvature: a squared speed, in units of
    /// [`SpeedUnit`](crate::config::SpeedUnit).
    pub(crate) corner: u32,
    /// The limit at the move's start by corner, curvature, and the nominal speeds of this move and
    /// the one before: a squared speed, in the same units.
    pub(crate) cap: u32,
    /// The highest squared speed at the move's start for which all later limits can be kept, in the
    /// same units (see `lookahead`).
    pub(crate) entry: u32,
    pub(crate) line_number: u32,
    pub(crate) outputs: OutputChange,
    /// The number of pixels of the pool that belong to this move. A pixel is a change of power
    /// within a move.
    pub(crate) pixels: u16,
    pub(crate) kind: MoveKind,
    /// The share of the coarsest axis in the direction, in 1/127, if its steps are too coarse to
    /// tell (see `coarse`); 0: the steps tell the direction.
    pub(crate) coarse: i8,
    /// True if some of the move's pixels are rapids. Then the rapid override bounds the move's
    /// speed, too.
    pub(crate) has_gaps: bool,
    /// True if `entry` would be higher if motion could go on after the last planned move.
    pub(crate) bound_by_end: bool,
}

/// Stands for no line number: GRBL's line numbers end at 10 million.
const NO_LINE_NUMBER: u32 = u32::MAX;

impl<const AXES: usize, const MOTORS: usize> PlannedMove<AXES, MOTORS> {
    /// The `N` word of the line that asked for it.
    pub(crate) fn line_number(&self) -> Option<u32> {
        (self.line_number != NO_LINE_NUMBER).then_some(self.line_number)
    }

    /// Stores a line number in four bytes.
    pub(crate) fn pack(line_number: Option<u32>) -> u32 {
        line_number.unwrap_or(NO_LINE_NUMBER)
    }

    /// Makes a planned move for `of`. The caller sets its limits, and everything that depends on
    /// the queue.
    pub(crate) fn new(of: &Move<AXES>, delta: [i32; MOTORS]) -> Self {
        Self {
            delta,
            power: of.power,
            length: 0.0,
            acceleration: 0.0,
            rate: 0.0,
            feed: 0.0,
            bend: [0.0; AXES],
            reach: 0.0,
            corner: u32::MAX,
            cap: u32::MAX,
            entry: 0,
            line_number: Self::pack(of.line_number),
            outputs: of.outputs,
            pixels: 0,
            kind: of.kind,
            coarse: 0,
            has_gaps: false,
            bound_by_end: true,
        }
    }

    /// Steps of the dominant motor.
    pub(crate) fn events(&self) -> u32 {
        let steps = self.delta.iter().map(|steps| steps.unsigned_abs());
        steps.fold(0, u32::max)
    }

    /// Steps of the dominant motor in a mm of path.
    pub(crate) fn steps_per_mm(&self) -> f32 {
        self.events() as f32 / self.length
    }

    /// Returns true if the path goes straight on from the move before it, or has a corner there.
    pub(crate) fn is_straight(&self) -> bool {
        !CURVES || self.reach == 0.0
    }

    /// Returns true if it begins at a corner or at rest.
    pub(crate) fn has_corner(&self) -> bool {
        self.is_straight() && self.corner < u32::MAX
    }

    /// With a jerk limit, once the turn at the move's start is known, `bend` holds the law of the
    /// curve there (see `zones`): `b` and `q`.
    pub(crate) fn law(&self) -> [f32; 2] {
        self.bend.first().map_or([0.0; 2], |packed| unpack(*packed))
    }

    /// Sets the numbers of [`PlannedMove::law`]. What is near the move is not known yet.
    pub(crate) fn set_law(&mut self, law: [f32; 2]) {
        self.bend = [0.0; AXES];
        if let Some(first) = self.bend.first_mut() {
            *first = pack(law);
        }
    }

    /// With a jerk limit, once the move is planned: the law of all places near it, and the highest
    /// squared speed by them (mm²/s²), if they are the same all along the move.
    pub(crate) fn near(&self) -> Option<([f32; 2], f32)> {
        let [_, law, top_v2, ..] = self.bend.as_slice() else {
            return None;
        };
        (*top_v2 > 0.0).then(|| (unpack(*law), *top_v2))
    }

    /// Sets the numbers of [`PlannedMove::near`]. Two axes have no room for them.
    pub(crate) fn set_near(&mut self, near: Option<([f32; 2], f32)>) {
        if let [_, law, top_v2, ..] = self.bend.as_mut_slice() {
            (*law, *top_v2) = near.map_or((0.0, 0.0), |(near, top_v2)| (pack(near), top_v2));
        }
    }

    /// Returns true if `of` is a straight move that differs from this one only in its target.
    pub(crate) fn goes_on_with(&self, of: &Move<AXES>) -> bool {
        self.pixels == 0
            && of.curve.is_none()
            && of.feed == Feed::PerMinute(self.feed)
            && self.outputs.is_none()
            && of.outputs.is_none()
            && (self.power, self.kind) == (of.power, of.kind)
            && self.line_number() == of.line_number
    }

    /// The squared speed of the move at the highest override, mm²/s². A plan for this speed holds
    /// at every override.
    pub(crate) fn top_v2(&self) -> f32 {
        let highest = f32::from(Overrides::HIGHEST_FEED) * 0.01;
        let top = min(self.rate, self.feed * highest);
        top * top
    }
}

/// The bits of an `f32` below those that are packed, and the least number that is packed.
const DROPPED: u32 = 13;
const LEAST: u32 = (127 - 47) << 23;

/// Two numbers below 2¹⁷ in the bits of one, each rounded up to 11 bits; 2⁻⁴⁷ stands for all smaller
/// ones, but 0 stays 0.
fn pack(numbers: [f32; 2]) -> f32 {
    let [high, low] = numbers.map(|number| {
        let above = number.clamp(0.0, 130_000.0).to_bits().saturating_sub(LEAST);
        let rounded = above.saturating_add((1 << DROPPED) - 1) >> DROPPED;
        rounded.max(u32::from(number > 0.0))
    });
    f32::from_bits(high << 16 | low)
}

/// The numbers that [`pack`] has put in one.
fn unpack(packed: f32) -> [f32; 2] {
    let bits = packed.to_bits();
    [bits >> 16, bits & 0xFFFF].map(|half| match half {
        0 => 0.0,
        _ => f32::from_bits((half << DROPPED) + LEAST),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_planned_move_of_three_motors_fits_76_bytes() {
        assert_eq!(core::mem::size_of::<PlannedMove<3, 3>>(), 76);
    }

    #[test]
    fn packed_numbers_are_rounded_up_by_a_thousandth_at_most() {
        assert_eq!(unpack(pack([0.0, 0.0])), [0.0, 0.0]);
        let mut number = 1e5f32;
        while number > 2e-14 {
            let [same, other] = unpack(pack([number, number * 0.7]));
            for (got, asked) in [(same, number), (other, number * 0.7)] {
                assert!(got >= asked && got <= asked * 1.001, "{got} {asked}");
            }
            number *= 0.83;
        }
    }

    #[test]
    fn a_laser_is_off_where_it_is_held_and_a_spindle_is_not() {
        let full = Power::FULL;
        let laser = MovePower::Constant { power: full };
        assert_eq!((laser.at_rest(), laser.held()), (full, Power::OFF));
        let spindle = MovePower::Spindle { power: full };
        assert_eq!((spindle.at_rest(), spindle.held()), (full, full));
        assert_eq!(MovePower::Dynamic { power: full }.at_rest(), Power::OFF);
    }
}
