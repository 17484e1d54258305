//! The limits near a place under a jerk limit: those of all places that the mean touches.
//!
//! The tool is at the mean of the plan's places of the last time `T`. If the plan is no faster than
//! `v` within `v·T/2` of a place, to both sides, then the plan is within that way for all of the last
//! `T` while the tool is at the place. So the tool keeps the speed `v` there, and every other limit
//! that the plan keeps on that way.
//!
//! ```text
//!     ______                         ______
//!           \                       /            a corner, and a slow move
//!            \_____________________/
//!            <- v·T/2 ->o<- v·T/2 ->
//! ```
//!
//! Behind a slow place that lies between, a place has no effect: while the tool is there, the plan
//! has passed the slow one. So the way of each further place is at most the way of the one before it.

use crate::ahead::lookahead::Path;
use crate::config::{Limits, SpeedUnit};
use crate::ease::Ease;
use crate::moves::PlannedMove;
use crate::planner::nominal;
use crate::real::{max, min, sqrt};
use crate::Overrides;

/// The acceleration `u` along the path that is left at the squared speed `x`:
///
/// ```text
///   |u| ≤ a        (q·u)² + (b·x)² ≤ 1
/// ```
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Law {
    /// The bound of `u`, mm/s².
    pub(crate) a: f32,
    /// The weight of `u`, s²/mm.
    pub(crate) q: f32,
    /// The weight of `x`, s²/mm²; 0 if the path is straight.
    pub(crate) b: f32,
}

impl Law {
    /// The law of a straight path.
    const fn straight(a: f32) -> Self {
        Self { a, q: 0.0, b: 0.0 }
    }

    /// Returns a law that keeps both.
    fn and(self, other: Self) -> Self {
        Self {
            a: min(self.a, other.a),
            q: max(self.q, other.q),
            b: max(self.b, other.b),
        }
    }

    /// The acceleration that is left at the squared speed `x`.
    pub(crate) fn left(self, x: f32) -> f32 {
        if self.b == 0.0 {
            return self.a;
        }
        let across = self.b * x;
        min(self.a, sqrt(1.0 - across * across) / self.q)
    }

    /// Returns by how much the squared speed can change from `x` upwards over `length` mm. The
    /// acceleration is constant, and the faster end decides:
    ///
    /// ```text
    ///   (q·g/2L)² + (b·(x + g))² = 1
    /// ```
    pub(crate) fn gain(self, x: f32, length: f32) -> f32 {
        let straight = 2.0 * self.a * length;
        if self.b == 0.0 {
            return straight;
        }
        let along = 0.5 * self.q / length;
        let (along, across) = (along * along, self.b * self.b);
        let both = along + across;
        let gain = (sqrt(both - along * across * x * x) - across * x) / both;
        max(min(straight, gain), 0.0)
    }
}

/// The share of the squared speed of a curve that is used, so that something is left for braking.
const ROOM: f32 = 0.97;

/// The curvature at the border of two moves, as numbers of the law: `q` and `b`. `bend` is the
/// curvature over the acceleration of each axis, `tangents` are the directions of both moves, over
/// the same.
///
/// Of two vectors `q·u` and `b·x` at an angle with the cosine `c`, the squared length of the sum is
/// at most `1 + |c|` times the sum of the squared lengths.
pub(crate) fn curved<const AXES: usize>(
    bend: &[f32; AXES],
    tangents: [[f32; AXES]; 2],
) -> [f32; 2] {
    let dot =
        |a: &[f32; AXES], b: &[f32; AXES]| a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b);
    let b = sqrt(dot(bend, bend));
    let (mut q, mut cosine) = (0.0, 0.0);
    for tangent in &tangents {
        let length = sqrt(dot(tangent, tangent));
        q = max(q, length);
        if b > 0.0 {
            cosine = max(cosine, dot(tangent, bend).abs() / (length * b));
        }
    }
    let more = sqrt(1.0 + min(cosine, 1.0));
    [q * more, b * more]
}

