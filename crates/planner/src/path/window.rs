//! The last pieces of a path, in a ring. Places are found by their distance along the path.
//!
//! ```text
//!   o-----o---o--o---o-----o----o------o
//!    known pieces          ^ waiting pieces
//!                          the first one that waits: the turn at its start is asked for
//! ```
//!
//! `turn` finds the turns between the pieces.

use super::probe::Probe;
use crate::built::CURVES;
use crate::real::{min, norm2, sqrt};
use crate::{Coordinate, NANOS_PER_MM};

/// The number of pieces that are remembered: half of them before the turn that is asked for, half
/// after it. A `u32` has a bit for each piece.
pub(crate) const PIECES: u32 = u32::BITS;

/// The number of pieces that a window has room for. Without curves nobody asks for one.
const ROOM: usize = if CURVES { PIECES as usize } else { 0 };

/// A unit of length in this module is 2¹⁰ units of a coordinate, about a nanometre. Differences of
/// 32 bits reach two metres, and a shift is cheaper than a division.
const SHIFT: u32 = 10;
pub(super) const MM: f32 = (1 << SHIFT) as f32 / NANOS_PER_MM as f32;
const PER_MM: f32 = 1.0 / MM;

/// Longer pieces count as this length, mm, so that the sum of all pieces fits into 32 bits.
const FARTHEST: f32 = 64.0;

/// A turn by more than 22 degrees is no part of a smooth curve. This is the square of the distance
/// between the two unit vectors.
pub(super) const SHARP2: f32 = 0.15;

/// A turn by less than this goes straight on, because unit vectors have no more digits: the square
/// of the distance between the two unit vectors.
const STRAIGHT2: f32 = 1e-12;

/// A piece of path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece<const AXES: usize> {
    /// Direction, a unit vector: by the steps of the piece, or by its two ends if it has few
    /// steps.
    pub(crate) direction: [f32; AXES],
    /// 1/(highest squared speed), s²/mm².
    pub(crate) per_top_v2: f32,
    /// The distance by which rounding may have moved its ends on each axis, mm.
    pub(crate) rounding: f32,
}

/// A piece and its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed<const AXES: usize> {
    pub(super) piece: Piece<AXES>,
    /// Unit vector from its start to its end.
    pub(super) course: [f32; AXES],
    /// From its start to its end, mm.
    pub(super) length: f32,
    /// Its start, units, modulo 2³².
    start: [i32; AXES],
    /// The length of the path up to its start, units, modulo 2³².
    since: u32,
}

impl<const AXES: usize> Placed<AXES> {
    /// Returns how far a point of this piece, `way` units after its start, lies inside the curve
    /// that the piece is a chord of, if the curvature is 2: in square units. 0 if the piece is
    /// longer than `chord` mm.
    fn inside(&self, way: f32, chord: f32) -> f32 {
        if self.length <= chord {
            way * (self.length * PER_MM - way)
        } else {
            0.0
        }
    }
}

/// One bit for each piece: piece `n` has bit `n` modulo [`PIECES`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Bits(u32);

impl Bits {
    /// Sets the bit of piece `number`.
    fn set(&mut self, number: u32, value: bool) {
        let bit = 1 << (number % PIECES);
        self.0 = (self.0 & !bit) | (bit * u32::from(value));
    }

    /// Returns true if the bit of piece `number` is set.
    pub(super) const fn has(self, number: u32) -> bool {
        self.0 & (1 << (number % PIECES)) != 0
    }
}

