//! A target becomes steps, then a move with its limits, and the move joins the queue.
//!
//! The move joins as the next pixel of a row, as the end of the last move, or by itself. It waits
//! in the window until the turn at its start is known.

use super::one_move::{cap, nominal};
use super::Planner;
use crate::built::RASTERS;
use crate::config::SpeedUnit;
use crate::moves::PlannedMove;
use crate::path::junction::junction_v2;
use crate::path::row::{is_gap, is_short, Row};
use crate::path::short::Short;
use crate::path::{Piece, Turn, When, PIECES};
use crate::real::{norm2, sqrt};
use crate::{Coordinate, CornerRule, Curve, Feed, Kinematics, Move, Overrides};

// Places of the axes and steps of the motors: the conversion of one to the other, and the end of
// the queue.
impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Returns the end of the last queued move, in steps of each motor.
    pub const fn position(&self) -> [i32; MOTORS] {
        self.position
    }

    /// Sets where the motors stand. At rest with an empty queue only.
    pub fn set_position(&mut self, steps: [i32; MOTORS]) {
        self.position = steps;
        self.forget_direction();
    }

    /// As [`Planner::steps_at`]. Computes only the steps of motors whose place has changed since
    /// the last call.
    pub(super) fn approach(&mut self, axes: &[Coordinate; AXES]) -> Option<[i32; MOTORS]> {
        let motors = self.kinematics.motors(axes).into_iter();
        let scales = motors.zip(self.scales.steps_per_mm);
        for (known, (motor, scale)) in self.target.iter_mut().zip(scales) {
            if known.0 != motor {
                *known = (motor, scale.steps(motor)?);
            }
        }
        Some(self.target.map(|(_, steps)| steps))
    }

    /// Returns the places of the motors, in steps, for the places `axes` of the axes; `None` if a
    /// place is beyond `i32`.
    pub fn steps_at(&self, axes: &[Coordinate; AXES]) -> Option<[i32; MOTORS]> {
        let motors = self.kinematics.motors(axes);
        let mut steps = [0; MOTORS];
        for ((steps, motor), scale) in steps.iter_mut().zip(motors).zip(self.scales.steps_per_mm) {
            *steps = scale.steps(motor)?;
        }
        Some(steps)
    }

    /// Returns the places of the axes when the motors stand at `steps`.
    pub fn axes_at(&self, steps: &[i32; MOTORS]) -> [Coordinate; AXES] {
        let mut motors = [Coordinate::ZERO; MOTORS];
        for ((motor, steps), scale) in motors.iter_mut().zip(steps).zip(self.scales.steps_per_mm) {
            *motor = scale.coordinate(*steps);
        }
        self.kinematics.axes(&motors)
    }

    /// Returns `steps`, in which each further motor of an axis has the count of the axis's own
    /// motor. All motors of an axis must have the same count before a move, because the move brings
    /// them to the same count.
    pub fn ganged(&self, steps: [i32; MOTORS]) -> [i32; MOTORS] {
        let mut ganged = steps;
        for (motor, place) in ganged.iter_mut().enumerate() {
            let own = steps.get(self.kinematics.axis_of(motor));
            *place = own.copied().unwrap_or(*place);
        }
        ganged
    }
}

