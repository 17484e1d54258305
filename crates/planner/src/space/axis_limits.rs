//! The acceleration that the axes allow along a planned move, for the look-ahead and for the
//! running move.

use crate::ahead::lookahead::{Braking, Ends};
use crate::config::{Limits, Scales};
use crate::moves::PlannedMove;
use crate::real::{least, most, sqrt};
use crate::space::polygon::{cap, common, Piece, Rise};
use crate::speed::ramp;
use crate::Kinematics;

/// The share of the possible braking that the look-ahead counts on. The rest is room for the
/// rounding of ramps in `f32` (a few 2⁻²⁴), so that no ramp is steeper than allowed.
const GAIN_MARGIN: f32 = 1.0 - 1.0 / (1 << 20) as f32;

/// With a jerk limit a ramp has one acceleration: the one that is left at the highest speed. At
/// that speed a curve may take this share of the acceleration. The share is best for a circle from
/// rest to rest (it takes 8.5·√(R/a); with 0.9 it takes 8.8·√(R/a), with 0.7 8.7·√(R/a)).
const EASED: f32 = 0.8;

/// The limits of the machine that bound the acceleration along moves.
pub(crate) struct AxisLimits<'m, K, const AXES: usize, const MOTORS: usize> {
    pub(crate) limits: &'m Limits<AXES>,
    pub(crate) scales: &'m Scales<MOTORS>,
    pub(crate) kinematics: &'m K,
    /// Limit of the jerk along the path, mm/s³; 0 for none.
    pub(crate) jerk: f32,
}

/// The limits for the rest of the running move: squared speeds in mm²/s², accelerations along the
/// path in mm/s².
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Course {
    pub(crate) exit_v2: f32,
    /// The highest squared speed between the move's ends.
    pub(crate) top_v2: f32,
    pub(crate) up: f32,
    pub(crate) down: f32,
    /// The acceleration of a stop that begins at once.
    pub(crate) stop: f32,
}

/// The state of the running move: its squared speed in mm²/s², its remaining length in mm, and
/// whether it has not begun yet.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Whereabouts {
    pub(crate) v2: f32,
    pub(crate) left: f32,
    pub(crate) at_start: bool,
}

impl<K, const AXES: usize, const MOTORS: usize> AxisLimits<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// The highest squared speed at which a path may turn with the curvature `bend`, mm²/s².
    pub(crate) fn cap(&self, bend: &[f32]) -> f32 {
        if self.jerk > 0.0 {
            EASED * cap(bend)
        } else {
            cap(bend)
        }
    }

    fn piece(&self, planned: &PlannedMove<AXES, MOTORS>, length: f32) -> Piece<AXES> {
        let mut motors_mm = [0.0; MOTORS];
        let scales = planned.delta.into_iter().zip(self.scales.mm_per_step);
        for (mm, (steps, mm_per_step)) in motors_mm.iter_mut().zip(scales) {
            *mm = steps as f32 * mm_per_step;
        }
        let mut tangent = self.kinematics.axes_mm(&motors_mm);
        let per_length = 1.0 / planned.length;
        for (tangent, per_acceleration) in tangent.iter_mut().zip(&self.limits.per_acceleration) {
            *tangent *= per_length * per_acceleration;
        }
        Piece { tangent, length }
    }

    /// The limits for the rest of the running move. `after` is the move after it; the end may be
    /// passed at the squared speed `exit_v2` at most.
    pub(crate) fn course(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
        after: Option<&PlannedMove<AXES, MOTORS>>,
        at: Whereabouts,
        exit_v2: f32,
    ) -> Course {
        let to = after.map_or([0.0; AXES], |after| after.bend);
        if self.jerk > 0.0 {
            return self.eased_course(planned, after, exit_v2);
        }
        if planned.is_straight() && after.is_none_or(PlannedMove::is_straight) {
            let a = planned.acceleration;
            return Course {
                exit_v2,
                top_v2: f32::INFINITY,
                up: a,
                down: a,
                stop: a,
            };
        }
        let middle = middle(planned, after);
        let from = if at.at_start { planned.bend } else { middle };
        let piece = self.piece(planned, at.left);
        let gain = |x, from: &[f32; AXES], to: &[f32; AXES], rise| {
            let [gain] = piece.gains([x], from, to, rise);
            gain * GAIN_MARGIN
        };
        let reached = at.v2 + gain(at.v2, &from, &to, Rise::Forward);
        let mut exit_v2 = least(exit_v2, reached);
        let mut needed = gain(exit_v2, &to, &from, Rise::Backward);
        if at.v2 > exit_v2 + needed {
            // The piece can brake as hard as the plan needs only where it ends slower.
            exit_v2 = least(exit_v2, piece.peak(&to, &from, Rise::Backward).at);
            needed = gain(exit_v2, &to, &from, Rise::Backward);
        }
        let up = most(gain(at.v2, &from, &middle, Rise::Forward), exit_v2 - at.v2);
        let down = most(
            gain(exit_v2, &to, &middle, Rise::Backward),
            least(at.v2 - exit_v2, needed),
        );
        let per_gain = 0.5 / at.left;
        let within = |a: f32| {
            let most_of_all = planned.acceleration;
            most(least(a, most_of_all), STILL * most_of_all)
        };
        Course {
            exit_v2,
            top_v2: self.cap(&middle),
            up: within(up * per_gain),
            down: within(down * per_gain),
            stop: within(piece.left(at.v2, &from, Rise::Backward)),
        }
    }

    /// The limits under a jerk limit: one acceleration for speeding up, braking and stopping.
    fn eased_course(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
        after: Option<&PlannedMove<AXES, MOTORS>>,
        exit_v2: f32,
    ) -> Course {
        let a = self.eased(planned, after);
        Course {
            exit_v2,
            top_v2: self.cap(&middle(planned, after)),
            up: a,
            down: a,
            stop: a,
        }
    }

    /// The acceleration that is left at the highest speeds of both ends, mm/s².
    fn eased(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
        after: Option<&PlannedMove<AXES, MOTORS>>,
    ) -> f32 {
        let piece = self.piece(planned, planned.length);
        let left = |of: &PlannedMove<AXES, MOTORS>| {
            let v2 = self.limits.unit.v2(of.corner);
            let both = [Rise::Forward, Rise::Backward];
            both.iter().fold(planned.acceleration, |least_left, rise| {
                least(least_left, piece.left(v2, &of.bend, *rise))
            })
        };
        let ends = least(left(planned), after.map_or(f32::INFINITY, left));
        most(ends, STILL * planned.acceleration)
    }

    /// By how much a piece may begin faster than the squared speed `v2`, at which it ends at most.
    /// That is `gain`, unless the piece may begin still faster if it ends slower. No more is looked
    /// for than a start with `enough` units. The curvatures are those at its end and at its start.
    #[inline(never)] // twice it takes 0.1 KB more of a firmware that is nearly full
    fn best(
        &self,
        piece: &Piece<AXES>,
        [end, start]: [&[f32; AXES]; 2],
        [v2, gain]: [f32; 2],
        enough: u32,
    ) -> f32 {
        if self.limits.unit.units(v2 + gain) >= enough {
            return gain;
        }
        let peak = piece.peak(end, start, Rise::Backward);
        match v2 > peak.at {
            true => most(gain, peak.reached - v2),
            false => gain,
        }
    }

    fn eased_gain(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
        after: Option<&PlannedMove<AXES, MOTORS>>,
    ) -> f32 {
        let acceleration = self.eased(planned, after);
        let limits = ramp::Limits {
            acceleration,
            jerk: self.jerk,
        };
        let fastest = most(sqrt(planned.top_v2()), crate::config::SLOWEST);
        least(
            2.0 * acceleration * planned.length,
            ramp::braking(fastest, planned.length, limits),
        )
    }
}