/// The highest squared speed of a curve, mm²/s², by its number `b` of the law.
pub(crate) fn fastest(b: f32) -> f32 {
    ROOM / b
}

/// Limits that hold for some steps from one end of a move.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Zone {
    steps: u32,
    top_v2: f32,
    law: Law,
}

/// The limits in a move, the same up to some step.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Part {
    /// Steps from the move's start to the part's ends.
    pub(crate) from: u32,
    pub(crate) to: u32,
    /// The highest squared speed by the places near the part, mm²/s². The move's own feed bounds the
    /// speed besides.
    pub(crate) top_v2: f32,
    pub(crate) law: Law,
}

/// The limits along a move: those all along it, and at each end one zone for the slowest place near
/// it, and one for all others.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Zones {
    events: u32,
    per_mm: f32,
    /// The move's own acceleration, mm/s².
    own: f32,
    /// The bound that holds all along the move.
    top_v2: f32,
    law: Law,
    /// At the start and at the end.
    ends: [[Zone; 2]; 2],
    /// `None` if the path after the move is known as far as it has an effect; otherwise the length
    /// of what is known, mm.
    pub(crate) unknown: Option<f32>,
}

/// A move is short if the way that the plan goes in half of the time is as many times as long.
const SHORT: f32 = 8.0;

/// The ends of a move, as indices.
const START: usize = 0;
const END: usize = 1;

/// The values that the search for slow places depends on besides the moves.
struct Near<'a> {
    ease: &'a Ease,
    unit: SpeedUnit,
    overrides: Overrides,
    /// The speed asked for in the move itself, mm/s.
    speed: f32,
    /// The length of the move if all of it turns, mm; otherwise 0.
    all: f32,
}

impl Zones {
    /// The limits along the move at `index`.
    pub(crate) fn new<const AXES: usize, const MOTORS: usize>(
        path: &Path<'_, AXES, MOTORS>,
        index: usize,
        ease: &Ease,
        unit: SpeedUnit,
        overrides: Overrides,
    ) -> Option<Self> {
        let of = path.at(index)?;
        let speed = nominal(overrides, of);
        let mut zones = Self::straight(of);
        let reach = of.reach + path.at(index + 1).map_or(0.0, |after| after.reach);
        let all = if 2.0 * reach >= of.length {
            of.length
        } else {
            0.0
        };
        let near = Near {
            ease,
            unit,
            overrides,
            speed,
            all,
        };
        zones.look(START, path, index, &near);
        zones.look(END, path, index, &near);
        Some(zones)
    }

    /// The limits along a move as [`Zones::kept`] has found them.
    pub(crate) fn of<const AXES: usize, const MOTORS: usize>(
        planned: &PlannedMove<AXES, MOTORS>,
    ) -> Option<Self> {
        let ([b, q], top_v2) = planned.near()?;
        let zones = Self::straight(planned);
        Some(Self {
            top_v2,
            law: Law { b, q, ..zones.law },
            ..zones
        })
    }

    /// No limits but those of a straight path.
    fn straight<const AXES: usize, const MOTORS: usize>(
        planned: &PlannedMove<AXES, MOTORS>,
    ) -> Self {
        let law = Law::straight(planned.acceleration);
        let none = Zone {
            steps: 0,
            top_v2: f32::INFINITY,
            law,
        };
        Self {
            events: planned.events(),
            per_mm: planned.steps_per_mm(),
            own: planned.acceleration,
            top_v2: f32::INFINITY,
            law,
            ends: [[none; 2]; 2],
            unknown: None,
        }
    }

    /// The law and the highest squared speed (mm²/s²), if they can be kept all along the move, and
    /// the law is the same with the move's own acceleration.
    ///
    /// They are the same all along, or the move is so short beside the ways of its zones that it
    /// takes no longer with the least of them.
    pub(crate) fn kept(&self, ease: &Ease) -> Option<([f32; 2], f32)> {
        let Part {
            top_v2, law, to, ..
        } = self.after(0);
        let whole = self.part(0, self.events);
        let length = self.events as f32 / self.per_mm;
        let is_short = || SHORT * length < ease.half(sqrt(whole.top_v2));
        let (law, top_v2) = match to == self.events {
            true => (law, top_v2),
            false if is_short() => (whole.law, whole.top_v2),
            false => return None,
        };
        let own = law.a >= self.own || law.q * law.a >= 1.0;
        own.then_some(([law.b, law.q], top_v2))
    }

