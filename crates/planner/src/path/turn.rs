//! The highest speed at which a path may turn from one piece to the next.
//!
//! A turn of less than 22 degrees may be part of a smooth curve. Then its curvature bounds the
//! squared speed. Junction deviation bounds it too, unless the curve explains the turn and stays
//! within `$11` of the pieces. A curve explains a turn if the points are off the curve by no more
//! than their rounding.
//!
//! A sharper turn is a corner: junction deviation bounds its speed. Between short pieces curvature
//! bounds the speed as well. It is measured over one to four pieces to both sides, and the
//! measurement that allows the highest speed counts: over more pieces, turns to alternating sides
//! cancel.
//!
//! A *bent* piece was joined from several pieces that turn. Its ends are no corners of the program,
//! so there the curvature over the length of the shorter piece bounds the speed as well.

use super::curvature::curvature2;
use super::probe::{Probe, When};
use super::window::{Window, PIECES};
use crate::config::Limits;
use crate::path::junction::junction_v2;
use crate::real::{max, min};
use crate::space::polygon::cap;

/// The greatest length over which the curvature of a corner is measured, mm.
const FARTHEST: f32 = 32.0;

/// The curvature of a corner is measured over at most this many pieces to both sides. Random walks
/// over pixels took up to 1.20 times as long as by Grbl's rule with 2, 1.10 times with 3, and 1.04
/// times with 4 (`bench/pixel_paths.py`).
const WIDEST: u32 = 4;

/// Two turns are to the same side if the component of the second turn along the first one is more
/// than this share of the first one.
const ALIKE: f32 = 0.1;

/// A sharp end of a bent piece has a curvature only if the longer of the two pieces is no more than
/// this many times as long as the shorter one. A longer piece is a straight line next to the curve;
/// the curvature would leave it no acceleration.
const UNEVEN: f32 = 4.0;

/// The turn of a path between two pieces.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Turn<const AXES: usize> {
    /// Curvature, divided by the acceleration of each axis, s²/mm².
    pub(crate) bend: [f32; AXES],
    /// The curvature holds for this length to both sides, mm; 0: the path has no curvature here.
    pub(crate) reach: f32,
    /// Highest squared speed, mm²/s².
    pub(crate) v2: f32,
}

impl<const AXES: usize> Turn<AXES> {
    /// A start from rest.
    pub(crate) const REST: Self = Self::corner(0.0);

    /// A corner, which has no curvature: `$11` limits the jump of its speed.
    pub(crate) const fn corner(v2: f32) -> Self {
        Self {
            bend: [0.0; AXES],
            reach: 0.0,
            v2,
        }
    }
}

impl<const AXES: usize> Window<AXES> {
    /// Takes out the first piece that waits, once the turn at its start is known, and returns that
    /// turn. If half of the window waits, the turn is found now.
    pub(crate) fn settle(&mut self, limits: &Limits<AXES>, when: When) -> Option<Turn<AXES>> {
        if self.waiting == 0 {
            return None;
        }
        let number = self.count.wrapping_sub(self.waiting);
        let when = if self.waiting >= PIECES / 2 {
            When::Now
        } else {
            when
        };
        if when == When::Known && self.is_early(number) {
            return None;
        }
        let turn = if self.waiting >= self.known {
            Turn::REST
        } else {
            let mut probe = self.probe;
            let turn = self.turn(number, limits, when, &mut probe);
            self.probe = probe;
            turn?
        };
        self.waiting -= 1;
        self.probe.before = turn.bend;
        self.probe.is_curved = turn.reach > 0.0;
        Some(turn)
    }

    /// Returns true if it is too early to ask for the turn at the start of a piece: the known path
    /// ahead is shorter than the length that the last turn needed, or the piece is short and may
    /// still be joined with the next one.
    fn is_early(&self, number: u32) -> bool {
        let may_grow = self.is_last(number) && self.short.has(number);
        let is_known = self.goes_straight_on(number) || self.is_sharp(number);
        let ahead = self.way(number, self.count);
        may_grow || !is_known && self.is_open(number) && ahead < self.probe.wanted
    }

