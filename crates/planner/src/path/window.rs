//! The last pieces of a path: a ring, in which places are found by their distance along the path.
//!
//! ```text
//!   o-----o---o--o---o-----o----o------o
//!    known pieces          ^ waiting pieces
//!                          the first one that waits: the turn at its start is asked for (see `turn`)
//! ```

use super::curvature::Search;
use super::turn::Turn;
use crate::config::Limits;
use crate::real::{least, norm2, sqrt};
use crate::{Coordinate, NANOS_PER_MM};
use heapless::Vec;

/// Pieces that are remembered: half of them behind the turn that is asked for, half ahead of it. One bit each of a `u32`.
const PIECES: usize = 32;

/// A length unit here is 2¹⁰ of a coordinate's, about a nanometre: differences of 32 bits reach two metres and cost no division.
const SHIFT: u32 = 10;
pub(super) const MM: f32 = (1 << SHIFT) as f32 / NANOS_PER_MM as f32;

/// A piece counts for no more than this along the path, mm, so that all of them fit into 32 bits.
const FARTHEST: f32 = 64.0;

/// A piece of path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece<const AXES: usize> {
    /// Unit vector. The steps of a piece give it, or its two ends where it has few steps.
    pub(crate) direction: [f32; AXES],
    /// Whether it has so few steps that these give no direction.
    pub(crate) is_short: bool,
    /// Highest squared speed, mm²/s².
    pub(crate) top_v2: f32,
    /// Whether it is a chord of an arc.
    pub(crate) is_chord: bool,
    /// How far its ends may be beside the places that were meant, on each axis, mm.
    pub(crate) rounding: f32,
}

/// A piece where it lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed<const AXES: usize> {
    pub(super) piece: Piece<AXES>,
    /// Where it begins, units, modulo 2³².
    start: [i32; AXES],
    /// Unit vector from there to its end.
    course: [f32; AXES],
    /// mm.
    pub(super) length: f32,
    /// How far along the path it begins, units, modulo 2³².
    since: u32,
}

/// The last pieces of a path.
#[derive(Clone, Debug)]
pub(crate) struct Window<const AXES: usize> {
    /// Piece `n` is at `n` modulo `PIECES`. Not an array: the compiler would write its first values one by one.
    placed: Vec<Placed<AXES>, PIECES>,
    /// Bit `n` modulo `PIECES`: piece `n` turns sharply away from the one before it.
    sharp: u32,
    /// Pieces so far, modulo 2³².
    count: u32,
    /// How many of the last ones are one path.
    known: u32,
    /// How many of the last ones wait until the turn at their start is known.
    waiting: u32,
    /// Where the last one ends, units.
    end: [i32; AXES],
    /// How far along the path that is, units, modulo 2³².
    until: u32,
    /// The turn that was settled last.
    pub(super) settled: Turn<AXES>,
    /// How far the search for the next turn has come.
    search: Search<AXES>,
}

impl<const AXES: usize> Window<AXES> {
    const NOWHERE: Placed<AXES> = Placed {
        piece: Piece {
            direction: [0.0; AXES],
            is_short: false,
            top_v2: 0.0,
            is_chord: false,
            rounding: 0.0,
        },
        start: [0; AXES],
        course: [0.0; AXES],
        length: 0.0,
        since: 0,
    };

    /// No path: the first piece begins at rest. All zero, so that a `static` costs no flash.
    pub(crate) const fn new() -> Self {
        const { assert!(PIECES == u32::BITS as usize) };
        Self {
            placed: Vec::new(),
            sharp: 0,
            count: 0,
            known: 0,
            waiting: 0,
            end: [0; AXES],
            until: 0,
            settled: Turn::REST,
            search: Search::NEW,
        }
    }

    /// The next piece begins at rest.
    pub(crate) fn forget(&mut self) {
        (self.known, self.waiting) = (0, 0);
        self.settled = Turn::REST;
        self.search = Search::NEW;
    }

    /// The next piece begins at rest, at `start`.
    pub(crate) fn begin(&mut self, start: &[Coordinate; AXES]) {
        self.forget();
        self.end = units(start);
    }

    /// Whether a path goes on.
    pub(crate) const fn goes_on(&self) -> bool {
        self.known > 0
    }

    /// How many pieces wait.
    pub(crate) const fn waiting(&self) -> usize {
        self.waiting as usize
    }

