//! A move that is planned joins the queue: as a row's next pixel or by itself, with the corners and curves that it completes.

use super::one_move::{cap, gain, nominal};
use super::Planner;
use crate::config::SLOWEST;
use crate::curve::Bend;
use crate::junction::junction_v2;
use crate::moves::PlannedMove;
use crate::real::{least, most, norm2, sqrt, worst};
use crate::row::{is_gap, is_short, Row};
use crate::strokes::{Bound, Piece};
use crate::{CornerRule, Kinematics, Move};

/// What becomes of the open stroke with one more move.
enum Stroke {
    /// It goes on, on a curve or not.
    Open(Option<Bend>),
    /// It is complete: with the limit of its corner, squared, mm²/s².
    Complete(Bound<f32>),
}

impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Queues a move: of its own, or, where both are short and as good as one, in the place of the last one together with that.
    pub(super) fn append(&mut self, of: &Move<AXES>, delta: [i32; MOTORS], events: u32) {
        let joined = self.join(of, &delta);
        let (whole, events) = match &joined {
            Some(joined) => (joined.delta, joined.events),
            None => (delta, events),
        };
        let (mut planned, direction) = self.plan(of, whole, events);
        let mut corner_v2 = match &self.last {
            Some(_) => f32::INFINITY,
            None => 0.0,
        };
        let mut stroke = Stroke::Open(None);
        match (self.config.corner_rule, &self.last) {
            (CornerRule::Grbl, Some((before, _))) => {
                corner_v2 = junction_v2(before, &direction, &self.limits);
            }
            (CornerRule::Grbl, None) => {}
            (CornerRule::Limits, _) => {
                let asked = match &joined {
                    Some(joined) => {
                        (planned.corner, planned.cap) = (joined.corner, joined.cap);
                        Some(joined.way)
                    }
                    None => self.begin_short(of, &delta, planned.length),
                };
                let vector = asked.unwrap_or_else(|| direction.map(|u| u * planned.length));
                let piece = Piece {
                    length2: norm2(&vector),
                    vector,
                    top_v2: planned.top_v2(),
                    is_chord: of.curve.is_some(),
                };
                stroke = self.add_to_stroke(&piece, joined.is_some());
                match &stroke {
                    Stroke::Open(Some(curve)) => planned.bend(curve),
                    Stroke::Complete(corner) if corner.moves == 1 => {
                        corner_v2 = least(corner.limit, corner_v2);
                    }
                    Stroke::Open(None) | Stroke::Complete(_) => {}
                }
            }
        }
        let top_v2 = planned.top_v2();
        self.enqueue(planned, direction, corner_v2);
        if let Stroke::Complete(corner) = stroke {
            if corner.moves > 1 {
                self.lower_corner(corner, top_v2);
            }
            self.lower_curve();
        }
        let rows = self.pixel_capacity() > 0;
        self.row = Row::begin(of, whole).filter(|_| rows);
    }

    /// Makes a move part of the last queued one, where that goes straight on and differs in power only. `None`, and nothing has
    /// changed, where it is to be a move of its own.
    pub(super) fn merge(&mut self, of: &Move<AXES>, delta: [i32; MOTORS]) -> Option<()> {
        let (row, pixel) = self.row.as_ref()?.extended(of, delta)?;
        let shorter = *self.queue.last_waiting()?;
        let mut longer = PlannedMove {
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
        if let (CornerRule::Limits, Some((direction, _))) = (self.config.corner_rule, self.last) {
            self.straighten(&mut longer, &direction, gap);
        }
        self.queue.lengthen_last(longer, self.gain(&longer));
        self.pixels.push(pixel);
        self.row = Some(row);
        self.short = None;
        Some(())
    }

    /// Queues a planned move whose corner may be taken at the squared speed `corner_v2`, mm²/s². There is room.
    fn enqueue(
        &mut self,
        mut planned: PlannedMove<MOTORS>,
        direction: [f32; AXES],
        corner_v2: f32,
    ) {
        let unit = self.limits.unit;
        let before = self.last.map(|(_, speed)| speed);
        let nominal = self.nominal(&planned);
        planned.corner = planned.corner.min(unit.units(corner_v2));
        planned.cap = cap(unit, before, nominal, planned.corner.min(planned.cap));
        let _room = self.queue.push(planned, self.gain(&planned));
        self.last = Some((direction, nominal));
    }

    /// Adds a move to the open stroke, or begins the next one with it. `joins`: it ends a move of the open one.
    fn add_to_stroke(&mut self, piece: &Piece<AXES>, joins: bool) -> Stroke {
        if !joins && self.strokes.ends_before(piece, &self.limits) {
            let corner = self.strokes.complete(false, &self.limits);
            self.lower_corner(corner, piece.top_v2);
            self.lower_curve();
            self.strokes.leave_curve();
        }
        if self.strokes.add(piece, &self.limits) {
            let alone = piece.stands_alone(&self.limits);
            Stroke::Complete(self.strokes.complete(alone, &self.limits))
        } else {
            Stroke::Open(self.strokes.open_curve())
        }
    }

    /// The last move is longer by `more` mm. If it has outgrown any curve that it was taken for a chord of, it is freed of
    /// that.
    fn straighten(&mut self, longer: &mut PlannedMove<MOTORS>, direction: &[f32; AXES], more: f32) {
        let piece = Piece {
            vector: direction.map(|u| u * more),
            length2: longer.length * longer.length,
            top_v2: longer.top_v2(),
            is_chord: false,
        };
        let alone = piece.stands_alone(&self.limits);
        if alone {
            longer.acceleration = 1.0 / worst(direction, &self.limits.per_acceleration);
            let steps = longer.delta.iter().map(|steps| steps.unsigned_abs());
            longer.rate = self.rate(longer.length, steps.max().unwrap_or(1), direction);
        }
        self.strokes.lengthen_last(&piece.vector, more, alone);
    }

    fn lower_corner(&mut self, corner: Bound<f32>, top_v2: f32) {
        if corner.limit < top_v2 {
            let limit = self.limits.unit.units(corner.limit);
            self.queue.lower_last(corner.moves, |planned| {
                planned.corner = planned.corner.min(limit);
                planned.cap = planned.cap.min(limit);
                None
            });
        }
    }

    fn lower_curve(&mut self) {
        let lengths = || self.queue.latest().map(|planned| planned.length);
        let Some(curve) = self.strokes.curve(lengths, &self.limits) else {
            return;
        };
        // Ramps that are planned to begin late must not become flatter: the running move may not be able to stop for
        // them any more.
        let committed = self.limits.unit.units(self.committed_v2);
        let ramps = if self
            .queue
            .stops_before_last(curve.moves, committed.saturating_add(1))
        {
            curve.limit.ramps
        } else {
            f32::INFINITY
        };
        let bend = Bend {
            ramps,
            ..curve.limit
        };
        self.bend_last(curve.moves, &bend);
    }

    /// Takes over the limits of a curve for the last `count` moves. Linear in `count`.
    fn bend_last(&mut self, count: usize, bend: &Bend) {
        let (unit, jerk) = (self.limits.unit, self.config.jerk);
        // What becomes of nominal speeds, and so of caps, is the same for all; rows with gaps obey the rapid override.
        let over_gaps = bend.rate * f32::from(self.overrides.rapid) * 0.01;
        let [cap, cap_of_gaps] = [bend.rate, over_gaps].map(|fastest| {
            let fastest = most(fastest, SLOWEST);
            unit.units(fastest * fastest)
        });
        self.queue.lower_last(count, |planned| {
            let most = if planned.has_gaps { cap_of_gaps } else { cap };
            planned.cap = planned.cap.min(most);
            let flatter = bend.ramps < planned.acceleration;
            planned.bend(bend);
            (flatter || jerk > 0.0).then(|| gain(unit, jerk, planned))
        });
        if let (Some((_, speed)), Some(last)) = (&mut self.last, self.queue.newest()) {
            *speed = nominal(self.overrides, last);
        }
    }
}
