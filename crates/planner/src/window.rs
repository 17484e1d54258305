//! How sharply a path of short pieces turns: at each place where two of them meet, once the path around it is known.
//!
//! ```text
//!             P(s)               The curvature at a place s of the path, over the length h to both sides, is its second difference
//!        _--o------o__
//!     o--             --o              k = (P(s+h) − 2·P(s) + P(s−h)) / h²
//!   P(s−h)             P(s+h)
//! ```
//!
//! Coordinates are rounded to a few decimals, each point by up to `e`, which makes an error of `4·e/h²`. So `h` is as long as the shorter
//! of the two pieces, and longer where the error would cost more than [`QUIET`] of the speed:
//!
//! ```text
//!   4·e/h² ≤ QUIET · max(|k|, a/x)      x: the highest squared speed that the pieces may have
//! ```
//!
//! What is smoothed away by that bends the path by no more than rounding does. Each corner is asked besides (see `corner`), unless
//! the smooth path explains it: where the points need to be off by no more than rounding makes them.

use crate::config::Limits;
use crate::junction::junction_v2;
use crate::polygon::cap;
use crate::real::{least, most, norm2, sqrt};
use crate::{Coordinate, NANOS_PER_MM};
use heapless::Vec;

/// Points that are remembered: half of them behind the one that is asked for, half before it.
pub(crate) const POINTS: usize = 32;

/// Share of the acceleration, or of the curvature, that rounding may make up.
const QUIET: f32 = 0.01;

/// Lengths are whole 2¹⁰ nm·10⁻³ here: differences of 32 bits reach two metres, and cost no division.
const SHIFT: u32 = 10;
const MM: f32 = (1 << SHIFT) as f32 / NANOS_PER_MM as f32;

/// Four points of which each is off by so much, mm.
const FINEST: f32 = 4.0 * MM;

/// A piece of path, as far as it matters here.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece<const AXES: usize> {
    /// Unit vector, by the steps that are made of it.
    pub(crate) direction: [f32; AXES],
    /// Whether it is so short that these say little.
    pub(crate) is_short: bool,
    /// Highest squared speed, mm²/s².
    pub(crate) top_v2: f32,
    /// Whether it is a chord of an arc.
    pub(crate) is_chord: bool,
    /// How far its ends may be beside the places that were meant, on each axis, mm.
    pub(crate) rounding: f32,
}

/// A piece and where it lies, as it was asked for.
#[derive(Clone, Copy, Debug)]
struct Placed<const AXES: usize> {
    piece: Piece<AXES>,
    /// Where it begins, units of `MM`, modulo 2³².
    start: [i32; AXES],
    /// From there to its end, mm.
    way: [f32; AXES],
    length: f32,
    /// Whether it turns sharply away from the one before it.
    is_sharp: bool,
}

/// How a path turns where two pieces meet.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Turn<const AXES: usize> {
    /// Curvature by accelerations, s²/mm².
    pub(crate) bend: [f32; AXES],
    /// How far it reaches to both sides, mm.
    pub(crate) reach: f32,
    /// Highest squared speed, mm²/s².
    pub(crate) v2: f32,
}

/// The last pieces of a path.
#[derive(Clone, Debug)]
pub(crate) struct Window<const AXES: usize> {
    /// Piece `n` is at `n` modulo `POINTS`. No array: its first values would be written one by one, by 40 KB of code.
    placed: Vec<Placed<AXES>, POINTS>,
    /// Pieces so far, modulo 2³².
    count: u32,
    /// How many of the last ones are one path.
    known: u32,
    /// How many of the last ones wait for what follows.
    waiting: u32,
    /// Where the last one ends, units of `MM`.
    end: [i32; AXES],
}

impl<const AXES: usize> Window<AXES> {
    /// What stands where no piece is.
    const NOWHERE: Placed<AXES> = Placed {
        piece: Piece {
            direction: [0.0; AXES],
            is_short: false,
            top_v2: 0.0,
            is_chord: false,
            rounding: 0.0,
        },
        start: [0; AXES],
        way: [0.0; AXES],
        length: 0.0,
        is_sharp: false,
    };

    /// No path: the first piece begins at rest.
    pub(crate) const fn new() -> Self {
        const { assert!(POINTS.is_power_of_two()) };
        Self {
            placed: Vec::new(),
            count: 0,
            known: 0,
            waiting: 0,
            end: [0; AXES],
        }
    }

    /// What comes next begins at rest.
    pub(crate) fn forget(&mut self) {
        (self.known, self.waiting) = (0, 0);
    }