    /// The turn at the start of a piece that waits, found from the path known so far. `waiting`
    /// pieces wait before it.
    pub(crate) fn guess(&self, waiting: u32, limits: &Limits<AXES>) -> Option<Turn<AXES>> {
        let behind = self.waiting.checked_sub(waiting)?;
        if behind >= self.known {
            return None;
        }
        let number = self.count.wrapping_sub(behind);
        let mut probe = Probe::NEW;
        self.turn(number, limits, When::Now, &mut probe)
    }

    /// The turn at the start of a piece; `None` if more path has to be known for it.
    fn turn(
        &self,
        number: u32,
        limits: &Limits<AXES>,
        when: When,
        probe: &mut Probe<AXES>,
    ) -> Option<Turn<AXES>> {
        if self.is_sharp(number) {
            let v2 = self.corner(number, limits, when)?;
            return Some(if self.is_of_bent_piece(number) {
                self.bent_corner(number, v2, limits)
            } else {
                Turn::corner(v2)
            });
        }
        if self.goes_straight_on(number) {
            return Some(Turn::corner(f32::INFINITY));
        }
        let (bend, reach) = self.curved(number, limits, when, probe)?;
        let is_smooth = probe.goes_on || self.explains(&bend, number, limits);
        let corner = match is_smooth && !self.strays(&bend, number, limits) {
            true => f32::INFINITY,
            false => self.junction(number, limits),
        };
        let is_straight = bend == [0.0; AXES];
        let arcs = if probe.goes_on {
            f32::INFINITY
        } else {
            self.ends_of_arcs(number, limits, when, probe)?
        };
        Some(Turn {
            v2: min(min(corner, arcs), cap(&bend)),
            reach: if is_straight { 0.0 } else { reach },
            bend,
        })
    }

    /// The highest squared speed, mm²/s², on the arcs that end or begin at the start of a piece. At
    /// the end of an arc the second difference would be the mean of arc and neighbour, so the
    /// curvature is measured one chord further inside the arc. `None` if it has to be known
    /// first whether an arc goes on.
    fn ends_of_arcs(
        &self,
        number: u32,
        limits: &Limits<AXES>,
        when: When,
        probe: &Probe<AXES>,
    ) -> Option<f32> {
        let (last, next) = (number.wrapping_sub(1), number.wrapping_add(1));
        let mut v2 = f32::INFINITY;
        if self.before(number) > 1 && self.are_chords(last) {
            v2 = cap(&probe.before);
        }
        if !self.chords.has(number) {
            return Some(v2);
        }
        if self.is_last(number) {
            return (when == When::Now).then_some(v2);
        }
        if self.chords.has(next) {
            let shorter = min(self.placed(number).length, self.placed(next).length);
            let bend = self.curvature(next, shorter, 0.0, limits, &mut [0; 2]);
            v2 = min(v2, cap(&bend));
        }
        Some(v2)
    }

    /// The highest squared speed at the start of a piece, mm²/s²: by `$11`, and at an end of a bent
    /// piece by the curvature there as well.
    fn junction(&self, number: u32, limits: &Limits<AXES>) -> f32 {
        let (before, after) = (self.placed(number.wrapping_sub(1)), self.placed(number));
        let corner = junction_v2(&before.piece.direction, &after.piece.direction, limits);
        if self.is_of_bent_piece(number) {
            min(corner, cap(&self.bent_curve(number, limits)))
        } else {
            corner
        }
    }

    /// The turn at a sharp end of a bent piece that is passed at the squared speed `v2`.
    fn bent_corner(&self, number: u32, v2: f32, limits: &Limits<AXES>) -> Turn<AXES> {
        let (shorter, longer) = self.lengths(number);
        if longer > UNEVEN * shorter {
            return Turn::corner(v2);
        }
        Turn {
            bend: self.bent_curve(number, limits),
            reach: shorter,
            v2,
        }
    }

