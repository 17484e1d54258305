//! Curves and corners of a path that is cut into short moves.
//!
//! Coordinates are rounded to steps and to a few decimals, so the direction of a short move says little, and the turn from
//! one short move to the next says nothing. So short moves are joined to *strokes* until the path has turned by more than
//! rounding can explain, or is so long that no turn that is still hidden in it could bound the speed:
//!
//! ```text
//!      stroke             next stroke
//!    o-o--o-o-o___o_                        a stroke ends where it has strayed by the tolerance t from the straight
//!                   ‾‾o--__                 line on which the last one lies, or with the length v·√(t/a), in which the
//!                      t | ‾o-_             sharpest curve that v allows (R = v²/a) strays by t
//!    - - - - - - - - - - - - - -o
//! ```
//!
//! * Where one stroke meets the next, junction deviation rules. A move that is long enough is a stroke of its own: between
//!   long moves this is Grbl's rule.
//! * Over a window of four strokes, the turn from the first to the last one divided by the distance of their middles is
//!   the curvature: turns count with their sign. A circle strays by t in the length `√(t·R)`: at 250 steps/mm and Grbl's `$11` and
//!   `$12` t is 0.021 mm, ten times `$12`: a stroke is one chord of `$12`, the window four.
//!   The limits of all moves in the window are lowered, those that are queued already with them.
//! * Until the open stroke is complete, its moves are held to the curvature of the last window: at the end of a path no
//!   window follows, and an axis that is much stronger than the other reaches its highest speed in one move.
//! * A corner that is much slower by junction deviation than the curvature of its window is a corner, not a curve.
//! * The first pieces of a curve may be the end of the stroke before it, as long as they have not strayed from that by t. Behind a
//!   corner to the other side a circle strays by t at most, and is back, within `√(8·t·R)`: so far back a window's limits
//!   reach beyond its first stroke.
//!
//! The acceleration on a curve is shared as on an arc (see `curve`). With `u` along the path and `n` across,
//! `a_t·u + a_n·n` keeps to `a_i` on each axis if `√(a_t² + a_n²) ≤ a_i / √(u_i² + n_i²)` (Cauchy and Schwarz), and also if
//! `a_t·|u_i| + a_n·|n_i| ≤ a_i`: whichever leaves more to the ramps.

use crate::config::{Limits, DECIMALS};
use crate::curve::Bend;
use crate::junction::junction_v2;
use crate::real::{least, most, norm2, sqrt};
use crate::Curve;

/// Strokes that a window reaches back from its last one.
const BACK: usize = 3;

/// Strokes in a window.
const ALL: usize = BACK + 1;

/// Share of a window's radius that is relied on: rounding can make a fifth too much of it.
const CERTAIN: f32 = 0.8;

/// A window whose squared speed is less than this share of what the stroke before it is held to may have begun in that stroke:
/// more than what rounding makes of a curve that goes on.
const SHARPER: f32 = 0.75;

/// Where a curve takes less than this share of the acceleration it is taken as straight: a line's rounding looks like
/// a curve that takes a twentieth. (What is left to the ramps is then too much by 0.8 % at most, by the square.)
const STRAIGHT: f32 = 0.09;

/// A piece of path that counts as straight.
#[derive(Clone, Copy, Debug)]
struct Stroke<const AXES: usize> {
    direction: [f32; AXES],
    /// mm.
    length: f32,
    /// How many moves it is made of.
    moves: u16,
    /// Whether it is no part of a curve of short moves.
    alone: bool,
    /// Highest squared speed of its moves, at any override, mm²/s².
    top_v2: f32,
    /// Squared speed at its start by junction deviation, mm²/s².
    corner_v2: f32,
    /// Squared speed on it by the curvature of windows so far, mm²/s².
    curve_v2: f32,
}

