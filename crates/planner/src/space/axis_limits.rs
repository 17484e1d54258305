//! The acceleration that the axes allow along a planned move.
//!
//! The look-ahead asks by how much a move can brake. The running move asks how it goes on (see
//! [`Course`]).

use crate::ahead::lookahead::{Braking, Ends, Near, Path};
use crate::config::{Limits, Scales};
use crate::moves::PlannedMove;
use crate::real::{max, min};
use crate::space::polygon::{cap, common, Piece, Rise};
use crate::space::zones::{kept_entry, Zones};
use crate::{Kinematics, Overrides};

/// The share of the possible braking that the look-ahead counts on. The rest is room for the
/// rounding of ramps in `f32` (a few 2⁻²⁴), so that no ramp is steeper than allowed.
const GAIN_MARGIN: f32 = 1.0 - 1.0 / (1 << 20) as f32;

/// The limits of the machine that bound the acceleration along moves.
pub(crate) struct AxisLimits<'m, K, const AXES: usize, const MOTORS: usize> {
    limits: &'m Limits<AXES>,
    scales: &'m Scales<MOTORS>,
    kinematics: &'m K,
    overrides: Overrides,
}

impl<'m, K, const AXES: usize, const MOTORS: usize> AxisLimits<'m, K, AXES, MOTORS> {
    /// Limits with these overrides. `limits` and `scales` are computed from the settings.
    pub(crate) const fn new(
        overrides: Overrides,
        limits: &'m Limits<AXES>,
        scales: &'m Scales<MOTORS>,
        kinematics: &'m K,
    ) -> Self {
        Self {
            limits,
            scales,
            kinematics,
            overrides,
        }
    }
}

impl<K, const AXES: usize, const MOTORS: usize> AxisLimits<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// A part of a move, `length` mm long.
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
        if planned.coarse != 0 {
            self.limits.put_share(planned.coarse, &mut tangent);
        }
        Piece { tangent, length }
    }

    /// Returns by how much the squared speed at a piece's start may exceed `v2`, if the piece ends
    /// at `v2` or slower. `end` and `start` are the curvatures there.
    ///
    /// If the piece ends at `v2`, its start exceeds `v2` by `gain`. A slower end may allow a faster
    /// start. Such an end is looked for only if the start would be below the squared speed
    /// `enough`.
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

    /// Returns by how much the squared speed at the start of a part of a move may exceed `v2`, if
    /// the part ends at `v2` or slower. `bends` are the curvatures at its end and at its start.
    /// `enough`: see [`Self::best`].
    fn gain_over(
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

    /// Returns by how much the squared speed at a move's start may exceed `v2`, if the move ends at
    /// `v2` or slower.
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

    /// Returns by how much the squared speed at a move's start may exceed the one at its end,
    /// mm²/s²; `None` if that depends on the speed.
    fn even_gain(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
        after: Option<&PlannedMove<AXES, MOTORS>>,
    ) -> Option<f32> {
        let straight = planned.is_straight() && after.is_none_or(PlannedMove::is_straight);
        if straight || self.is_eased() {
            Some(2.0 * planned.acceleration * planned.length)
        } else {
            None
        }
    }
}

/// The lengths at the start and at the end of a move over which the path turns, mm. `None` if the
/// path is not straight between them: the whole move turns.
///
/// A turn whose curvature `k` was measured over `h` to both sides is a turn by the angle `k·h`. It
/// takes half of `h` on each side.
///
/// A move that is straight behind the turn at its start stays so when the next move becomes known:
/// it was to brake there.
fn turning_ends<const AXES: usize, const MOTORS: usize>(
    planned: &PlannedMove<AXES, MOTORS>,
    after: Option<&PlannedMove<AXES, MOTORS>>,
) -> Option<[f32; 2]> {
    let [start, end] = [planned.reach, after.map_or(0.0, |after| after.reach)];
    let turns_apart = 2.0 * (start + end) < planned.length;
    let was_straight = start > 0.0 && 2.0 * start < planned.length;
    let [start, end] = [0.5 * start, 0.5 * end];
    (turns_apart || was_straight).then_some([start, min(end, planned.length - start)])
}

/// The share of the acceleration along a move that a ramp keeps if nothing is left, so that
/// divisions stay defined.
const STILL: f32 = 1e-6;

/// The curvature between the ends of a move: the common part of the curvatures at both ends, each
/// spread over the move's length. At a corner or a rest the path has no curvature; then only the
/// other end counts.
fn middle<const AXES: usize, const MOTORS: usize>(
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
        // If the move ends faster than it may begin, braking bounds nothing.
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

    fn is_eased(&self) -> bool {
        self.limits.ease().is_some()
    }

    #[inline(never)]
    fn eased_gain(&self, path: &Path<'_, AXES, MOTORS>, index: usize, v2: u32) -> Option<u32> {
        let exit_v2 = self.limits.unit.v2(v2);
        let kept = kept_entry(path.at(index)?, exit_v2, GAIN_MARGIN);
        let entry_v2 = match kept {
            Some(entry_v2) => entry_v2,
            None => self.zones(path, index)?.entry(0, exit_v2, GAIN_MARGIN),
        };
        Some(self.gained(exit_v2, entry_v2))
    }

    #[inline(never)]
    fn eased_ends(&self, path: &Path<'_, AXES, MOTORS>, index: usize) -> Ends {
        let ends = || {
            let zones = self.zones(path, index)?;
            let (planned, after) = (path.at(index)?, path.at(index + 1)?);
            let unit = self.limits.unit;
            let v2 = min(planned.top_v2(), after.top_v2());
            // Above the limits at the ends of the move, the end would be faster than the start.
            let v2 = min(v2, min(zones.start_v2(), zones.end_v2()));
            let top = unit.units(v2).min(after.corner).min(planned.corner);
            let gains = [0, top].map(|top| {
                let exit_v2 = unit.v2(top);
                self.gained(exit_v2, zones.entry(0, exit_v2, GAIN_MARGIN))
            });
            Some(Ends { top, gains })
        };
        // Such moves are planned only.
        ends().unwrap_or(Ends {
            top: 0,
            gains: [0; 2],
        })
    }

    #[inline(never)]
    fn near(&self, path: &Path<'_, AXES, MOTORS>, index: usize) -> Option<Near> {
        let zones = self.zones_anew(path, index)?;
        Some(self.near_by(path, index, &zones))
    }
}

