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
use crate::ease::{Ease, PLACES};
use crate::real::{max, min, sqrt};

/// Units of the plan's places in a mm: one is about a nanometre.
const PER_MM: f32 = (1 << 20) as f32;

/// The most pieces of the tool's way that are known ahead.
const PIECES: usize = 3;

/// The length of a move, units.
pub(crate) fn units(mm: f32) -> u64 {
    ((mm * PER_MM) as u64).max(1)
}

/// The plan's places of the last time `T`, in units along the path, modulo 2³².
#[derive(Clone, Debug)]
pub(crate) struct Ring {
    places: [u32; PLACES],
    /// The index of the newest place.
    newest: usize,
    /// The newest place less the one before all others.
    ahead: u32,
    /// How many times the newest place has been repeated, at most the number of places.
    still: usize,
    /// Whether the plan rests at the newest place.
    rested: bool,
}

/// A piece of the tool's way, from one time to the next.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Piece {
    /// Its length, `1/2N` units.
    way: u64,
    /// The speeds at its ends, units in the time `T`.
    speeds: [u32; 2],
    /// Whether the tool comes to rest at its end.
    rests: bool,
}

impl Ring {
    /// A plan at rest.
    pub(crate) const fn new() -> Self {
        Self {
            places: [0; PLACES],
            newest: 0,
            ahead: 0,
            still: PLACES,
            rested: true,
        }
    }

    /// Whether the plan has stood still for the whole time.
    pub(crate) const fn is_still(&self, ease: &Ease) -> bool {
        self.still >= ease.places
    }

    /// Adds a place, `way` units after the newest one. `rests`: the plan rests there. Returns the
    /// piece of the tool's way from one time to the next.
    pub(crate) fn push(&mut self, way: u32, rests: bool, ease: &Ease) -> Piece {
        let stood = self.is_still(ease);
        let newest = self.places.get(self.newest).copied().unwrap_or(0);
        let place = newest.wrapping_add(way);
        self.newest = (self.newest + 1) % ease.places.min(PLACES);
        let oldest = self.places.get_mut(self.newest);
        let ahead = oldest.map_or(0, |oldest| {
            place.wrapping_sub(core::mem::replace(oldest, place))
        });
        let speeds = [self.ahead, ahead];
        self.ahead = ahead;
        // The place at which the plan comes to rest is not repeated yet.
        self.still = match rests && self.rested && way == 0 {
            true => (self.still + 1).min(PLACES),
            false => 0,
        };
        self.rested = rests;
        Piece {
            way: u64::from(speeds[0]) + u64::from(speeds[1]),
            speeds,
            rests: self.is_still(ease) && !stood,
        }
    }
}

/// A piece of the tool's way, in which the acceleration is constant. Ways are in `1/2N` units from
/// the start of the move, speeds in units in the time `T`.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct Known {
    from: i64,
    to: i64,
    speeds: [u32; 2],
}

/// The known part of the tool's way, from the end of the segments handed out on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Mean {
    pieces: [Known; PIECES],
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
    /// Whether the tool rests at the end of the known way.
    rests: bool,
}

impl Mean {
    /// The way of a move that begins at rest.
    pub(crate) fn new(events: u32, mm: f32, ease: &Ease) -> Self {
        let mut mean = Self {
            pieces: [Known::default(); PIECES],
            count: 0,
            here: Place::at(0),
            now: 0.0,
            events,
            length: 0,
            scale: 0,
            rate: 0.0,
            between: ease.between,
            rests: false,
        };
        mean.fit(events, mm, ease);
        mean
    }

    /// Goes on in the next move, which has `events` steps on `mm`.
    pub(crate) fn go_on(&self, events: u32, mm: f32, ease: &Ease) -> Self {
        let mut next = *self;
        for piece in &mut next.pieces {
            piece.from -= self.length;
            piece.to -= self.length;
        }
        next.here = Place::at(0);
        next.rests &= next.count > 0;
        next.fit(events, mm, ease);
        next
    }

    fn fit(&mut self, events: u32, mm: f32, ease: &Ease) {
        let parts = 2 * ease.places as u64;
        let length = units(mm) * parts;
        self.events = events;
        self.length = length as i64;
        self.scale = ((u128::from(events) << 64) / u128::from(length)) as u64;
        self.rate = events as f32 / (length as f32 / parts as f32) / ease.seconds;
    }

    /// Adds a piece of way.
    pub(crate) fn push(&mut self, next: Piece) {
        let from = self.known().map_or_else(|| self.at(), |last| last.to);
        let piece = Known {
            from,
            to: from.saturating_add_unsigned(next.way),
            speeds: next.speeds,
        };
        if let Some(free) = self.pieces.get_mut(self.count) {
            *free = piece;
            self.count += 1;
        }
        self.rests = next.rests;
    }