    /// Adds a piece that ends at `end`; it waits.
    pub(crate) fn push(&mut self, piece: Piece<AXES>, end: &[Coordinate; AXES]) {
        let (start, since) = (self.end, self.until);
        self.count = self.count.wrapping_add(1);
        self.known = (self.known + 1).min(PIECES as u32);
        self.waiting = (self.waiting + 1).min(PIECES as u32);
        self.place_last(piece, start, since, units(end));
    }

    /// The last piece ends at `end` instead, and is another one.
    pub(crate) fn replace_last(&mut self, piece: Piece<AXES>, end: &[Coordinate; AXES]) {
        let last = self.placed(self.count.wrapping_sub(1));
        let (start, since) = (last.start, last.since);
        self.search = Search::NEW;
        self.place_last(piece, start, since, units(end));
    }

    /// The last piece goes straight on, to `end`.
    pub(crate) fn lengthen_last(&mut self, end: &[Coordinate; AXES], is_short: bool) {
        let piece = Piece {
            is_short,
            ..self.placed(self.count.wrapping_sub(1)).piece
        };
        self.replace_last(piece, end);
    }

    fn place_last(
        &mut self,
        mut piece: Piece<AXES>,
        start: [i32; AXES],
        since: u32,
        end: [i32; AXES],
    ) {
        let way = between(&start, &end);
        let length = sqrt(norm2(&way));
        let per_length = 1.0 / length;
        let course = way.map(|way| way * per_length);
        if piece.is_short {
            piece.direction = course;
        }
        self.end = end;
        self.until = since.wrapping_add((least(length, FARTHEST) / MM) as u32);
        let last = self.count.wrapping_sub(1);
        let before = self.placed(last.wrapping_sub(1)).piece.direction;
        let sharp = self.known > 1 && is_sharp(&before, &piece.direction);
        let bit = 1 << (last % PIECES as u32);
        self.sharp = (self.sharp & !bit) | (bit * u32::from(sharp));
        let placed = Placed {
            piece,
            start,
            course,
            length,
            since,
        };
        match self.placed.get_mut(last as usize % PIECES) {
            Some(place) => *place = placed,
            // There is room for `PIECES`.
            None => drop(self.placed.push(placed)),
        }
    }

    pub(super) fn placed(&self, number: u32) -> &Placed<AXES> {
        self.placed
            .get(number as usize % PIECES)
            .unwrap_or(&Self::NOWHERE)
    }

    /// Takes out the first piece that waits, with the turn at its start: once that is known, or `now`, as well as it is known.
    pub(crate) fn settle(&mut self, limits: &Limits<AXES>, now: bool) -> Option<Turn<AXES>> {
        let number = self.count.wrapping_sub(self.waiting);
        if self.waiting == 0 {
            return None;
        }
        let now = now || self.waiting as usize >= PIECES / 2;
        // A short one may become longer yet.
        if !now && self.waiting == 1 && self.placed(number).piece.is_short {
            return None;
        }
        let turn = if self.waiting >= self.known {
            Turn::REST
        } else {
            let mut search = self.search;
            let turn = self.turn(number, limits, now, &mut search);
            self.search = search;
            turn?
        };
        self.waiting -= 1;
        self.search = Search::NEW;
        self.settled = turn;
        Some(turn)
    }

    /// The turn at the start of the piece that waits as the `waiting`-th behind the first one, as well as it is known.
    pub(crate) fn guess(&self, waiting: u32, limits: &Limits<AXES>) -> Option<Turn<AXES>> {
        let behind = self.waiting.checked_sub(waiting)?;
        if behind >= self.known {
            return None;
        }
        let number = self.count.wrapping_sub(behind);
        let mut search = Search::NEW;
        self.turn(number, limits, true, &mut search)
    }

    /// Whether the piece turns sharply away from the one before it.
    pub(super) const fn is_sharp(&self, number: u32) -> bool {
        self.sharp & (1 << (number % PIECES as u32)) != 0
    }

    /// The length of a piece, mm; 0 where it is not known.
    pub(super) fn length_of(&self, number: u32) -> f32 {
        let behind = self.count.wrapping_sub(number).wrapping_sub(1);
        if behind < self.known {
            self.placed(number).length
        } else {
            0.0
        }
    }

    /// Whether the piece is the last one.
    pub(super) const fn is_last(&self, number: u32) -> bool {
        number.wrapping_add(1) == self.count
    }

    /// The path ahead of the start of a piece, to the next sharp turn or to the path's end: its length, mm, and whether its end may move on.
    pub(super) fn room_ahead(&self, number: u32) -> (f32, bool) {
        let next = number.wrapping_add(1);
        let smooth = self.sharp.rotate_right(next % PIECES as u32);
        let sharp = next.wrapping_add(smooth.trailing_zeros());
        let to_end = self.count.wrapping_sub(number);
        let is_open = sharp.wrapping_sub(number) >= to_end;
        let until = if is_open {
            self.until
        } else {
            self.placed(sharp).since
        };
        (distance(self.placed(number).since, until), is_open)
    }