    /// The next piece begins at rest, at `start`.
    pub(crate) fn begin(&mut self, start: &[Coordinate; AXES]) {
        self.known = 0;
        self.waiting = 0;
        self.end = units(start);
    }

    /// Whether a path goes on.
    pub(crate) const fn goes_on(&self) -> bool {
        self.known > 0
    }

    /// How many pieces wait for what follows.
    pub(crate) const fn waiting(&self) -> usize {
        self.waiting as usize
    }

    /// Adds a piece that ends at `end`; it waits.
    pub(crate) fn push(&mut self, piece: Piece<AXES>, end: &[Coordinate; AXES]) {
        let start = self.end;
        self.count = self.count.wrapping_add(1);
        self.known = (self.known + 1).min(POINTS as u32);
        self.waiting = (self.waiting + 1).min(POINTS as u32);
        self.end = units(end);
        self.place_last(piece, start);
    }

    /// The last piece ends at `end` instead, and is another one.
    pub(crate) fn replace_last(&mut self, piece: Piece<AXES>, end: &[Coordinate; AXES]) {
        let start = self.placed(self.count.wrapping_sub(1)).start;
        self.end = units(end);
        self.place_last(piece, start);
    }

    /// The last piece goes straight on, to `end`.
    pub(crate) fn lengthen_last(&mut self, end: &[Coordinate; AXES], is_short: bool) {
        let last = *self.placed(self.count.wrapping_sub(1));
        let piece = Piece {
            is_short,
            ..last.piece
        };
        self.replace_last(piece, end);
    }

    fn place_last(&mut self, piece: Piece<AXES>, start: [i32; AXES]) {
        let way = between(&start, &self.end);
        let length = sqrt(norm2(&way));
        let index = self.count.wrapping_sub(1) as usize % POINTS;
        let mut last = Placed {
            piece,
            start,
            way,
            length,
            is_sharp: false,
        };
        if self.known > 1 {
            let before = self.placed(self.count.wrapping_sub(2));
            last.is_sharp = is_sharp(&before.direction(), &last.direction());
        }
        match self.placed.get_mut(index) {
            Some(place) => *place = last,
            // There is room for `POINTS`.
            None => drop(self.placed.push(last)),
        }
    }

    fn placed(&self, number: u32) -> &Placed<AXES> {
        self.placed
            .get(number as usize % POINTS)
            .unwrap_or(&Self::NOWHERE)
    }

    /// Takes out the first piece that waits, with the turn at its start, where that is known: or, `now`, as well as it is known.
    pub(crate) fn settle(&mut self, limits: &Limits<AXES>, now: bool) -> Option<Turn<AXES>> {
        let number = self.count.wrapping_sub(self.waiting);
        if self.waiting == 0 {
            return None;
        }
        let now = now || self.waiting as usize >= POINTS / 2;
        // It may become longer yet.
        if !now && self.waiting == 1 && self.placed(number).piece.is_short {
            return None;
        }
        let turn = if self.waiting >= self.known {
            Turn {
                bend: [0.0; AXES],
                reach: 0.0,
                v2: 0.0,
            }
        } else {
            self.turn(number, limits, now)?
        };
        self.waiting -= 1;
        Some(turn)
    }

    /// The turn at the start of a piece that waits, the first one or one so many behind it, as well as it is known.
    pub(crate) fn guess(&self, waiting: u32, limits: &Limits<AXES>) -> Option<Turn<AXES>> {
        let behind = self.waiting.checked_sub(waiting)?;
        if behind >= self.known {
            return None;
        }
        self.turn(self.count.wrapping_sub(behind), limits, true)
    }

    /// The turn at the start of a piece; `None` where the path has to go on for that, and not `now`.
    fn turn(&self, number: u32, limits: &Limits<AXES>, now: bool) -> Option<Turn<AXES>> {
        let [before, after] = [number.wrapping_sub(1), number].map(|at| *self.placed(at));
        let shorter = most(least(before.length, after.length), f32::MIN_POSITIVE);
        let [u0, u1] = [&before, &after].map(Placed::direction);
        if after.is_sharp {
            let corner = junction_v2(&u0, &u1, limits);
            let (ahead, behind) = (u1.map(|u| u * shorter), u0.map(|u| -u * shorter));
            let (bend, _) = curvature(&ahead, &behind, limits);
            let v2 = if corner < cap(&bend) {
                corner
            } else {
                least(corner, cap(&self.between_corners(number, limits, now)?))
            };
            // The jump of speed is in what `$11` allows; nothing of the acceleration goes into it.
            return Some(Turn {
                bend: [0.0; AXES],
                reach: 0.0,
                v2,
            });
        }
        let (bend, reach) = self.on_a_curve(number, shorter, limits, now)?;
        let corner = if self.explains(&before, &after, &bend, limits) {
            f32::INFINITY
        } else {
            junction_v2(&u0, &u1, limits)
        };
        Some(Turn {
            v2: least(corner, cap(&bend)),
            reach,
            bend,
        })
    }