/// The last pieces of a path. Piece `n` is at `n` modulo [`PIECES`]. The entry after the last piece
/// holds the path's end.
#[derive(Clone, Debug)]
pub(crate) struct Window<const AXES: usize> {
    placed: [Placed<AXES>; ROOM],
    /// The pieces that turn sharply away from the one before them.
    sharp: Bits,
    /// The last piece that turns sharply away from the one before it; the first piece of the path
    /// if none does.
    last_sharp: u32,
    /// The pieces that go straight on from the one before them.
    straight: Bits,
    /// The pieces that are chords of an arc.
    pub(super) chords: Bits,
    /// The pieces that have too few steps to give a direction.
    pub(super) short: Bits,
    /// The pieces that were joined from several that do not go straight on.
    pub(super) bent: Bits,
    /// Pieces so far, modulo 2³².
    pub(super) count: u32,
    /// The number of the last pieces that belong to the path.
    pub(super) known: u32,
    /// The number of the last pieces that wait until the turn at their start is known.
    pub(super) waiting: u32,
    /// The measurement of the last turn.
    pub(super) probe: Probe<AXES>,
}

impl<const AXES: usize> Window<AXES> {
    const NOWHERE: Placed<AXES> = Placed {
        piece: Piece {
            direction: [0.0; AXES],
            per_top_v2: 0.0,
            rounding: 0.0,
        },
        course: [0.0; AXES],
        length: 0.0,
        start: [0; AXES],
        since: 0,
    };

    /// No path: the first piece begins at rest. All zero, so that a `static` takes no flash.
    pub(crate) const fn new() -> Self {
        Self {
            placed: [Self::NOWHERE; ROOM],
            sharp: Bits(0),
            last_sharp: 0,
            straight: Bits(0),
            chords: Bits(0),
            short: Bits(0),
            bent: Bits(0),
            count: 0,
            known: 0,
            waiting: 0,
            probe: Probe::NEW,
        }
    }

    /// Forgets the path: the next piece begins at rest.
    pub(crate) fn forget(&mut self) {
        (self.known, self.waiting) = (0, 0);
        self.probe = Probe::NEW;
    }

    /// Makes the next piece begin at rest, at `start`.
    pub(crate) fn begin(&mut self, start: &[Coordinate; AXES]) {
        self.forget();
        self.place(self.count).start = units(start);
    }

    /// Returns true if the next piece continues a path.
    pub(crate) const fn goes_on(&self) -> bool {
        self.known > 0
    }

    /// Returns how many pieces wait.
    pub(crate) const fn waiting(&self) -> usize {
        self.waiting as usize
    }

    /// Returns true if the first piece that waits turns sharply away from the one before it.
    pub(crate) const fn waits_at_corner(&self) -> bool {
        self.waiting > 0 && self.is_sharp(self.count.wrapping_sub(self.waiting))
    }

    /// Adds a piece that ends at `end`; it waits.
    pub(crate) fn push(
        &mut self,
        piece: &Piece<AXES>,
        is_short: bool,
        is_chord: bool,
        end: &[Coordinate; AXES],
    ) {
        self.chords.set(self.count, is_chord);
        self.bent.set(self.count, false);
        self.count = self.count.wrapping_add(1);
        self.known = (self.known + 1).min(PIECES - 1);
        self.waiting = (self.waiting + 1).min(PIECES - 1);
        self.replace_last(piece, is_short, end);
    }

    /// Puts a piece that ends at `end` in the place of the last one.
    fn replace_last(&mut self, piece: &Piece<AXES>, is_short: bool, end: &[Coordinate; AXES]) {
        let (last, end) = (self.count.wrapping_sub(1), units(end));
        let way = between(&self.placed(last).start, &end);
        let length = sqrt(norm2(&way));
        let per_length = 1.0 / length;
        let placed = self.place(last);
        placed.piece = *piece;
        placed.course = way.map(|way| way * per_length);
        placed.length = length;
        if is_short {
            placed.piece.direction = placed.course;
        }
        let course = placed.course;
        let until = placed
            .since
            .wrapping_add((min(length, FARTHEST) * PER_MM) as u32);
        let change2 = distance2(&self.placed(last.wrapping_sub(1)).course, &course);
        let sharp = self.known <= 1 || change2 > SHARP2;
        self.sharp.set(last, sharp);
        if sharp {
            self.last_sharp = last;
        }
        self.straight.set(last, change2 < STRAIGHT2);
        self.short.set(last, is_short);
        let next = self.place(self.count);
        (next.start, next.since) = (end, until);
    }