    /// The path behind the start of a piece, back to a sharp turn or to the first piece that is known, mm.
    pub(super) fn room_behind(&self, number: u32) -> f32 {
        let before = number.wrapping_sub(1);
        let smooth = self.sharp.rotate_left(31 - before % PIECES as u32);
        let first = self.count.wrapping_sub(self.known);
        let most = before.wrapping_sub(first);
        let back = smooth.leading_zeros().min(most);
        let begin = self.placed(before.wrapping_sub(back)).since;
        distance(begin, self.placed(number).since)
    }

    /// The whole path ahead of the start of a piece, through sharp turns, mm.
    pub(super) fn all_ahead(&self, number: u32) -> f32 {
        distance(self.placed(number).since, self.until)
    }

    /// The whole path behind the start of a piece, mm.
    pub(super) fn all_behind(&self, number: u32) -> f32 {
        let first = self.placed(self.count.wrapping_sub(self.known));
        distance(first.since, self.placed(number).since)
    }

    /// The way from the start of a piece to the place that far along the path, mm; there is as much path.
    pub(super) fn ahead(&self, number: u32, length: f32) -> [f32; AXES] {
        let from = self.placed(number);
        let away = (length / MM) as u32;
        let to = self.last_from(number, self.count.wrapping_sub(number), |placed| {
            placed.since.wrapping_sub(from.since) <= away
        });
        let placed = self.placed(to);
        let passed = distance(from.since, placed.since);
        placed.beside(&from.start, &placed.start, length - passed)
    }

    /// The way from the start of a piece back to the place that far along the path, mm; there is as much path.
    pub(super) fn behind(&self, number: u32, length: f32) -> [f32; AXES] {
        let from = self.placed(number);
        let away = (length / MM) as u32;
        let known = self.known - self.count.wrapping_sub(number);
        let first = number.wrapping_sub(known);
        let at = self.last_from(first, known, |placed| {
            from.since.wrapping_sub(placed.since) >= away
        });
        let placed = self.placed(at);
        let end = self.placed(at.wrapping_add(1));
        let passed = distance(end.since, from.since);
        placed.beside(&from.start, &end.start, passed - length)
    }

    /// The last of `count` pieces from `first` on that `is_before` the place wanted; the first where none is.
    fn last_from(&self, first: u32, count: u32, is_before: impl Fn(&Placed<AXES>) -> bool) -> u32 {
        let (mut low, mut high) = (0, count);
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if is_before(self.placed(first.wrapping_add(middle))) {
                low = middle;
            } else {
                high = middle;
            }
        }
        first.wrapping_add(low)
    }
}

impl<const AXES: usize> Placed<AXES> {
    /// So far along its course, mm.
    pub(super) fn along(&self, length: f32) -> [f32; AXES] {
        self.course.map(|course| course * length)
    }

    /// The place `length` mm ahead of one of its ends, seen from `origin`, mm.
    fn beside(&self, origin: &[i32; AXES], end: &[i32; AXES], length: f32) -> [f32; AXES] {
        let mut point = between(origin, end);
        for (point, course) in point.iter_mut().zip(&self.course) {
            *point += course * length;
        }
        point
    }
}

/// Whether a turn is no part of a smooth curve: 22 degrees or more.
fn is_sharp<const AXES: usize>(from: &[f32; AXES], to: &[f32; AXES]) -> bool {
    const SHARP2: f32 = 0.15;
    let change2 = from
        .iter()
        .zip(to)
        .fold(0.0, |sum, (from, to)| sum + (to - from) * (to - from));
    change2 > SHARP2
}

/// From one place along the path to a later one, mm.
fn distance(from: u32, to: u32) -> f32 {
    to.wrapping_sub(from) as f32 * MM
}

fn between<const AXES: usize>(from: &[i32; AXES], to: &[i32; AXES]) -> [f32; AXES] {
    let mut way = [0.0; AXES];
    for (way, (from, to)) in way.iter_mut().zip(from.iter().zip(to)) {
        *way = to.wrapping_sub(*from) as f32 * MM;
    }
    way
}

fn units<const AXES: usize>(place: &[Coordinate; AXES]) -> [i32; AXES] {
    place.map(|at| (at.nanos() >> SHIFT) as i32)
}
