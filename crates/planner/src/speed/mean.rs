//! The speed of the tool under a jerk limit: the mean of the plan over the last time `T`.
//!
//! The plan has a place each `h = T/N`. With `s_k` for the plan's place at the time `k·h` the tool
//! has the speed
//!
//! ```text
//!   v_k = (s_k − s_(k−N)) / T
//! ```
//!
//! and changes it linearly from one time to the next. So the tool is at the mean of the places
//! `s_(k−N)` to `s_k`, of which the first and the last one count half. All places are whole numbers
//! of `1/2N` units. Nothing is rounded, and the tool ends where the plan ends.

use super::plan::{Place, Stretch};
use crate::built::Jerk;
use crate::ease::{Ease, PLACES};
use crate::real::{max, min, sqrt};

/// The most pieces of the tool's way that are known ahead.
const PIECES: usize = 3;

/// The ways of the plan from place to place in the last time `T`, in units along the path.
#[derive(Clone, Debug)]
pub(crate) struct Ring {
    ways: [u16; PLACES],
    /// The index of the newest way.
    newest: u8,
    /// The number of times that the plan has stood still, at most the number of places.
    still: u8,
    /// True if the plan rests at the newest place.
    rested: bool,
    /// The sum of all ways.
    ahead: u32,
}

const _: () = assert!(PLACES < 256);

/// A piece of the tool's way, from one time to the next: the speeds at its ends, units in the time
/// `T`. Their sum is its length, `1/2N` units.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Piece {
    speeds: [u32; 2],
    /// True if the tool comes to rest at its end.
    rests: bool,
}

impl Ring {
    /// A plan at rest.
    pub(crate) const fn new() -> Self {
        Self {
            ways: [0; PLACES],
            newest: 0,
            still: PLACES as u8,
            rested: true,
            ahead: 0,
        }
    }

    /// Returns true if the plan has stood still for the whole time.
    pub(crate) const fn is_still(&self, ease: &Ease) -> bool {
        self.still as usize >= ease.places
    }

    /// The time for which a plan that rests still stands, seconds.
    pub(crate) fn stands(&self, ease: &Ease) -> f32 {
        ease.places.saturating_sub(self.still.into()) as f32 * ease.between
    }

    /// Adds a place, `way` units after the newest one. `rests`: the plan rests there. Returns the
    /// piece of the tool's way from one time to the next.
    pub(crate) fn push(&mut self, way: u16, rests: bool, ease: &Ease) -> Piece {
        let stood = self.is_still(ease);
        self.newest = ((usize::from(self.newest) + 1) % ease.places) as u8;
        let oldest = match self.ways.get_mut(usize::from(self.newest)) {
            Some(oldest) => core::mem::replace(oldest, way),
            None => 0,
        };
        let before = self.ahead;
        self.ahead = (before + u32::from(way)).saturating_sub(oldest.into());
        // The place at which the plan comes to rest is not repeated yet.
        self.still = match rests && self.rested && way == 0 {
            true => (self.still + 1).min(PLACES as u8),
            false => 0,
        };
        self.rested = rests;
        Piece {
            speeds: [before, self.ahead],
            rests: self.is_still(ease) && !stood,
        }
    }
}

/// The known part of the tool's way, from the end of the segments handed out on: pieces in which
/// the acceleration is constant. Ways are in `1/2N` units from the start of the move.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Mean {
    /// The start of the first piece.
    from: i64,
    /// The speeds at the ends of the pieces, units in the time `T`.
    speeds: [u32; PIECES + 1],
    count: usize,
    /// The end of the segments handed out, and the time from the first piece's start to there.
    here: Place,
    now: f32,
    /// Steps of the dominant motor in the move.
    events: u32,
    /// Length of the move, `1/2N` units.
    length: i64,
    /// 2⁻³² steps in a `1/2N` unit, in units of 2⁻³².
    scale: u64,
    /// Steps/s for a unit in the time `T`.
    rate: f32,
    /// The time of a piece, seconds.
    between: f32,
    /// True if the tool rests at the end of the known way.
    rests: bool,
    built: Jerk,
}

/// A piece of the tool's way.
#[derive(Clone, Copy)]
struct Known {
    from: i64,
    to: i64,
    speeds: [u32; 2],
}

impl Mean {
    /// The way of a move that begins at rest.
    pub(crate) fn new(events: u32, mm: f32, ease: &Ease) -> Self {
        let mut mean = Self {
            from: 0,
            speeds: [0; PIECES + 1],
            count: 0,
            here: Place::at(0),
            now: 0.0,
            events,
            length: 0,
            scale: 0,
            rate: 0.0,
            between: ease.between,
            rests: false,
            built: ease.built,
        };
        mean.fit(events, mm, ease);
        mean
    }