/// The least acceleration of a ramp, as a share of the acceleration along the move, so that no
/// division is by 0.
const STILL: f32 = 1e-6;

/// The curvature between the ends of a move: the common part of the curvatures at both ends, each
/// spread over the move's length. At a corner or a rest the path has no curvature; then only the
/// other end counts.
fn middle<const AXES: usize, const MOTORS: usize>(
    planned: &PlannedMove<AXES, MOTORS>,
    after: Option<&PlannedMove<AXES, MOTORS>>,
) -> [f32; AXES] {
    let spread = |of: &PlannedMove<AXES, MOTORS>| {
        let share = least(of.reach / planned.length, 1.0);
        of.bend.map(|bend| bend * share)
    };
    match after.filter(|after| !after.has_corner()) {
        Some(after) if planned.has_corner() => spread(after),
        Some(after) => common(&spread(planned), &spread(after)),
        None => spread(planned),
    }
}

impl<K, const AXES: usize, const MOTORS: usize> Braking<AXES, MOTORS>
    for AxisLimits<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    fn gain(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
        after: Option<&PlannedMove<AXES, MOTORS>>,
        v2: u32,
    ) -> u32 {
        let unit = self.limits.unit;
        let straight = planned.is_straight() && after.is_none_or(PlannedMove::is_straight);
        let gain = if self.jerk > 0.0 {
            self.eased_gain(planned, after)
        } else if straight {
            2.0 * planned.acceleration * planned.length
        } else {
            let none = [0.0; AXES];
            let to = after.map_or(&none, |after| &after.bend);
            let piece = self.piece(planned, planned.length);
            let v2 = unit.v2(v2);
            let [gain] = piece.gains([v2], to, &planned.bend, Rise::Backward);
            self.best(&piece, [to, &planned.bend], [v2, gain], planned.cap)
        };
        unit.units(gain * GAIN_MARGIN)
    }

    fn ends(&self, planned: &PlannedMove<AXES, MOTORS>, after: &PlannedMove<AXES, MOTORS>) -> Ends {
        let unit = self.limits.unit;
        if self.jerk > 0.0 || planned.is_straight() && after.is_straight() {
            let gain = self.gain(planned, Some(after), 0);
            return Ends {
                top: 0,
                gains: [gain; 2],
            };
        }
        let v2 = least(planned.top_v2(), after.top_v2());
        // Where a move ends faster than it may begin, braking bounds nothing.
        let top = unit.units(v2).min(after.corner).min(planned.corner);
        let piece = self.piece(planned, planned.length);
        let speeds = [0.0, unit.v2(top)];
        let bends = [&after.bend, &planned.bend];
        let [at_rest, at_top] = piece.gains(speeds, bends[0], bends[1], Rise::Backward);
        let at_top = self.best(&piece, bends, [speeds[1], at_top], planned.corner);
        Ends {
            top,
            gains: [at_rest, at_top].map(|gain| unit.units(gain * GAIN_MARGIN)),
        }
    }
}