/// The strokes at the end of the queue.
#[derive(Clone, Debug)]
pub(crate) struct Strokes<const AXES: usize> {
    /// The last ones that are complete, in turn.
    complete: [Option<Stroke<AXES>>; ALL],
    /// Where the latest of them is.
    latest: usize,
    /// The one before them: how many moves it is made of, and the squared speed on it by curvature, mm²/s².
    before: (u16, f32),
    /// From the end of the last complete one to the end of the queue, mm.
    open: [f32; AXES],
    /// Moves in the open one.
    open_moves: u16,
    /// The highest `top_v2` of them.
    open_top_v2: f32,
    /// The last move, mm.
    last: [f32; AXES],
    /// Direction in which the first stroke from rest begins, once it is long enough to tell.
    begin: Option<[f32; AXES]>,
    /// What the window that ends with the last complete stroke leaves to moves on the same curve.
    curve: Option<Bend>,
}

/// A move as far as it matters here.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece<const AXES: usize> {
    /// As it is in steps, or, where those are few, as it was asked for: mm.
    pub(crate) vector: [f32; AXES],
    /// The square of its length, mm²; of a row's last piece, that of the row.
    pub(crate) length2: f32,
    /// Highest speed squared, at any override, mm²/s².
    pub(crate) top_v2: f32,
    /// Whether it is a chord of an arc whose radius is known.
    pub(crate) is_chord: bool,
}

/// A limit for the last moves of the queue.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Bound<T> {
    /// How many moves.
    pub(crate) moves: usize,
    pub(crate) limit: T,
}

impl<const AXES: usize> Piece<AXES> {
    /// Whether a length is `times` that of the longest stroke; both squared.
    fn exceeds(&self, length2: f32, times2: f32, limits: &Limits<AXES>) -> bool {
        let longest2 = limits.tolerance * self.top_v2 * limits.per_weakest;
        length2 >= times2 * most(longest2, limits.stroke2)
    }

    /// Whether it is a stroke of its own, and no part of a curve of short moves.
    pub(crate) fn stands_alone(&self, limits: &Limits<AXES>) -> bool {
        const LONGER: f32 = 2.0;
        self.is_chord || self.exceeds(self.length2, LONGER * LONGER, limits)
    }
}

impl<const AXES: usize> Strokes<AXES> {
    pub(crate) const fn new() -> Self {
        Self {
            complete: [None; ALL],
            latest: 0,
            before: (0, 0.0),
            open: [0.0; AXES],
            open_moves: 0,
            open_top_v2: 0.0,
            last: [0.0; AXES],
            begin: None,
            curve: None,
        }
    }

    /// What the curve of which the open stroke is the end leaves to its moves. It is not complete, so no window has it yet; at the
    /// end of a path none ever will.
    pub(crate) const fn open_curve(&self) -> Option<Bend> {
        self.curve
    }

    /// The open stroke begins at a corner, and is no part of the curve before it.
    pub(crate) fn leave_curve(&mut self) {
        self.curve = None;
    }

    /// Whether the open stroke is to be completed before `piece` is added.
    pub(crate) fn ends_before(&self, piece: &Piece<AXES>, limits: &Limits<AXES>) -> bool {
        if self.open_moves == 0 {
            return false;
        }
        let along = dot(&self.open, &piece.vector);
        let (open2, tolerance2) = (norm2(&self.open), limits.tolerance * limits.tolerance);
        let longer2 = piece.length2 - tolerance2;
        along < 0.0
            || dot(&self.last, &piece.vector) < 0.0
            || longer2 > 0.0 && (open2 * longer2 > along * along || piece.stands_alone(limits))
    }

    /// Whether the last move, which is in the open stroke, may become longer by `piece`.
    pub(crate) fn has_room(&self, piece: &Piece<AXES>, limits: &Limits<AXES>) -> bool {
        self.open_moves > 0 && !self.ends_before(piece, limits)
    }

