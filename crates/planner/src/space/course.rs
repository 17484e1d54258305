//! How the running move goes on.
//!
//! A long line beside a curve turns only near its ends, so it is run in parts:
//!
//! ```text
//!   o=======----------------------------=======o
//!    a turn        straight on          a turn
//! ```
//!
//! On the straight part the axes leave all of the acceleration. A move that is less than twice as
//! long as its turns reach is a piece of a curve, and is one part.

use super::axis_limits::{middle, turning_ends, AxisLimits, GAIN_MARGIN, STILL};
use super::polygon::Rise;
use crate::moves::PlannedMove;
use crate::real::{max, min};
use crate::Kinematics;

/// How a part of the running move goes on: squared speeds in mm²/s², accelerations along the path
/// in mm/s².
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Course {
    /// Steps of the dominant motor from the part's end to the move's end.
    pub(crate) steps_after: u32,
    /// The highest squared speed at the part's end.
    pub(crate) exit_v2: f32,
    /// The highest squared speed on the way.
    pub(crate) top_v2: f32,
    /// The acceleration where the speed rises, and where it falls.
    pub(crate) up: f32,
    pub(crate) down: f32,
    /// The acceleration of a stop that begins at once.
    pub(crate) stop: f32,
}

/// The place of motion in a move, and its speed there.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Whereabouts {
    /// Squared speed, mm²/s².
    pub(crate) v2: f32,
    /// Steps of the dominant motor to the move's end, the one under way included.
    pub(crate) steps: u32,
    /// The share of the step under way that is done: 0 to below 1.
    pub(crate) way: f32,
    /// Whether the move has not begun.
    pub(crate) at_start: bool,
}

impl Whereabouts {
    /// The start of a move.
    pub(crate) fn start<const AXES: usize, const MOTORS: usize>(
        planned: &PlannedMove<AXES, MOTORS>,
        v2: f32,
    ) -> Self {
        Self {
            v2,
            steps: planned.events(),
            way: 0.0,
            at_start: true,
        }
    }

    /// Steps from here to the place that has `steps_after` steps after it.
    pub(crate) fn steps_to(&self, steps_after: u32) -> f32 {
        (self.steps - steps_after) as f32 - self.way
    }
}

/// The rest of a part of a move, from the place of motion on. The path turns in it.
struct Part<const AXES: usize> {
    steps_after: u32,
    /// mm.
    length: f32,
    /// The curvature at its start, on the way and at its end, over the acceleration of each axis.
    bends: [[f32; AXES]; 3],
    /// The highest squared speed at its end, mm²/s².
    exit_v2: f32,
}

impl<K, const AXES: usize, const MOTORS: usize> AxisLimits<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// How a move goes on, up to the end of the part where motion is. `after` is the move after it;
    /// the end may be passed at the squared speed `exit_v2` (mm²/s²) at most.
    pub(crate) fn course(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
        after: Option<&PlannedMove<AXES, MOTORS>>,
        at: Whereabouts,
        exit_v2: f32,
    ) -> Course {
        if self.jerk > 0.0 {
            let a = self.eased(planned, after);
            let top_v2 = self.cap(&middle(planned, after));
            return Course::even(a, top_v2, 0, exit_v2);
        }
        let a = planned.acceleration;
        if planned.is_straight() && after.is_none_or(PlannedMove::is_straight) {
            return Course::even(a, f32::INFINITY, 0, exit_v2);
        }
        let (none, per_mm) = ([0.0; AXES], planned.steps_per_mm());
        let to = after.map_or(none, |after| after.bend);
        let Some(turning) = turning_ends(planned, after) else {
            let middle = middle(planned, after);
            let from = if at.at_start { planned.bend } else { middle };
            let whole = Part {
                steps_after: 0,
                length: at.steps_to(0) / per_mm,
                bends: [from, middle, to],
                exit_v2,
            };
            return self.course_of(planned, &whole, at.v2);
        };
        let [start, end] = turning.map(|length| (length * per_mm) as u32);
        let mut part = Part {
            steps_after: 0,
            length: at.steps_to(0) / per_mm,
            bends: [none, none, to],
            exit_v2,
        };
        if at.steps > end {
            let mm = |steps: u32| steps as f32 / per_mm;
            if end > 0 {
                let speeds = [exit_v2, f32::INFINITY];
                let gain = self.gain_over(planned, mm(end), [&to, &none], speeds);
                part.exit_v2 += gain * GAIN_MARGIN;
            }
            let straight = planned.events() - start;
            if at.steps <= straight {
                return Course::even(a, f32::INFINITY, end, part.exit_v2);
            }
            part = Part {
                steps_after: straight,
                length: at.steps_to(straight) / per_mm,
                bends: [if at.at_start { planned.bend } else { none }, none, none],
                exit_v2: part.exit_v2 + 2.0 * a * mm(straight - end) * GAIN_MARGIN,
            };
        }
        self.course_of(planned, &part, at.v2)
    }

    /// The course of a part that turns, from the squared speed `v2`.
    fn course_of(&self, planned: &PlannedMove<AXES, MOTORS>, part: &Part<AXES>, v2: f32) -> Course {
        let piece = self.piece(planned, part.length);
        let [from, middle, to] = &part.bends;
        let gain = |x, from: &[f32; AXES], to: &[f32; AXES], rise| {
            let [gain] = piece.gains([x], from, to, rise);
            gain * GAIN_MARGIN
        };
        let reached = v2 + gain(v2, from, to, Rise::Forward);
        let mut exit_v2 = min(part.exit_v2, reached);
        let mut needed = gain(exit_v2, to, from, Rise::Backward);
        if v2 > exit_v2 + needed {
            // The piece can brake as hard as the plan needs only where it ends slower.
            exit_v2 = min(exit_v2, piece.fastest_end(v2, to, Rise::Backward));
            needed = gain(exit_v2, to, from, Rise::Backward);
        }
        let up = max(gain(v2, from, middle, Rise::Forward), exit_v2 - v2);
        let down = max(
            gain(exit_v2, to, middle, Rise::Backward),
            min(v2 - exit_v2, needed),
        );
        let per_gain = 0.5 / piece.length;
        let within = |a: f32| {
            let most_of_all = planned.acceleration;
            max(min(a, most_of_all), STILL * most_of_all)
        };
        Course {
            steps_after: part.steps_after,
            exit_v2,
            top_v2: self.cap(middle),
            up: within(up * per_gain),
            down: within(down * per_gain),
            stop: within(piece.left(v2, from, Rise::Backward)),
        }
    }
}

impl Course {
    /// A course with the same acceleration everywhere.
    fn even(acceleration: f32, top_v2: f32, steps_after: u32, exit_v2: f32) -> Self {
        Self {
            steps_after,
            exit_v2,
            top_v2,
            up: acceleration,
            down: acceleration,
            stop: acceleration,
        }
    }
}