    /// The curvature about a sharp turn between short pieces, over two of them to both sides: turns to and fro cancel.
    fn between_corners(
        &self,
        number: u32,
        limits: &Limits<AXES>,
        now: bool,
    ) -> Option<[f32; AXES]> {
        let second = number.wrapping_add(1);
        if second == self.count && !now {
            return None;
        }
        let both = |one: u32, other: u32| self.placed(one).length + self.placed(other).length;
        let [before, after] = [
            both(number.wrapping_sub(1), number.wrapping_sub(2)),
            both(number, second),
        ];
        let wanted = least(before, after);
        let length = least(
            self.forward(number, wanted, true).1,
            self.backward(number, wanted, true).1,
        );
        let ahead = self.forward(number, length, true).0;
        let behind = self.backward(number, length, true).0;
        let (bend, _) = curvature(&ahead, &behind, limits);
        Some(bend)
    }

    /// The curvature of a curve, over as much of it as rounding needs.
    fn on_a_curve(
        &self,
        number: u32,
        shorter: f32,
        limits: &Limits<AXES>,
        now: bool,
    ) -> Option<([f32; AXES], f32)> {
        let [before, after] = [number.wrapping_sub(1), number].map(|at| self.placed(at));
        let top_v2 = least(before.piece.top_v2, after.piece.top_v2);
        let rounding = most(before.piece.rounding, after.piece.rounding);
        let longer = most(before.length, after.length);
        let uneven2 = longer * longer - shorter * shorter;
        let mut length = shorter;
        let mut range = Range::ANY;
        loop {
            let (ahead, reached) = self.forward(number, length, false);
            if reached < length && !now && self.is_open(number) {
                return None;
            }
            let (behind, since) = self.backward(number, length, false);
            let path = least(reached, since);
            let (curved, noisy) = if path < length {
                let ahead = self.forward(number, path, false).0;
                let behind = self.backward(number, path, false).0;
                curvature(&ahead, &behind, limits)
            } else {
                curvature(&ahead, &behind, limits)
            };
            let path = least(path, length);
            let rounded = rounding / (path * path);
            range = range.within(&curved, rounded, uneven2 / (path * path), limits);
            if path < length && !(reached < length && self.is_open(number)) {
                // Near a rest or a sharp turn: what is slow there needs no more than the straightest path.
                return Some((range.nearest(&[0.0; AXES]), path));
            }
            let bend = range.nearest(&curved);
            let quiet = QUIET * most(1.0 / cap(&bend), 1.0 / top_v2);
            let longer2 = 4.0 * rounded * noisy / quiet;
            if longer2 <= NEAR_ENOUGH || path < length || length >= LONGEST * shorter {
                return Some((bend, path));
            }
            length *= least(sqrt(longer2), 2.0);
        }
    }

    /// Whether no sharp turn ends the path behind a piece.
    fn is_open(&self, number: u32) -> bool {
        let mut number = number.wrapping_add(1);
        while number != self.count {
            if self.placed(number).is_sharp {
                return false;
            }
            number = number.wrapping_add(1);
        }
        true
    }

    /// Whether the smooth path explains a turn: rounding may have made what is left of it.
    fn explains(
        &self,
        before: &Placed<AXES>,
        after: &Placed<AXES>,
        bend: &[f32; AXES],
        limits: &Limits<AXES>,
    ) -> bool {
        if before.piece.is_chord && after.piece.is_chord {
            return true;
        }
        let [from, to] = [before, after].map(Placed::direction);
        let all = before.length + after.length;
        let share = before.length * after.length / all;
        let mut axes = from.iter().zip(&to).zip(bend).zip(&limits.rounding);
        axes.all(|(((from, to), bend), (per_acceleration, rounding))| {
            let curved = 0.5 * all * bend / per_acceleration;
            (to - from - curved).abs() * share <= 2.0 * rounding
        })
    }

    /// From the start of a piece so many mm along the path, and how many there are: up to a sharp turn, or `through` it.
    fn forward(&self, number: u32, length: f32, through: bool) -> ([f32; AXES], f32) {
        let (mut number, mut passed) = (number, 0.0);
        let from = self.placed(number).start;
        loop {
            let placed = self.placed(number);
            let rest = length - passed;
            if rest <= placed.length {
                return (placed.beside(&from, &placed.start, rest), length);
            }
            passed += placed.length;
            number = number.wrapping_add(1);
            if number == self.count {
                return (between(&from, &self.end), passed);
            }
            let next = self.placed(number);
            if next.is_sharp && !through {
                return (between(&from, &next.start), passed);
            }
        }
    }

