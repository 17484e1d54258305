//! The acceleration that the axes allow along a planned move, for the look-ahead and for the
//! running move.

use crate::ahead::lookahead::{Braking, Ends};
use crate::config::{Limits, Scales};
use crate::moves::PlannedMove;
use crate::real::{max, min, sqrt};
use crate::space::polygon::{cap, common, Piece, Rise};
use crate::speed::ramp;
use crate::{Config, Kinematics};

/// The share of the possible braking that the look-ahead counts on. The rest is room for the
/// rounding of ramps in `f32` (a few 2⁻²⁴), so that no ramp is steeper than allowed.
pub(super) const GAIN_MARGIN: f32 = 1.0 - 1.0 / (1 << 20) as f32;

/// With a jerk limit a ramp has one acceleration: the one that is left at the highest speed. At
/// that speed a curve may take this share of the acceleration. The share is best for a circle from
/// rest to rest (it takes 8.5·√(R/a); with 0.9 it takes 8.8·√(R/a), with 0.7 8.7·√(R/a)).
const EASED: f32 = 0.8;

/// The limits of the machine that bound the acceleration along moves.
pub(crate) struct AxisLimits<'m, K, const AXES: usize, const MOTORS: usize> {
    limits: &'m Limits<AXES>,
    scales: &'m Scales<MOTORS>,
    kinematics: &'m K,
    /// Limit of the jerk along the path, mm/s³; 0 for none.
    pub(crate) jerk: f32,
}

impl<'m, K, const AXES: usize, const MOTORS: usize> AxisLimits<'m, K, AXES, MOTORS> {
    /// The limits of `config`. `limits` and `scales` are computed from it.
    pub(crate) const fn new(
        config: &Config<AXES>,
        limits: &'m Limits<AXES>,
        scales: &'m Scales<MOTORS>,
        kinematics: &'m K,
    ) -> Self {
        Self {
            limits,
            scales,
            kinematics,
            jerk: config.jerk,
        }
    }
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

    /// A part of a move, `length` mm long.
    pub(super) fn piece(&self, planned: &PlannedMove<AXES, MOTORS>, length: f32) -> Piece<AXES> {
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

    /// The acceleration that is left at the highest speeds of both ends, mm/s².
    pub(super) fn eased(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
        after: Option<&PlannedMove<AXES, MOTORS>>,
    ) -> f32 {
        let piece = self.piece(planned, planned.length);
        let left = |of: &PlannedMove<AXES, MOTORS>| {
            let v2 = self.limits.unit.v2(of.corner);
            let both = [Rise::Forward, Rise::Backward];
            both.iter().fold(planned.acceleration, |least_left, rise| {
                min(least_left, piece.left(v2, &of.bend, *rise))
            })
        };
        let ends = min(left(planned), after.map_or(f32::INFINITY, left));
        max(ends, STILL * planned.acceleration)
    }

    /// By how much a piece may begin faster than the squared speed `v2`, at which it ends at most.
    /// The curvatures are those at its end and at its start. That is `gain`, unless the piece may
    /// begin still faster where it ends slower. A start at the squared speed `enough` is enough.
    #[inline(never)] // twice it takes 0.1 KB more of a firmware that is nearly full
    fn best(
        &self,
        piece: &Piece<AXES>,
        [end, start]: [&[f32; AXES]; 2],
        [v2, gain]: [f32; 2],
        enough: f32,
    ) -> f32 {
        if v2 + gain >= enough {
            return gain;
        }
        let peak = piece.peak(end, start, Rise::Backward);
        match v2 > peak.at {
            true => max(gain, peak.reached - v2),
            false => gain,
        }
    }

    /// By how much a part of a move may begin faster than the squared speed `v2`, at which it ends
    /// at most. The curvatures are those at its end and at its start. A start at the squared speed
    /// `enough` is enough.
    #[inline(never)] // in four places it would take 0.5 KB more of a firmware
    pub(super) fn gain_over(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
        length: f32,
        bends: [&[f32; AXES]; 2],
        [v2, enough]: [f32; 2],
    ) -> f32 {
        let piece = self.piece(planned, length);
        let [gain] = piece.gains([v2], bends[0], bends[1], Rise::Backward);
        self.best(&piece, bends, [v2, gain], enough)
    }

    /// By how much a move may begin faster than the squared speed `v2`, at which it ends at most.
    fn whole_gain(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
        after: Option<&PlannedMove<AXES, MOTORS>>,
        v2: f32,
    ) -> f32 {
        let enough = self.limits.unit.v2(planned.cap);
        let none = [0.0; AXES];
        let (from, to) = (&planned.bend, after.map_or(&none, |after| &after.bend));
        let Some([start, end]) = turning_ends(planned, after) else {
            return self.gain_over(planned, planned.length, [to, from], [v2, enough]);
        };
        let mut gain = 0.0;
        if end > 0.0 {
            gain = self.gain_over(planned, end, [to, &none], [v2, enough]);
        }
        gain += 2.0 * planned.acceleration * (planned.length - start - end);
        if start > 0.0 {
            gain += self.gain_over(planned, start, [&none, from], [v2 + gain, enough]);
        }
        gain
    }

    /// By how much a move may begin faster than it ends, where that is the same at every speed.
    fn even_gain(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
        after: Option<&PlannedMove<AXES, MOTORS>>,
    ) -> Option<f32> {
        if self.jerk > 0.0 {
            Some(self.eased_gain(planned, after))
        } else if planned.is_straight() && after.is_none_or(PlannedMove::is_straight) {
            Some(2.0 * planned.acceleration * planned.length)
        } else {
            None
        }
    }

    /// By how much the squared speed can fall over a move with a jerk limit, mm²/s².
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
        let fastest = max(sqrt(planned.top_v2()), crate::config::SLOWEST);
        min(
            2.0 * acceleration * planned.length,
            ramp::braking(fastest, planned.length, limits),
        )
    }
}