    /// Joins one more piece, which ends at `end`, with the last one. `piece` stands for both of
    /// them; `is_bent` tells whether they turn.
    pub(crate) fn join_last(
        &mut self,
        piece: &Piece<AXES>,
        is_short: bool,
        is_bent: bool,
        end: &[Coordinate; AXES],
    ) {
        self.bent.set(self.count.wrapping_sub(1), is_bent);
        self.replace_last(piece, is_short, end);
    }

    /// The vector from the start of the last piece to its end, mm.
    pub(crate) fn last_way(&self) -> [f32; AXES] {
        let last = self.placed(self.count.wrapping_sub(1));
        last.course.map(|course| course * last.length)
    }

    /// The vector from the end of the last piece to `end`, mm.
    pub(crate) fn way_on(&self, end: &[Coordinate; AXES]) -> [f32; AXES] {
        between(&self.placed(self.count).start, &units(end))
    }

    /// Lengthens the last piece: it goes straight on, to `end`.
    pub(crate) fn lengthen_last(&mut self, is_short: bool, end: &[Coordinate; AXES]) {
        let piece = self.placed(self.count.wrapping_sub(1)).piece;
        self.replace_last(&piece, is_short, end);
    }

    /// A piece, or the path's end. The number is one of the last [`PIECES`].
    pub(super) const fn placed(&self, number: u32) -> &Placed<AXES> {
        &self.placed[(number % PIECES) as usize]
    }

    /// The same, to be changed.
    fn place(&mut self, number: u32) -> &mut Placed<AXES> {
        &mut self.placed[(number % PIECES) as usize]
    }

    /// Returns true if the path was straight at the last turn and does not turn at the start of
    /// this piece either.
    pub(super) fn goes_straight_on(&self, number: u32) -> bool {
        !self.probe.is_curved && self.straight.has(number)
    }

    /// Returns true if the piece turns sharply away from the one before it.
    pub(super) const fn is_sharp(&self, number: u32) -> bool {
        self.sharp.has(number)
    }

    /// Returns true if the piece and the one before it are chords of arcs.
    pub(super) const fn are_chords(&self, number: u32) -> bool {
        self.chords.has(number) && self.chords.has(number.wrapping_sub(1))
    }

    /// Returns true if the piece is the last one.
    pub(super) const fn is_last(&self, number: u32) -> bool {
        number.wrapping_add(1) == self.count
    }

    /// Returns true if no turn after the start of a piece is sharp, so that the smooth path ahead
    /// may still grow.
    pub(super) const fn is_open(&self, number: u32) -> bool {
        self.count.wrapping_sub(self.last_sharp) >= self.from(number)
    }

    /// The length of the path from the start of a piece to the next sharp turn or to the end of the
    /// path, mm.
    pub(super) fn room_ahead(&self, number: u32) -> f32 {
        let smooth = self.sharp.0.rotate_right(number.wrapping_add(1) % PIECES);
        let to_sharp = smooth.trailing_zeros() + 1;
        let until = number.wrapping_add(to_sharp.min(self.from(number)));
        self.way(number, until)
    }

    /// The length of the path from the last sharp turn, or from the first known piece, to the start
    /// of a piece, mm.
    pub(super) fn room_behind(&self, number: u32) -> f32 {
        let smooth = self.sharp.0.rotate_right(number % PIECES);
        let back = smooth.leading_zeros() + 1;
        self.way(number.wrapping_sub(back.min(self.before(number))), number)
    }

    /// Returns how many known pieces there are before a piece.
    pub(super) const fn before(&self, number: u32) -> u32 {
        self.known - self.count.wrapping_sub(number)
    }

    /// Returns how many pieces there are from a piece to the last one, both included.
    pub(super) const fn from(&self, number: u32) -> u32 {
        self.count.wrapping_sub(number)
    }