    /// Goes on in the next move, which has `events` steps on `mm`.
    pub(crate) fn go_on(&self, events: u32, mm: f32, ease: &Ease) -> Self {
        let mut next = *self;
        next.from -= self.length;
        next.here = Place::at(0);
        next.rests &= next.count > 0;
        next.fit(events, mm, ease);
        next
    }

    fn fit(&mut self, events: u32, mm: f32, ease: &Ease) {
        let parts = 2 * ease.places as u64;
        let length = ease.units(mm) * parts;
        self.events = events;
        self.length = length as i64;
        self.scale = scale(events, length);
        self.rate = events as f32 / (length as f32 / parts as f32) / ease.seconds;
    }

    /// Adds a piece of way.
    pub(crate) fn push(&mut self, next: Piece) {
        let [begun, ended] = next.speeds;
        for (place, speed) in self.speeds.iter_mut().skip(self.count).zip([begun, ended]) {
            *place = speed;
        }
        self.count = (self.count + 1).min(PIECES);
        self.rests = next.rests;
    }

    /// The pieces that are known, the next one first.
    fn pieces(&self) -> impl Iterator<Item = Known> + '_ {
        let mut to = self.from;
        self.speeds.windows(2).take(self.count).map(move |speeds| {
            let [begun, ended] = [0, 1].map(|end| speeds.get(end).copied().unwrap_or(0));
            let from = to;
            to += i64::from(begun) + i64::from(ended);
            Known {
                from,
                to,
                speeds: [begun, ended],
            }
        })
    }

    /// Returns true if the tool rests at the end of the known way, which is all handed out.
    pub(crate) const fn rests(&self) -> bool {
        self.rests && self.count == 0
    }

    /// Returns true if more has to be known for the next segment, of `longest` seconds at most: a
    /// step, or as much time as a segment has. Nothing is known behind a rest before that is
    /// reached.
    #[inline(never)]
    pub(crate) fn needs_more(&self, longest: f32) -> bool {
        if self.count == 0 {
            return true;
        }
        let ahead = self.ahead();
        let has_step = self.end() > self.here.step();
        let enough = ahead >= LEAST_AHEAD && (has_step || ahead >= longest);
        self.has_room() && !self.rests && !enough
    }

    /// The last piece that is known.
    fn known(&self) -> Option<Known> {
        self.pieces().last()
    }

    /// The time that is known ahead, s.
    fn ahead(&self) -> f32 {
        self.count as f32 * self.between - self.now
    }

    /// Returns true if there is room for one more piece.
    const fn has_room(&self) -> bool {
        self.count < PIECES
    }

    /// The place in the move for a way, 2⁻³² steps; negative before the move's start.
    #[inline(never)]
    fn place(&self, way: i64) -> i64 {
        let magnitude = (u128::from(way.unsigned_abs()) * u128::from(self.scale)) >> 32;
        let magnitude = magnitude.min(i64::MAX as u128) as i64;
        if way < 0 {
            -magnitude
        } else {
            magnitude
        }
    }

    /// The end of the known way, 2⁻³² steps. A rest is on a whole step. Elsewhere the end is not, so
    /// that the last step before a rest is known to be the last.
    fn end_place(&self) -> i64 {
        let Some(last) = self.known() else {
            return self.here.units() as i64;
        };
        let place = self.place(last.to);
        if self.rests && last.to <= self.length {
            (place.saturating_add(1 << 31)) & !0xFFFF_FFFF
        } else {
            place - i64::from(place & 0xFFFF_FFFF == 0)
        }
    }

    /// The last step that is known, in this move, and the move's end at most.
    #[inline(never)]
    pub(crate) fn end(&self) -> u32 {
        let step = (self.end_place().max(0) >> 32) as u64;
        step.min(self.events.into()) as u32
    }

    /// Returns true if the tool rests at a step.
    #[inline(never)]
    pub(crate) fn rests_at(&self, step: u32) -> bool {
        let here = self.known().is_none_or(|last| last.to <= self.length);
        self.rests && here && self.end_place() >> 32 == i64::from(step)
    }

    /// Speed at the end of the known way, steps/s.
    #[inline(never)]
    pub(crate) fn last_speed(&self) -> f32 {
        self.known()
            .map_or(0.0, |last| last.speeds[1] as f32 * self.rate)
    }

    /// Seconds from the first piece's start to a place, and the speed there (steps/s); infinite if
    /// the place is not known yet.
    fn time(&self, place: Place) -> (f32, f32) {
        let place = place.units() as i64;
        let mut seconds = 0.0;
        for (index, piece) in self.pieces().enumerate() {
            let last = index + 1 == self.count;
            let end = if last {
                self.end_place()
            } else {
                self.place(piece.to)
            };
            let [v0, v1] = piece.speeds.map(|speed| speed as f32 * self.rate);
            if place < end || (last && place < end + ROUNDED) {
                let way = (place - self.place(piece.from)) as f32 * (1.0 / TWO_32);
                let gained = (v1 - v0) / self.between;
                let v = sqrt(v0 * v0 + 2.0 * gained * max(way, 0.0));
                let time = if way > 0.0 { 2.0 * way / (v0 + v) } else { 0.0 };
                if place >= end {
                    return (seconds + self.between, v1);
                }
                return (seconds + min(time, self.between), v);
            }
            seconds += self.between;
        }
        (f32::INFINITY, 0.0)
    }

    /// Time that the `steps` after `from` take (seconds), and the speed at their end (steps/s).
    #[inline(never)]
    pub(crate) fn time_over(&self, from: Place, steps: f32) -> (f32, f32) {
        let begun = if from == self.here {
            self.now
        } else {
            self.time(from).0
        };
        let (ended, speed) = self.time(from.moved(steps));
        (max(ended - begun, SOON), speed)
    }

    /// The place after the time `seconds`, at most the known time; that time; and the speed there,
    /// steps/s. The place is within the step under way.
    #[inline(never)]
    pub(crate) fn after(&self, seconds: f32) -> (Place, f32, f32) {
        let until = min(self.now + seconds, self.count as f32 * self.between);
        let index = ((until / self.between) as usize).min(self.count.saturating_sub(1));
        let Some(piece) = self.pieces().nth(index) else {
            return (self.here, SOON, 0.0);
        };
        let [v0, v1] = piece.speeds.map(|speed| speed as f32 * self.rate);
        let into = min(until - index as f32 * self.between, self.between);
        let v = v0 + (v1 - v0) * (into / self.between);
        let way = 0.5 * (v0 + v) * into;
        let reached = self.place(piece.from) + (way * TWO_32) as i64;
        let next = self.here.units() as i64 + 1;
        let last = ((i64::from(self.here.step()) + 1) << 32) - 1;
        let place = reached.max(next).min(last);
        (Place::of(place as u64), max(until - self.now, SOON), v)
    }

    /// Goes on to the end of a segment.
    #[inline(never)]
    pub(crate) fn pass(&mut self, to: Place, seconds: f32) {
        self.now = match to.is_whole() {
            true => self.time(to).0,
            false => self.now + seconds,
        };
        self.here = to;
        while self.now >= self.between * NEARLY {
            let Some(gone) = self.pieces().next() else {
                return;
            };
            self.now = max(self.now - self.between, 0.0);
            self.count -= 1;
            self.from = gone.to;
            self.speeds.rotate_left(1);
            if self.count == 0 {
                self.now = 0.0;
            }
        }
    }

    /// The whole steps that are known after `from`, and the acceleration.
    #[inline(never)]
    pub(crate) fn stretch(&self, from: u32) -> Stretch {
        let change = self.pieces().fold(0, |most: u32, piece| {
            most.max(piece.speeds[1].abs_diff(piece.speeds[0]))
        });
        let falls = |piece: Known| piece.speeds[1] < piece.speeds[0];
        let acceleration = max(change as f32 * self.rate / self.between, LEAST);
        Stretch {
            steps: self.end().saturating_sub(from),
            acceleration: if self.pieces().next().is_some_and(falls) {
                -acceleration
            } else {
                acceleration
            },
        }
    }
}

/// 2⁶⁴ times `events` over `length`, which is more, rounded down: bit by bit, which takes a quarter of
/// the time of a division of 128 bits.
fn scale(events: u32, length: u64) -> u64 {
    let (mut rest, mut scale) = (u64::from(events), 0);
    for _ in 0..u64::BITS {
        (rest, scale) = (rest << 1, scale << 1);
        if rest >= length {
            (rest, scale) = (rest - length, scale | 1);
        }
    }
    scale
}

const TWO_32: f32 = 4_294_967_296.0;

/// The shortest time between two places, seconds.
const SOON: f32 = 1e-9;

/// The least time that is known ahead of a segment, seconds: no segment is much shorter.
const LEAST_AHEAD: f32 = 0.15e-3;

/// The amount by which a place that was found in `f32` may be too far, 2⁻³² steps.
const ROUNDED: i64 = 1024;

/// A piece is over if this share of its time is.
const NEARLY: f32 = 1.0 - 1e-6;

/// The least acceleration that segments are cut for, steps/s².
const LEAST: f32 = 1e-3;