    /// Whether the tool rests at the end of the known way, which is all handed out.
    pub(crate) const fn rests(&self) -> bool {
        self.rests && self.count == 0
    }

    /// Whether more has to be known for the next segment, of `longest` seconds at most: a step, or
    /// as much time as a segment has. Nothing is known behind a rest before that is reached.
    pub(crate) fn needs_more(&self, longest: f32) -> bool {
        if self.count == 0 {
            return true;
        }
        let ahead = self.ahead();
        let has_step = self.end() > self.here.step();
        let enough = ahead >= LEAST_AHEAD && (has_step || ahead >= longest);
        self.has_room() && !self.rests && !enough
    }

    fn known(&self) -> Option<&Known> {
        self.pieces.get(self.count.checked_sub(1)?)
    }

    /// The place of the tool where nothing is known ahead.
    fn at(&self) -> i64 {
        self.pieces.first().map_or(0, |gone| gone.to)
    }

    /// The time that is known ahead, s.
    fn ahead(&self) -> f32 {
        self.count as f32 * self.between - self.now
    }

    /// Whether there is room for one more piece.
    const fn has_room(&self) -> bool {
        self.count < PIECES
    }

    /// The place in the move for a way, 2⁻³² steps; negative before the move's start.
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
    pub(crate) fn end(&self) -> u32 {
        let step = (self.end_place().max(0) >> 32) as u64;
        step.min(self.events.into()) as u32
    }

    /// Whether the tool rests at a step.
    pub(crate) fn rests_at(&self, step: u32) -> bool {
        let here = self.known().is_none_or(|last| last.to <= self.length);
        self.rests && here && self.end_place() >> 32 == i64::from(step)
    }

    /// Speed at the end of the known way, steps/s.
    pub(crate) fn last_speed(&self) -> f32 {
        self.known()
            .map_or(0.0, |last| last.speeds[1] as f32 * self.rate)
    }

    /// Seconds from the first piece's start to a place, and the speed there (steps/s); infinite if
    /// the place is not known yet.
    fn time(&self, place: Place) -> (f32, f32) {
        let place = place.units() as i64;
        let mut seconds = 0.0;
        for (index, piece) in self.pieces.iter().take(self.count).enumerate() {
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
    pub(crate) fn after(&self, seconds: f32) -> (Place, f32, f32) {
        let until = min(self.now + seconds, self.count as f32 * self.between);
        let index = ((until / self.between) as usize).min(self.count.saturating_sub(1));
        let piece = self.pieces.get(index).copied().unwrap_or_default();
        let [v0, v1] = piece.speeds.map(|speed| speed as f32 * self.rate);
        let into = min(until - index as f32 * self.between, self.between);
        let v = v0 + (v1 - v0) * (into / self.between);
        let way = 0.5 * (v0 + v) * into;
        let reached = self.place(piece.from) + (way * TWO_32) as i64;
        let next = self.here.units() as i64 + 1;
        let last = (i64::from(self.here.step()) + 1 << 32) - 1;
        let place = reached.max(next).min(last);
        (Place::of(place as u64), max(until - self.now, SOON), v)
    }

    /// Goes on to the end of a segment.
    pub(crate) fn pass(&mut self, to: Place, seconds: f32) {
        self.now = match to.is_whole() {
            true => self.time(to).0,
            false => self.now + seconds,
        };
        self.here = to;
        while self.count > 0 && self.now >= self.between * NEARLY {
            self.now = max(self.now - self.between, 0.0);
            self.count -= 1;
            if self.count > 0 {
                self.pieces.rotate_left(1);
            } else {
                self.now = 0.0;
            }
        }
    }

    /// The whole steps that are known after `from`, and the acceleration.
    pub(crate) fn stretch(&self, from: u32) -> Stretch {
        let known = self.pieces.iter().take(self.count);
        let change = known.fold(0, |most: u32, piece| {
            most.max(piece.speeds[1].abs_diff(piece.speeds[0]))
        });
        let piece = self.pieces.first().copied().unwrap_or_default();
        let acceleration = max(change as f32 * self.rate / self.between, LEAST);
        Stretch {
            steps: self.end().saturating_sub(from),
            acceleration: if piece.speeds[1] < piece.speeds[0] {
                -acceleration
            } else {
                acceleration
            },
        }
    }
}

const TWO_32: f32 = 4_294_967_296.0;

/// The shortest time between two places, seconds.
const SOON: f32 = 1e-9;

/// The least time that is known ahead of a segment, seconds: no segment is much shorter.
const LEAST_AHEAD: f32 = 0.15e-3;

/// By how much a place that was found in `f32` may be too far, 2⁻³² steps.
const ROUNDED: i64 = 1024;

/// A piece is over if this share of its time is.
const NEARLY: f32 = 1.0 - 1e-6;

/// The least acceleration that segments are cut for, steps/s².
const LEAST: f32 = 1e-3;