    /// The length of the path from the start of one piece to the start of a later one, mm.
    pub(super) fn way(&self, from: u32, to: u32) -> f32 {
        let (from, to) = (self.placed(from).since, self.placed(to).since);
        to.wrapping_sub(from) as f32 * MM
    }

    /// Looks at two points of the path: `length` ahead of the start of a piece, and `length` back
    /// from it. Returns the sum of the vectors from that start to both points, mm, and an area,
    /// mm². The sum divided by the area is the curvature. Pieces up to the length `chord` (mm) are
    /// taken for chords of a curve; with 0 none are.
    ///
    /// The caller has checked that the path is that long to both sides. The search begins at
    /// `pieces`, the numbers of pieces passed the last time, ahead and back, and puts the new
    /// numbers there.
    pub(super) fn aside(
        &self,
        number: u32,
        length: f32,
        chord: f32,
        pieces: &mut [u32; 2],
    ) -> ([f32; AXES], f32) {
        let away = (length * PER_MM) as u32;
        let from = self.placed(number);
        let on = |pieces| self.placed(number.wrapping_add(pieces));
        let back = |pieces| self.placed(number.wrapping_sub(pieces));
        let [ahead, behind] = pieces;
        let passed = |pieces| on(pieces).since.wrapping_sub(from.since);
        *ahead = find(*ahead, self.from(number) - 1, |pieces| {
            passed(pieces) <= away
        });
        let rest_ahead = (away - passed(*ahead)) as f32;
        let passed = |pieces| from.since.wrapping_sub(back(pieces).since);
        *behind = find(*behind, self.before(number) - 1, |pieces| {
            passed(pieces) <= away
        });
        let rest_behind = (away - passed(*behind)) as f32;
        let (last, first, around) = (on(*ahead), back(*behind), back(*behind + 1));
        let inside = last.inside(rest_ahead, chord) + around.inside(rest_behind, chord);
        let (mut aside, mut ahead2, mut behind2) = ([0.0; AXES], 0.0, 0.0);
        for (axis, aside) in aside.iter_mut().enumerate() {
            let from = from.start[axis];
            let way = |to: i32| to.wrapping_sub(from) as f32;
            let ahead = way(last.start[axis]) + last.course[axis] * rest_ahead;
            let behind = way(first.start[axis]) - around.course[axis] * rest_behind;
            *aside = (ahead + behind) * MM;
            ahead2 += ahead * ahead;
            behind2 += behind * behind;
        }
        (aside, (sqrt(ahead2 * behind2) + 0.5 * inside) * (MM * MM))
    }
}

/// The greatest number from 1 to `most` that is `within`; 0 if none is. The search begins at
/// `guess`. Below a number that is `within`, all numbers must be `within`.
fn find(guess: u32, most: u32, within: impl Fn(u32) -> bool) -> u32 {
    let mut found = guess.min(most);
    while found > 0 && !within(found) {
        found -= 1;
    }
    while found < most && within(found + 1) {
        found += 1;
    }
    found
}

/// The square of the distance between two points.
fn distance2<const AXES: usize>(from: &[f32; AXES], to: &[f32; AXES]) -> f32 {
    let axes = from.iter().zip(to);
    axes.fold(0.0, |sum, (from, to)| sum + (to - from) * (to - from))
}

/// The vector from one place to another, mm.
fn between<const AXES: usize>(from: &[i32; AXES], to: &[i32; AXES]) -> [f32; AXES] {
    let mut way = [0.0; AXES];
    for (way, (from, to)) in way.iter_mut().zip(from.iter().zip(to)) {
        *way = to.wrapping_sub(*from) as f32 * MM;
    }
    way
}

/// A place in units of this module, modulo 2³².
fn units<const AXES: usize>(place: &[Coordinate; AXES]) -> [i32; AXES] {
    place.map(|at| (at.nanos() >> SHIFT) as i32)
}