    /// Adds a slow place at the end of the move: the plan goes no faster than `v` (mm/s) there.
    pub(crate) fn end_at(&mut self, v: f32, ease: &Ease) {
        self.add(END, ease.half(v), v * v, Law::straight(self.own));
    }

    /// Looks for slow places from one end of the move at `index` outwards.
    fn look<const AXES: usize, const MOTORS: usize>(
        &mut self,
        end: usize,
        path: &Path<'_, AXES, MOTORS>,
        index: usize,
        near: &Near<'_>,
    ) {
        let (ease, own) = (near.ease, self.own);
        let mut walk = Walk {
            way: ease.half(near.speed),
            slowest: near.speed,
            passed: 0.0,
        };
        let mut at = index;
        // The move that begins at the border.
        let mut border = path.at(if end == START { at } else { at + 1 });
        loop {
            let Some(next) = border else {
                if !path.ends() {
                    self.unknown = Some(walk.passed);
                }
                return;
            };
            if next.corner < u32::MAX || next.reach > 0.0 {
                let [b, q] = next.law();
                let v2 = near.unit.v2(next.corner);
                let least = if at == index { near.all } else { 0.0 };
                let turn = match next.is_straight() {
                    true => 0.0,
                    false => max(0.5 * next.reach, least),
                };
                let way = walk.to(sqrt(v2), turn, ease);
                self.add(end, way, v2, Law { a: own, q, b });
            }
            // The move behind the border.
            let beyond = match end {
                START => at.checked_sub(1).and_then(|at| path.at(at)),
                _ => border,
            };
            let Some(beyond) = beyond.filter(|_| walk.way > 0.0) else {
                return;
            };
            let v = nominal(near.overrides, beyond);
            let way = walk.to(v, 0.0, ease);
            if v < near.speed || beyond.acceleration < own {
                self.add(end, way, v * v, Law::straight(beyond.acceleration));
            }
            walk.passed += beyond.length;
            if walk.is_over(ease) {
                return;
            }
            (at, border) = match end {
                START => (at - 1, Some(beyond)),
                _ => (at + 1, path.at(at + 2)),
            };
        }
    }

    /// Adds limits that hold for `way` mm from an end.
    fn add(&mut self, end: usize, way: f32, top_v2: f32, law: Law) {
        if way <= 0.0 {
            return;
        }
        let steps = ((way * self.per_mm) as u32).saturating_add(1);
        if steps >= self.events {
            self.top_v2 = min(self.top_v2, top_v2);
            self.law = self.law.and(law);
            return;
        }
        let mut zone = Zone { steps, top_v2, law };
        let Some([slowest, others]) = self.ends.get_mut(end) else {
            return;
        };
        if zone.top_v2 < slowest.top_v2 {
            core::mem::swap(slowest, &mut zone);
        }
        if zone.steps > 0 {
            others.steps = others.steps.max(zone.steps);
            others.top_v2 = min(others.top_v2, zone.top_v2);
            others.law = others.law.and(zone.law);
        }
    }

    /// The part that begins at the step `from`.
    pub(crate) fn after(&self, from: u32) -> Part {
        let [start, end] = &self.ends;
        let mut to = self.events;
        for zone in start.iter().filter(|zone| zone.steps > from) {
            to = to.min(zone.steps);
        }
        for zone in end {
            let begins = self.events - zone.steps;
            if begins > from {
                to = to.min(begins);
            }
        }
        self.part(from, to)
    }