    /// The last move is taken back, to be added again with a piece more.
    pub(crate) fn take_back_last(&mut self) {
        self.open_moves = self.open_moves.saturating_sub(1);
    }

    /// Adds a move that is or ends with `piece`; answers whether the stroke is to be completed with it.
    pub(crate) fn add(&mut self, piece: &Piece<AXES>, limits: &Limits<AXES>) -> bool {
        self.open_moves = self.open_moves.saturating_add(1); // more than are queued is enough
        for (open, moved) in self.open.iter_mut().zip(&piece.vector) {
            *open += moved;
        }
        self.open_top_v2 = most(self.open_top_v2, piece.top_v2);
        self.last = piece.vector;
        let length2 = norm2(&self.open);
        if piece.is_chord || piece.exceeds(length2, 1.0, limits) {
            return true;
        }
        self.straight_on(length2, limits).is_some_and(|straight| {
            let along = dot(&straight, &self.open);
            along < 0.0 || length2 - along * along > limits.tolerance * limits.tolerance
        })
    }

    /// The direction from which the open stroke, with the squared length `length2`, strays: that of the last one, or, from
    /// rest, that in which it began itself. `None` while rounding hides that.
    fn straight_on(&mut self, length2: f32, limits: &Limits<AXES>) -> Option<[f32; AXES]> {
        const TELLS: f32 = 8.0; // times the tolerance: rounding turns it by some hundredths
        if let Some(last) = self.back(0) {
            return Some(last.direction);
        }
        let enough = TELLS * limits.tolerance;
        if self.begin.is_none() && length2 >= enough * enough {
            let per_length = 1.0 / sqrt(length2);
            self.begin = Some(self.open.map(|x| x * per_length));
        }
        self.begin
    }

    /// The last move has become longer by `vector`, straight on, `more` mm; `alone`: it stands alone now.
    pub(crate) fn lengthen_last(&mut self, vector: &[f32; AXES], more: f32, alone: bool) {
        if self.open_moves > 0 {
            for (open, moved) in self.open.iter_mut().zip(vector) {
                *open += moved;
            }
        } else if let Some(last) = self.back_mut(0) {
            last.length += more;
            last.alone |= alone;
        }
    }

    /// Completes the open stroke; answers the limit of its corner (squared speed, mm²/s²). `alone`: it is a single
    /// move that stands alone.
    pub(crate) fn complete(&mut self, alone: bool, limits: &Limits<AXES>) -> Bound<f32> {
        let length = most(sqrt(norm2(&self.open)), f32::MIN_POSITIVE);
        let per_length = 1.0 / length;
        let direction = self.open.map(|x| x * per_length);
        let moves = self.open_moves;
        let (corner_v2, inner) = match self.back(0) {
            Some(last) => (
                junction_v2(&last.direction, &direction, limits),
                last.moves.saturating_sub(1),
            ),
            None => (f32::INFINITY, 0),
        };
        let stroke = Stroke {
            direction,
            length,
            moves,
            alone,
            top_v2: self.open_top_v2,
            corner_v2,
            curve_v2: f32::INFINITY,
        };
        self.latest = self.latest.wrapping_add(1);
        let oldest = self.complete.get_mut(self.latest % ALL);
        let gone = oldest.and_then(|oldest| oldest.replace(stroke));
        self.before = gone.map_or((0, 0.0), |gone| (gone.moves, gone.curve_v2));
        self.open = [0.0; AXES];
        self.open_moves = 0;
        self.open_top_v2 = 0.0;
        Bound {
            moves: usize::from(moves) + usize::from(inner),
            limit: corner_v2,
        }
    }

    /// The complete stroke so many places before the last one.
    fn back(&self, places: usize) -> Option<&Stroke<AXES>> {
        let place = self.latest.wrapping_sub(places) % ALL;
        self.complete.get(place)?.as_ref()
    }

    fn back_mut(&mut self, places: usize) -> Option<&mut Stroke<AXES>> {
        let place = self.latest.wrapping_sub(places) % ALL;
        self.complete.get_mut(place)?.as_mut()
    }