    /// The curvature at the end of a bent piece.
    fn bent_curve(&self, number: u32, limits: &Limits<AXES>) -> [f32; AXES] {
        let (shorter, _) = self.lengths(number);
        self.curvature(number, min(shorter, FARTHEST), 0.0, limits, &mut [0; 2])
    }

    /// The lengths of the two pieces that meet at the start of a piece, the shorter one first, mm.
    fn lengths(&self, number: u32) -> (f32, f32) {
        let before = self.placed(number.wrapping_sub(1)).length;
        let after = self.placed(number).length;
        (min(before, after), max(before, after))
    }

    /// Returns true if a bent piece ends or begins at the start of this piece, and the path turns
    /// to the same side at both ends of the bent piece.
    fn is_of_bent_piece(&self, number: u32) -> bool {
        let (last, next) = (number.wrapping_sub(1), number.wrapping_add(1));
        let behind = self.bent.has(last) && self.before(number) > 1;
        let ahead = self.bent.has(number) && !self.is_last(number);
        behind && self.turns_alike(number, last) || ahead && self.turns_alike(number, next)
    }

    /// Returns true if the path turns to the same side at the starts of two pieces.
    fn turns_alike(&self, one: u32, other: u32) -> bool {
        let change = |number: u32, axis: usize| {
            let before = self.placed(number.wrapping_sub(1));
            self.placed(number).course[axis] - before.course[axis]
        };
        let (mut both, mut change2) = (0.0, 0.0);
        for axis in 0..AXES {
            let turn = change(one, axis);
            both += turn * change(other, axis);
            change2 += turn * turn;
        }
        both > ALIKE * change2
    }

    /// The highest squared speed at a corner, mm²/s²; `None` if more path has to be known for it.
    fn corner(&self, number: u32, limits: &Limits<AXES>, when: When) -> Option<f32> {
        let corner = self.junction(number, limits);
        let mut by_curve = 0.0;
        for count in 1..=WIDEST {
            if self.from(number) < count && when == When::Known {
                return None;
            }
            let first = number.wrapping_sub(self.before(number).min(count));
            let last = number.wrapping_add(self.from(number).min(count));
            let shorter = min(self.way(first, number), self.way(number, last));
            let bend = self.curvature(number, min(shorter, FARTHEST), 0.0, limits, &mut [0; 2]);
            by_curve = max(by_curve, cap(&bend));
            if corner < by_curve {
                return Some(corner);
            }
        }
        Some(by_curve)
    }

    /// Returns true if the middle of the shorter piece is farther from the curve than `$11`: the
    /// sagitta is `k·l²/8`. Chords of arcs do so if `$12` is above `$11`.
    fn strays(&self, bend: &[f32; AXES], number: u32, limits: &Limits<AXES>) -> bool {
        let (before, after) = (self.placed(number.wrapping_sub(1)), self.placed(number));
        let shorter = min(before.length, after.length);
        let per_curvature = shorter * shorter * 0.125;
        curvature2(bend, limits) * per_curvature * per_curvature
            > limits.deviation * limits.deviation
    }

    /// Returns true if the curve explains the turn, except for rounding.
    fn explains(&self, bend: &[f32; AXES], number: u32, limits: &Limits<AXES>) -> bool {
        if self.are_chords(number) {
            return true;
        }
        let (before, after) = (self.placed(number.wrapping_sub(1)), self.placed(number));
        let all = before.length + after.length;
        let share = before.length * after.length / max(all, f32::MIN_POSITIVE);
        let rounding = max(before.piece.rounding, after.piece.rounding);
        let (from, to) = (&before.piece.direction, &after.piece.direction);
        let turns = from.iter().zip(to).zip(bend);
        let mut axes = turns.zip(limits.acceleration.iter().zip(&limits.half_step));
        axes.all(|(((from, to), bend), (acceleration, half_step))| {
            let curved = 0.5 * all * bend * acceleration;
            (to - from - curved).abs() * share <= 2.0 * (half_step + rounding)
        })
    }
}