// Under a jerk limit. None of it is inlined, so that the rest is as quick as without it.
impl<K, const AXES: usize, const MOTORS: usize> AxisLimits<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Returns by how much the squared speed falls from `entry_v2` to `exit_v2` (mm²/s²), units.
    fn gained(&self, exit_v2: f32, entry_v2: f32) -> u32 {
        let gain = max(entry_v2 - exit_v2, 0.0) * GAIN_MARGIN;
        self.limits.unit.units(gain)
    }

    /// The limits along the move at `index` under a jerk limit; `None` without one.
    pub(crate) fn zones(&self, path: &Path<'_, AXES, MOTORS>, index: usize) -> Option<Zones> {
        self.limits.ease()?;
        let kept = path.at(index).and_then(Zones::of);
        kept.or_else(|| self.zones_anew(path, index))
    }

    /// The limits by the moves near the move at `index`, which has `zones`.
    #[inline(never)]
    pub(crate) fn near_by(
        &self,
        path: &Path<'_, AXES, MOTORS>,
        index: usize,
        zones: &Zones,
    ) -> Near {
        let before = index
            .checked_sub(1)
            .and_then(|index| self.zones(path, index));
        let end_v2 = before.map_or(f32::INFINITY, |before| before.end_v2());
        Near {
            start: self.limits.unit.units(min(zones.start_v2(), end_v2)),
            kept: self.limits.ease().and_then(|ease| zones.kept(ease)),
        }
    }

    /// As [`Self::zones`], from the moves near the move.
    #[inline(never)]
    fn zones_anew(&self, path: &Path<'_, AXES, MOTORS>, index: usize) -> Option<Zones> {
        let ease = self.limits.ease()?;
        Zones::new(path, index, ease, self.limits.unit, self.overrides)
    }

    /// The direction of a move over the acceleration of each axis, s²/mm.
    pub(crate) fn tangent(&self, planned: &PlannedMove<AXES, MOTORS>) -> [f32; AXES] {
        self.piece(planned, planned.length).tangent
    }

    /// As [`Self::course`], under a jerk limit: for the move at `index` of `path`.
    #[inline(never)]
    pub(crate) fn eased_course(
        &self,
        path: &Path<'_, AXES, MOTORS>,
        index: usize,
        at: Whereabouts,
        exit_v2: f32,
    ) -> Option<Course> {
        let (planned, zones) = (path.at(index)?, self.zones(path, index)?);
        let events = planned.events();
        let part = zones.after(events - at.steps);
        let steps_after = events - part.to;
        let length = at.steps_to(steps_after) / planned.steps_per_mm();
        let change = |x| part.law.gain(x, length) * GAIN_MARGIN;
        let exit_v2 = min(zones.entry(part.to, exit_v2, GAIN_MARGIN), part.top_v2);
        let exit_v2 = min(exit_v2, at.v2 + change(at.v2));
        let within = |a: f32| max(a, STILL * planned.acceleration);
        let left = part.law.left(at.v2) * GAIN_MARGIN;
        let down = change(exit_v2);
        let per_gain = 0.5 / length;
        Some(Course {
            steps_after,
            exit_v2,
            top_v2: part.top_v2,
            up: within(change(at.v2) * per_gain),
            down: within(if at.v2 > exit_v2 + down {
                left
            } else {
                down * per_gain
            }),
            stop: within(left),
        })
    }
}

/// The course of a part of the running move: squared speeds in mm²/s², accelerations along the path
/// in mm/s².
///
/// A long line beside a curve turns only near its ends, so it is run in parts:
///
/// ```text
///   o=======----------------------------=======o
///    a turn        straight on          a turn
/// ```
///
/// On the straight part the axes leave all of the acceleration. A move that is less than twice as
/// long as its turns reach is a piece of a curve, and is one part.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Course {
    /// Steps of the dominant motor from the part's end to the move's end.
    pub(crate) steps_after: u32,
    /// The highest squared speed at the part's end.
    pub(crate) exit_v2: f32,
    /// The highest squared speed on the way.
    pub(crate) top_v2: f32,
    /// The acceleration while the speed rises, and while it falls.
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
    /// True if the move has not begun.
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
    /// The length, mm.
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
    /// Returns how a move goes on, up to the end of the part in which motion is. `after` is the
    /// move after it. The move may end at the squared speed `exit_v2` (mm²/s²) at most.
    pub(crate) fn course(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
        after: Option<&PlannedMove<AXES, MOTORS>>,
        at: Whereabouts,
        exit_v2: f32,
    ) -> Course {
        let a = planned.acceleration;
        let straight = planned.is_straight() && after.is_none_or(PlannedMove::is_straight);
        if straight || self.is_eased() {
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
            // The piece can brake as hard as the plan needs only if it ends slower.
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
            top_v2: cap(middle),
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