    /// What the window that ends with the last complete stroke leaves to its moves, where that is less than what windows
    /// before it left. `lengths` are those of all queued moves, mm, the latest first.
    pub(crate) fn curve<L>(
        &mut self,
        lengths: impl FnOnce() -> L,
        limits: &Limits<AXES>,
    ) -> Option<Bound<Bend>>
    where
        L: Iterator<Item = f32>,
    {
        let held = self.curve.take();
        let window = Window::of((0..ALL).map_while(|back| self.back(back)))?;
        let (curve, bend) = window.bend(limits)?;
        let curve_v2 = curve.top_v2();
        if window.sharpest_v2 < curve_v2 * window.corner_share() {
            return None;
        }
        self.curve = Some(bend);
        // A change of less than this, as rounding makes it, is not worth the work.
        const WORTH: f32 = 0.97;
        let (mut all, mut moves) = (usize::from(self.open_moves), 0);
        for back in 0..window.strokes {
            if let Some(stroke) = self.back_mut(back) {
                all += usize::from(stroke.moves);
                if curve_v2 < stroke.curve_v2 * WORTH {
                    stroke.curve_v2 = curve_v2;
                    moves = all;
                }
            }
        }
        // Those of the last stroke are held to the last window already, but for the one that has just completed it.
        let newest = self.back(0).map_or(0, |stroke| usize::from(stroke.moves));
        if moves == newest
            && held.is_some_and(|held| held.rate <= bend.rate && held.ramps <= bend.ramps)
        {
            moves = 1;
        }
        // A window of fewer strokes begins at rest, or at a move that stands alone.
        let (before, before_v2) = self.before;
        if window.strokes > BACK && moves == all && curve_v2 < before_v2 * SHARPER {
            let inner = lengths()
                .skip(all)
                .take(usize::from(before).saturating_sub(1));
            moves += within(8.0 * limits.tolerance * curve.radius, inner);
        }
        (moves > 0).then_some(Bound { moves, limit: bend })
    }
}

/// The last strokes, as many as belong to one curve.
struct Window<const AXES: usize> {
    strokes: usize,
    /// Sum and difference of the directions at its ends.
    sum: [f32; AXES],
    change: [f32; AXES],
    /// Between the middles of its ends, mm.
    length: f32,
    /// The slowest corner within, squared, mm²/s².
    sharpest_v2: f32,
    /// Highest squared speed at any override, mm²/s².
    top_v2: f32,
}