    /// From the start of a piece so many mm back along the path, and how many there are.
    fn backward(&self, number: u32, length: f32, through: bool) -> ([f32; AXES], f32) {
        let first = self.count.wrapping_sub(self.known);
        let (mut before, mut passed) = (number, 0.0);
        let from = self.placed(number).start;
        while before != first {
            let end = self.placed(before).start;
            before = before.wrapping_sub(1);
            let placed = self.placed(before);
            let rest = length - passed;
            if rest <= placed.length {
                return (placed.beside(&from, &end, -rest), length);
            }
            passed += placed.length;
            if placed.is_sharp && !through {
                break;
            }
        }
        (between(&from, &self.placed(before).start), passed)
    }
}

/// So much more than the length squared a window may need.
const NEAR_ENOUGH: f32 = 1.1;

/// A window is so many times as long as the shorter of the two pieces at most.
const LONGEST: f32 = 32.0;

/// Between which values the curvature lies, by accelerations, so that at each length tried the path is explained by it and by rounding.
struct Range<const AXES: usize>([[f32; 2]; AXES]);

impl<const AXES: usize> Range<AXES> {
    const ANY: Self = Self([[f32::NEG_INFINITY, f32::INFINITY]; AXES]);

    /// The part of it that is not farther from `bend` than points that are `rounded` (by the square of the length) allow, and points
    /// between those of a circle in `uneven` pieces.
    fn within(
        mut self,
        bend: &[f32; AXES],
        rounded: f32,
        uneven: f32,
        limits: &Limits<AXES>,
    ) -> Self {
        let axes = bend.iter().zip(&limits.per_acceleration);
        for ([low, high], (bend, per_acceleration)) in self.0.iter_mut().zip(axes) {
            let off = OFF * rounded * per_acceleration + 0.25 * uneven * bend.abs();
            (*low, *high) = (
                most(*low, least(*high, bend - off)),
                least(*high, most(*low, bend + off)),
            );
        }
        self
    }

    fn nearest(&self, bend: &[f32; AXES]) -> [f32; AXES] {
        let mut nearest = *bend;
        for (nearest, [low, high]) in nearest.iter_mut().zip(&self.0) {
            *nearest = most(least(*nearest, *high), *low);
        }
        nearest
    }
}

/// So many times its rounding the second difference of three points may be off.
const OFF: f32 = 4.0;

impl<const AXES: usize> Placed<AXES> {
    /// The place `length` mm behind one of its ends, or before it, seen from `origin`, mm: from the nearer end, which is known best.
    fn beside(&self, origin: &[i32; AXES], end: &[i32; AXES], length: f32) -> [f32; AXES] {
        let mut point = between(origin, end);
        let share = length / self.length;
        for (point, way) in point.iter_mut().zip(&self.way) {
            *point += way * share;
        }
        point
    }

    fn direction(&self) -> [f32; AXES] {
        if self.piece.is_short {
            self.way.map(|way| way / self.length)
        } else {
            self.piece.direction
        }
    }
}

/// Whether a turn is so sharp that it is no part of a smooth curve: by 22 degrees.
fn is_sharp<const AXES: usize>(from: &[f32; AXES], to: &[f32; AXES]) -> bool {
    const SHARP2: f32 = 0.15;
    let change2 = from
        .iter()
        .zip(to)
        .fold(0.0, |sum, (from, to)| sum + (to - from) * (to - from));
    change2 > SHARP2
}

/// The curvature by accelerations between two ways of the same length, exact on a circle, and the weakest of the axes that move:
/// 1/acceleration.
fn curvature<const AXES: usize>(
    ahead: &[f32; AXES],
    behind: &[f32; AXES],
    limits: &Limits<AXES>,
) -> ([f32; AXES], f32) {
    let per_length2 = 1.0 / sqrt(norm2(ahead) * norm2(behind));
    let (mut bend, mut noisy) = ([0.0; AXES], 0.0);
    let axes = ahead.iter().zip(behind).zip(&limits.per_acceleration);
    for (bend, ((ahead, behind), per_acceleration)) in bend.iter_mut().zip(axes) {
        let aside = ahead + behind;
        // Coordinates are no finer.
        if aside.abs() > FINEST {
            *bend = aside * per_length2 * per_acceleration;
        }
        if *ahead != 0.0 || *behind != 0.0 {
            noisy = most(noisy, *per_acceleration);
        }
    }
    (bend, noisy)
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
