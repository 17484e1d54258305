//! A new move joins the queue: as the next pixel of a row, as the end of the last move, or by
//! itself. It waits in the window until the turn at its start is known.

use super::one_move::{cap, nominal};
use super::Planner;
use crate::config::{SpeedUnit, DECIMALS};
use crate::moves::PlannedMove;
use crate::path::junction::junction_v2;
use crate::path::row::{is_gap, is_short, Row};
use crate::path::{Piece, Turn, When};
use crate::real::{norm2, sqrt};
use crate::{CornerRule, Curve, Kinematics, Move, Overrides};

impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Queues a move. If it and the last move are short and one move can stand for both, it becomes
    /// part of the last move; otherwise it is a move by itself.
    pub(super) fn append(&mut self, of: &Move<AXES>, delta: [i32; MOTORS], events: u32) {
        if !self.keeps_limits() {
            return self.append_by_corners(of, delta, events);
        }
        if self.join(of, &delta).is_some() {
            return;
        }
        let mut planned = PlannedMove::new(of, delta);
        let direction = self.plan(&mut planned, of, events);
        let is_short = self.is_short(planned.length * planned.length);
        let begins = self.window.as_ref().is_some_and(|window| !window.goes_on());
        let start = begins.then(|| self.axes_at(&self.position));
        if let Some(window) = &mut self.window {
            if let Some(start) = start {
                window.begin(&start);
            }
            let piece = piece(&planned, direction, of);
            window.push(&piece, is_short, of.curve.is_some(), &of.target);
        }
        self.begin_short(of, &delta, is_short);
        self.queue_newest(&planned);
        self.begin_row(of, delta);
        self.settle();
    }

    /// Whether the limits of the axes are kept on curves, and not only at corners.
    pub(super) fn keeps_limits(&self) -> bool {
        self.config.corner_rule == CornerRule::Limits && self.window.is_some()
    }

    /// Queues a move by Grbl's rule: the speed at a corner is known once the move after it is.
    fn append_by_corners(&mut self, of: &Move<AXES>, delta: [i32; MOTORS], events: u32) {
        let mut planned = PlannedMove::new(of, delta);
        let direction = self.plan(&mut planned, of, events);
        let v2 = self
            .last
            .map_or(0.0, |before| junction_v2(&before, &direction, &self.limits));
        self.queue_newest(&planned);
        self.last = Some(direction);
        self.begin_row(of, delta);
        self.release(&Turn::corner(v2));
    }

    /// Notes the last queued move, so that further moves can be merged into it.
    pub(super) fn begin_row(&mut self, of: &Move<AXES>, delta: [i32; MOTORS]) {
        let rows = self.pixel_capacity() > 0;
        self.row = Row::begin(of, delta).filter(|_| rows);
    }

    /// Plans the first moves that wait, as far as the turn at their start is known by now.
    pub(super) fn settle(&mut self) {
        /// More than one, so that fewer and fewer moves wait; few, for the time that one line may
        /// take.
        const MOST: usize = 2;
        for _ in 0..MOST {
            if self.settle_one(When::Known).is_none() {
                return;
            }
        }
    }

    /// Plans the first move that waits, with the turn at its start. `None` if the move goes on
    /// waiting.
    pub(super) fn settle_one(&mut self, when: When) -> Option<()> {
        let turn = self.window.as_mut()?.settle(&self.limits, when)?;
        self.release(&turn);
        Some(())
    }

    /// Plans the first move that waits, with the turn at its start.
    fn release(&mut self, turn: &Turn<AXES>) {
        let (overrides, unit) = (self.overrides, self.limits.unit);
        let (before, mut speed) = (self.nominal_before, None);
        let (queue, axis_limits) = self.parts();
        queue.plan(&axis_limits, |of| {
            speed = Some(begin(of, turn, unit, overrides, before));
        });
        self.nominal_before = speed;
    }

    /// A move that waits as it will be planned, by the path known so far. `count` moves wait before
    /// it.
    pub(crate) fn guess(
        &self,
        count: usize,
        of: &PlannedMove<AXES, MOTORS>,
    ) -> PlannedMove<AXES, MOTORS> {
        let window = self.window.as_ref();
        let turn = window.and_then(|window| window.guess(count as u32, &self.limits));
        let turn = turn.unwrap_or(Turn::REST);
        let mut planned = *of;
        begin(&mut planned, &turn, self.limits.unit, self.overrides, None);
        planned
    }

    /// Makes a move part of the last queued move, if it goes straight on and differs only in power.
    /// `None`, and nothing has changed, if it has to be a move by itself.
    pub(super) fn merge(&mut self, of: &Move<AXES>, delta: [i32; MOTORS]) -> Option<()> {
        let (row, pixel) = self.row.as_ref()?.extended(of, delta)?;
        let (last, planned) = self.queue.last_waiting()?;
        let shorter = *last;
        let longer = PlannedMove {
            delta: row.delta(),
            length: sqrt(norm2(&self.axes_mm(row.delta()))),
            pixels: shorter.pixels.checked_add(1)?,
            has_gaps: shorter.has_gaps || is_gap(of),
            ..shorter
        };
        let nominal = self.nominal(&longer);
        let gap = longer.length - shorter.length;
        let slower = nominal < self.nominal(&shorter);
        if is_gap(of) && (slower || !is_short(gap, nominal, longer.acceleration)) {
            return None;
        }
        let is_short = self.is_short(longer.length * longer.length);
        if let Some(window) = self.window.as_mut().filter(|window| window.goes_on()) {
            window.lengthen_last(is_short, &of.target);
        }
        self.lengthen_newest(longer);
        self.pixels.push(pixel);
        self.row = Some(row);
        self.short = None;
        if planned {
            self.nominal_before = Some(nominal);
        } else {
            self.settle();
        }
        Some(())
    }
}

/// A planned move as a piece of the path.
pub(super) fn piece<const AXES: usize, const MOTORS: usize>(
    planned: &PlannedMove<AXES, MOTORS>,
    direction: [f32; AXES],
    of: &Move<AXES>,
) -> Piece<AXES> {
    Piece {
        direction,
        per_top_v2: 1.0 / planned.top_v2(),
        rounding: of.curve.map_or(DECIMALS, Curve::rounding),
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