impl<const AXES: usize> Window<AXES> {
    /// `strokes`: the last one first. `None` where it has no more than one stroke.
    fn of<'s>(mut strokes: impl Iterator<Item = &'s Stroke<AXES>>) -> Option<Self> {
        let last = strokes.next().filter(|stroke| !stroke.alone)?;
        let (mut newer, mut count) = (last, 1);
        let (mut length, mut sharpest_v2, mut top_v2) = (0.0, f32::INFINITY, last.top_v2);
        for stroke in strokes.take_while(|stroke| !stroke.alone) {
            length += 0.5 * (newer.length + stroke.length);
            sharpest_v2 = least(sharpest_v2, newer.corner_v2);
            top_v2 = most(top_v2, stroke.top_v2);
            newer = stroke;
            count += 1;
        }
        let (mut sum, mut change) = (last.direction, last.direction);
        for ((sum, change), first) in sum.iter_mut().zip(&mut change).zip(&newer.direction) {
            *sum += first;
            *change -= first;
        }
        (count > 1).then_some(Self {
            strokes: count,
            sum,
            change,
            length,
            sharpest_v2,
            top_v2,
        })
    }

    /// A corner within that is slower than the window by this share of the squared speed is a corner. On a circle in pieces
    /// corners are `12·d·R/l²` times as fast as the curve, 1.5 to 2.5 times with strokes of `√(2·t·R)`, but for rounding.
    /// Two strokes have but one turn between them.
    const fn corner_share(&self) -> f32 {
        if self.strokes > 2 {
            0.5
        } else {
            1.0
        }
    }

    /// The curve, and what it leaves to the moves; `None` where the curvature hardly matters.
    fn bend(&self, limits: &Limits<AXES>) -> Option<(Curve, Bend)> {
        let change2 = norm2(&self.change);
        let pull = self.top_v2 * limits.per_weakest;
        let straight = STRAIGHT * self.length;
        // Three points that are off by as much as rounding to decimals makes of them.
        let rounding = 4.0 * DECIMALS;
        if change2 * pull * pull <= straight * straight
            || change2 * self.length * self.length <= rounding * rounding
        {
            return None;
        }
        let (along, across) = (1.0 / sqrt(norm2(&self.sum)), 1.0 / sqrt(change2));
        let (along, across) = (self.sum.map(|x| x * along), self.change.map(|x| x * across));
        // The angle of which this is the chord, to its third power.
        let turn = sqrt(change2) * (1.0 + change2 / 24.0);
        let curve = Curve {
            radius: CERTAIN * self.length / turn,
            acceleration: 1.0 / sqrt(worst_of_plane(&along, &across, limits)),
        };
        let v2 = curve.top_v2();
        let mut bend = curve.bend(self.top_v2);
        let pull = least(v2, self.top_v2) / curve.radius;
        bend.ramps = most(
            bend.ramps,
            left_beside(pull, 0.5 * turn, &along, &across, limits),
        );
        Some((curve, bend))
    }
}

/// The largest `(u_i² + n_i²)/a_i²`: 1/a² with the acceleration `a` that all directions of the plane allow.
fn worst_of_plane<const AXES: usize>(
    along: &[f32; AXES],
    across: &[f32; AXES],
    limits: &Limits<AXES>,
) -> f32 {
    let ends = along.iter().zip(across).zip(&limits.per_acceleration);
    ends.fold(0.0, |worst, ((u, n), k)| {
        most(worst, (u * u + n * n) * k * k)
    })
}

/// The acceleration that is left along the path on each axis beside `pull` (mm/s²) across it: the smallest
/// `(a_i − pull·|n_i|)/|u_i|`, where both directions may be turned by `turn`.
fn left_beside<const AXES: usize>(
    pull: f32,
    turn: f32,
    along: &[f32; AXES],
    across: &[f32; AXES],
    limits: &Limits<AXES>,
) -> f32 {
    let axes = along.iter().zip(across).zip(&limits.per_acceleration);
    axes.fold(f32::INFINITY, |left, ((u, n), k)| {
        let (u, n) = (u.abs(), n.abs());
        let (u, n) = (u + turn * n, n + turn * u);
        // Of an axis that does not move, nothing is asked.
        least(left, (1.0 - pull * n * k) / most(u * k, f32::MIN_POSITIVE))
    })
}

/// How many of `lengths` begin within a way whose square is `way2`, mm².
fn within(way2: f32, lengths: impl Iterator<Item = f32>) -> usize {
    let mut way = 0.0;
    let near = lengths.take_while(|length| {
        let near = way * way <= way2;
        way += length;
        near
    });
    near.count()
}

fn dot<const N: usize>(a: &[f32; N], b: &[f32; N]) -> f32 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    #[test]
    fn a_stroke_may_have_more_moves_than_any_queue() {
        let limits = Limits::new(&Config::<2>::default());
        let piece = Piece {
            vector: [1e-4, 0.0],
            length2: 1e-8,
            top_v2: 1e9,
            is_chord: false,
        };
        let mut strokes = Strokes::new();
        for _ in 0..70_000 {
            assert!(!strokes.add(&piece, &limits));
        }
        assert!(strokes.complete(false, &limits).moves > 1024);
    }
}