    /// The part that ends at the step `to`.
    fn before(&self, to: u32) -> Part {
        let [start, end] = &self.ends;
        let mut from = 0;
        for zone in start.iter().filter(|zone| zone.steps < to) {
            from = from.max(zone.steps);
        }
        for zone in end {
            let begins = self.events - zone.steps;
            if begins < to {
                from = from.max(begins);
            }
        }
        self.part(from, to)
    }

    fn part(&self, from: u32, to: u32) -> Part {
        let [start, end] = &self.ends;
        let (mut top_v2, mut law) = (self.top_v2, self.law);
        let starts = start.iter().filter(|zone| zone.steps > from);
        let ends = end.iter().filter(|zone| self.events - zone.steps < to);
        for zone in starts.chain(ends) {
            top_v2 = min(top_v2, zone.top_v2);
            law = law.and(zone.law);
        }
        Part {
            from,
            to,
            top_v2,
            law,
        }
    }

    /// The highest squared speed at the step `from` with which the move can end at `exit_v2` or
    /// slower.
    pub(crate) fn entry(&self, from: u32, exit_v2: f32, share: f32) -> f32 {
        let (mut to, mut v2) = (self.events, exit_v2);
        while to > from {
            let mut part = self.before(to);
            part.from = part.from.max(from);
            let length = (to - part.from) as f32 / self.per_mm;
            v2 = entry(part.law, part.top_v2, length, v2, share);
            to = part.from;
        }
        v2
    }

    /// The highest squared speed at the move's start, whatever follows.
    pub(crate) fn start_v2(&self) -> f32 {
        self.after(0).top_v2
    }
}

impl Zones {
    /// The highest squared speed at the move's end, whatever follows.
    pub(crate) fn end_v2(&self) -> f32 {
        self.before(self.events).top_v2
    }
}

/// The highest squared speed at the start of `length` mm with one law, with which they can end at
/// `exit_v2` or slower.
fn entry(law: Law, top_v2: f32, length: f32, exit_v2: f32, share: f32) -> f32 {
    let v2 = min(exit_v2, top_v2);
    min(v2 + law.gain(v2, length) * share, top_v2)
}

/// As [`Zones::entry`] for a whole move whose limits are kept with it; `None` for others.
pub(crate) fn kept_entry<const AXES: usize, const MOTORS: usize>(
    planned: &PlannedMove<AXES, MOTORS>,
    exit_v2: f32,
    share: f32,
) -> Option<f32> {
    let ([b, q], top_v2) = planned.near()?;
    let law = Law {
        a: planned.acceleration,
        q,
        b,
    };
    Some(entry(law, top_v2, planned.length, exit_v2, share))
}

/// The search for slow places from one end of a move outwards.
struct Walk {
    /// The distance into the move up to which further places have an effect, mm.
    way: f32,
    /// The lowest speed so far, mm/s.
    slowest: f32,
    /// The length that is passed, mm.
    passed: f32,
}

impl Walk {
    /// Returns how far into the move a place has an effect that allows the speed `v` and reaches
    /// `turn` mm to both sides. Further places reach no farther than a place without `turn`.
    fn to(&mut self, v: f32, turn: f32, ease: &Ease) -> f32 {
        let own = ease.half(v) - self.passed;
        self.way = min(self.way, own);
        self.slowest = min(self.slowest, v);
        self.way + turn
    }

    fn is_over(&self, ease: &Ease) -> bool {
        self.way <= 0.0 || self.passed > ease.half(self.slowest) + ease.rise()
    }
}

impl<const AXES: usize> Limits<AXES> {
    /// Replaces the curvature at the start of a move by the numbers of the law.
    pub(crate) fn keep_law<const MOTORS: usize>(
        &self,
        of: &mut PlannedMove<AXES, MOTORS>,
        tangents: [[f32; AXES]; 2],
    ) {
        let [q, b] = match of.reach > 0.0 {
            true => curved(&of.bend, tangents),
            false => [0.0; 2],
        };
        of.set_law([b, q]);
        if b > 0.0 {
            of.corner = of.corner.min(self.unit.units(fastest(b)));
        }
    }
}