// The move joins the queue. A piece of a few steps becomes part of the last queued move (see
// `short`).
impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Makes a move part of the last queued move, if it goes straight on and differs only in power.
    /// `None`, and nothing has changed, if it has to be a move by itself.
    pub(super) fn merge(&mut self, of: &Move<AXES>, delta: [i32; MOTORS]) -> Option<()> {
        let row = self.row.as_ref().filter(|_| RASTERS)?;
        let (row, pixel) = row.extended(of, delta)?;
        let (last, is_planned) = self.queue.last_waiting()?;
        if last.coarse != 0 {
            return None;
        }
        let pixels = last.pixels.checked_add(1)?;
        let length = sqrt(norm2(&self.axes_mm(row.delta())));
        let is_gap = is_gap(of);
        let eased = self.limits.ease().is_some();
        if is_gap && !self.takes_gap(last, length - last.length) {
            return None;
        }
        let is_short = self.is_short(&row.delta(), length);
        if let Some(window) = self.window.get_mut().filter(|window| window.goes_on()) {
            window.lengthen_last(is_short, &of.target);
        }
        self.lengthen_newest(|last| {
            (last.delta, last.length, last.pixels) = (row.delta(), length, pixels);
            last.has_gaps |= is_gap;
            if eased {
                last.set_near(None);
            }
        });
        self.pixels.push(pixel);
        self.row = Some(row);
        self.short = None;
        if is_planned {
            self.nominal_before = self.queue.newest().map(|last| self.nominal(last));
        } else {
            self.settle();
        }
        Some(())
    }

    /// Returns true if a rapid of `length` mm may be part of the row `last`, and slows it down
    /// nowhere.
    fn takes_gap(&self, last: &PlannedMove<AXES, MOTORS>, length: f32) -> bool {
        let nominal = self.nominal(&PlannedMove {
            has_gaps: true,
            ..*last
        });
        nominal >= self.nominal(last) && is_short(length, nominal, last.acceleration)
    }

    /// Queues a move. If it and the last move are short and one move can stand for both, it becomes
    /// part of the last move; otherwise it is a move by itself.
    pub(super) fn append(&mut self, of: &Move<AXES>, delta: [i32; MOTORS], events: u32) {
        if !self.keeps_limits() {
            return self.append_by_corners(of, delta, events);
        }
        if self.join(of, &delta).is_some() {
            return;
        }
        let begins = self.window.get().is_some_and(|window| !window.goes_on());
        let start = begins.then(|| self.axes_at(&self.position));
        if let Some((window, start)) = self.window.get_mut().zip(start) {
            window.begin(&start);
        }
        let mut planned = PlannedMove::new(of, delta);
        let exact = || Some(self.window.get()?.way_on(&of.target));
        let direction = self.plan(&mut planned, of, events, exact);
        let is_short = self.is_short(&delta, planned.length);
        if let Some(window) = self.window.get_mut() {
            let piece = piece(&planned, direction, of);
            window.push(&piece, is_short, of.curve.is_some(), &of.target);
        }
        self.begin_short(of, &delta, is_short);
        self.queue_newest(&planned);
        self.begin_row(of, delta);
        self.settle();
    }

    /// Returns true if the limits of the axes are kept on curves, and not only at corners.
    fn keeps_limits(&self) -> bool {
        self.config.corner_rule == CornerRule::Limits && self.window.get().is_some()
    }

    /// Queues a move by Grbl's rule: the speed at a corner is known once the move after it is.
    fn append_by_corners(&mut self, of: &Move<AXES>, delta: [i32; MOTORS], events: u32) {
        let mut planned = PlannedMove::new(of, delta);
        let direction = self.plan(&mut planned, of, events, || None);
        let v2 = self
            .last
            .map_or(0.0, |before| junction_v2(&before, &direction, &self.limits));
        self.queue_newest(&planned);
        self.last = Some(direction);
        self.begin_row(of, delta);
        self.release(&Turn::corner(v2));
        self.plan_known();
    }

    /// Makes a short move by `delta` steps part of the last queued move, if that is short too and
    /// not planned yet. `None`, and nothing has changed, if one move cannot stand for both.
    fn join(&mut self, of: &Move<AXES>, delta: &[i32; MOTORS]) -> Option<()> {
        let short = self.short.as_ref()?;
        let (last, is_planned) = self.queue.last_waiting()?;
        let fits = !is_planned && last.goes_on_with(of) && of.curve.is_none();
        let more = self.axes_mm(*delta);
        let short2 = self.short2(delta);
        if !fits || !self.is_short(&last.delta, last.length) || norm2(&more) >= short2 {
            return None;
        }
        let way = self.window.get()?.way_on(&of.target);
        let joined = short.joined(delta, &way, short2)?;
        let mut planned = PlannedMove::new(of, joined.delta());
        let exact = || Some(joined.pieces.way());
        let direction = self.plan(&mut planned, of, joined.events(), exact);
        let is_short = self.is_short(&planned.delta, planned.length);
        let piece = piece(&planned, direction, of);
        let window = self.window.get_mut()?;
        window.join_last(&piece, is_short, joined.pieces.is_bent, &of.target);
        self.lengthen_newest(|last| *last = planned);
        self.short = Some(joined);
        self.begin_row(of, joined.delta());
        self.settle();
        Some(())
    }

    /// Notes the last queued move, which makes `delta` steps, so that the next one can be joined
    /// with it if both are short.
    fn begin_short(&mut self, of: &Move<AXES>, delta: &[i32; MOTORS], is_short: bool) {
        self.short = None;
        if !is_short {
            return;
        }
        let plain = matches!(of.feed, Feed::PerMinute(_)) && of.curve.is_none();
        let window = self.window.get().filter(|_| plain);
        self.short = window.map(|window| Short::new(delta, window.last_way()));
    }

    /// Returns true if a move by `delta` steps, `length` mm long, has too few steps to give a
    /// direction. Most moves are too long for that on any axis.
    fn is_short(&self, delta: &[i32; MOTORS], length: f32) -> bool {
        let length2 = length * length;
        length2 < self.limits.short2 && length2 < self.short2(delta)
    }

    /// The square of the length below which a move by `delta` steps has too few of them, mm².
    fn short2(&self, delta: &[i32; MOTORS]) -> f32 {
        match self.limits.is_uneven {
            true => self.limits.uneven_short2(&self.axes_mm(*delta)),
            false => self.limits.short2,
        }
    }

    /// Notes the last queued move, so that further moves can be merged into it.
    fn begin_row(&mut self, of: &Move<AXES>, delta: [i32; MOTORS]) {
        let rows = self.pixel_capacity() > 0;
        self.row = Row::begin(of, delta).filter(|_| rows);
    }

    /// Plans the first moves that wait, as far as the turn at their start is known by now.
    fn settle(&mut self) {
        /// More than one, so that fewer moves wait after each line; few, because a line must not
        /// take long.
        const MOST: usize = 2;
        for _ in 0..MOST {
            if self.settle_one(When::Known).is_none() {
                return;
            }
            self.plan_known();
        }
    }

    /// The turn at the start of the first move that waits becomes known. Without a jerk limit the
    /// move is planned. `None` if the move goes on waiting.
    pub(super) fn settle_one(&mut self, when: When) -> Option<()> {
        let turn = self.window.get_mut()?.settle(&self.limits, when)?;
        self.release(&turn);
        Some(())
    }

    /// As [`Self::settle_one`], for the turn given.
    #[inline(always)] // a call would take 20 more instructions for each line
    fn release(&mut self, turn: &Turn<AXES>) {
        if self.is_eased() {
            return self.begin_eased(turn);
        }
        let (overrides, unit) = (self.overrides, self.limits.unit);
        let (before, mut speed) = (self.nominal_before, None);
        let (queue, axis_limits) = self.parts();
        queue.plan_settled(&axis_limits, |of| {
            speed = Some(begin(of, turn, unit, overrides, before));
        });
        self.nominal_before = speed;
    }

    /// With a jerk limit a turn has become known: plans the next move if enough of the path after it
    /// is known. Two turns become known with a line at most, so moves that wait catch up.
    fn plan_known(&mut self) {
        if self.is_eased() {
            self.plan_next(When::Known);
        }
    }

    /// Sets the limits at the start of the first move that waits, with a jerk limit.
    #[inline(never)]
    fn begin_eased(&mut self, turn: &Turn<AXES>) {
        let (overrides, unit) = (self.overrides, self.limits.unit);
        let (before, mut speed) = (self.nominal_before, None);
        let (tangents, limits) = (self.tangents(), &self.limits);
        self.queue.settle(|of, rests| {
            let turn = if rests { &Turn::REST } else { turn };
            speed = Some(begin(of, turn, unit, overrides, before));
            if let Some(tangents) = tangents {
                limits.keep_law(of, tangents);
            }
        });
        self.nominal_before = speed;
    }

    /// The directions of the two moves that meet at the next turn to be known, over the acceleration
    /// of each axis.
    #[inline(never)]
    fn tangents(&self) -> Option<[[f32; AXES]; 2]> {
        let (axis_limits, [before, next]) = (self.axis_limits(), self.queue.next_turn());
        let next = axis_limits.tangent(next?);
        Some([
            before.map_or(next, |before| axis_limits.tangent(before)),
            next,
        ])
    }

    /// Plans one more move now.
    pub(super) fn plan_one(&mut self) {
        if self.is_eased() {
            self.plan_one_eased(PIECES);
        } else {
            self.settle_one(When::Now);
        }
    }

    /// As [`Self::plan_one`], with a jerk limit. If turns have to be known first, `most` of them
    /// become known at most.
    #[inline(never)]
    pub(super) fn plan_one_eased(&mut self, most: u32) {
        if self.plan_next(When::Now) {
            return;
        }
        for _ in 0..most {
            if self.settle_one(When::Now).is_none() {
                break;
            }
        }
        if most > 1 {
            self.plan_next(When::Now);
        }
    }

    /// Plans the next move whose turn is known, with a jerk limit. Returns whether there was one
    /// that could be planned.
    ///
    /// `When::Known`: only if the path after it is known as far as it has an effect. `When::Now`:
    /// also if the path is so long that the move can be made slow at its end and needs to know no
    /// more. If it is shorter, the last move that is queued is made to end at rest, and all turns up
    /// to there have to be known.
    #[inline(never)]
    fn plan_next(&mut self, when: When) -> bool {
        let Some(ease) = self.limits.ease().copied() else {
            return false;
        };
        let index = self.queue.next_to_plan();
        let Some(mut zones) = self.axis_limits().zones(&self.queue.path(), index) else {
            return false;
        };
        match zones.unknown {
            None => (),
            Some(_) if when == When::Known => return false,
            Some(known) if known >= 6.0 * ease.rise() => {
                let slow = 2.0 * (known - ease.rise()) / ease.seconds;
                self.queue.slow_down(self.limits.unit.units(slow * slow));
                zones.end_at(slow, &ease);
            }
            Some(_) => {
                self.queue.close();
                if !self.queue.is_settled() {
                    return false;
                }
            }
        }
        let near = self
            .axis_limits()
            .near_by(&self.queue.path(), index, &zones);
        let (queue, axis_limits) = self.parts();
        queue.plan_near(&axis_limits, near);
        true
    }

    /// A copy of `of`, a move that waits, with the limits at its start by the path known so far.
    /// `count` moves wait before it.
    pub(crate) fn guess(
        &self,
        count: usize,
        of: &PlannedMove<AXES, MOTORS>,
    ) -> PlannedMove<AXES, MOTORS> {
        let window = self.window.get();
        let turn = window.and_then(|window| window.guess(count as u32, &self.limits));
        let turn = turn.unwrap_or(Turn::REST);
        let mut planned = *of;
        begin(&mut planned, &turn, self.limits.unit, self.overrides, None);
        planned
    }
}

/// A planned move as a piece of the path.
fn piece<const AXES: usize, const MOTORS: usize>(
    planned: &PlannedMove<AXES, MOTORS>,
    direction: [f32; AXES],
    of: &Move<AXES>,
) -> Piece<AXES> {
    Piece {
        direction,
        per_top_v2: 1.0 / planned.top_v2(),
        rounding: of.curve.map_or(of.rounding, Curve::rounding),
    }
}

/// Sets the limits at the start of a move from the turn there. `before` is the nominal speed of the
/// move before it, mm/s. Returns the nominal speed of the move itself.
fn begin<const AXES: usize, const MOTORS: usize>(
    of: &mut PlannedMove<AXES, MOTORS>,
    turn: &Turn<AXES>,
    unit: SpeedUnit,
    overrides: Overrides,
    before: Option<f32>,
) -> f32 {
    of.bend = turn.bend;
    of.reach = turn.reach;
    of.corner = unit.units(turn.v2);
    let nominal = nominal(overrides, of);
    of.cap = cap(unit, before, nominal, of.corner);
    nominal
}