/// The lengths at the start and at the end of a move over which the path turns, mm, where it goes
/// straight on between them. A turn with the curvature `k` that reaches `h` to both sides is one by
/// the angle `k·h`. That takes half of `h` on each side.
pub(super) fn turning_ends<const AXES: usize, const MOTORS: usize>(
    planned: &PlannedMove<AXES, MOTORS>,
    after: Option<&PlannedMove<AXES, MOTORS>>,
) -> Option<[f32; 2]> {
    let [start, end] = [planned.reach, after.map_or(0.0, |after| after.reach)];
    (2.0 * (start + end) < planned.length).then_some([0.5 * start, 0.5 * end])
}

/// The share of the acceleration along a move that a ramp keeps where nothing is left, so that
/// divisions stay defined.
pub(super) const STILL: f32 = 1e-6;

/// The curvature between the ends of a move: the common part of the curvatures at both ends, each
/// spread over the move's length. At a corner or a rest the path has no curvature; then only the
/// other end counts.
pub(super) fn middle<const AXES: usize, const MOTORS: usize>(
    planned: &PlannedMove<AXES, MOTORS>,
    after: Option<&PlannedMove<AXES, MOTORS>>,
) -> [f32; AXES] {
    let spread = |of: &PlannedMove<AXES, MOTORS>| {
        let share = min(of.reach / planned.length, 1.0);
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
        let gain = match self.even_gain(planned, after) {
            Some(gain) => gain,
            None => self.whole_gain(planned, after, unit.v2(v2)),
        };
        unit.units(gain * GAIN_MARGIN)
    }

    fn ends(&self, planned: &PlannedMove<AXES, MOTORS>, after: &PlannedMove<AXES, MOTORS>) -> Ends {
        let unit = self.limits.unit;
        if let Some(gain) = self.even_gain(planned, Some(after)) {
            return Ends {
                top: 0,
                gains: [unit.units(gain * GAIN_MARGIN); 2],
            };
        }
        let v2 = min(planned.top_v2(), after.top_v2());
        // Where it ends faster than it may begin, braking bounds nothing.
        let top = unit.units(v2).min(after.corner).min(planned.corner);
        if turning_ends(planned, Some(after)).is_some() {
            let gains = [0, top].map(|v2| self.gain(planned, Some(after), v2));
            return Ends { top, gains };
        }
        let piece = self.piece(planned, planned.length);
        let speeds = [0.0, unit.v2(top)];
        let bends = [&after.bend, &planned.bend];
        let [at_rest, at_top] = piece.gains(speeds, bends[0], bends[1], Rise::Backward);
        let at_top = self.best(&piece, bends, [speeds[1], at_top], unit.v2(planned.corner));
        Ends {
            top,
            gains: [at_rest, at_top].map(|gain| unit.units(gain * GAIN_MARGIN)),
        }
    }
}
