//! The curvature of a path of short pieces, at a place where two of them meet.
//!
//! ```text
//!             P(s)
//!        _--o------o__
//!     o--             --o
//!   P(s−h)             P(s+h)
//!
//!   k = (P(s+h) − 2·P(s) + P(s−h)) / (|P(s+h) − P(s)|·|P(s) − P(s−h)|)
//! ```
//!
//! The curvature at a place `s` of the path, over the length `h` to both sides, is the second
//! difference divided by both chords.
//!
//! Coordinates are rounded to a few decimals, each by up to `e`. That makes an error of `4·e/h²`.
//! So `h` begins as the length of the shorter of the two pieces, and grows until
//!
//! ```text
//!   4·e/h² ≤ QUIET · max(|k|, a/x)
//! ```
//!
//! Here `x` is the lower one of the highest squared speeds of the two pieces, and `a` the
//! acceleration across the path.
//!
//! Each length that is tried bounds the curvature from both sides by its own error. The result
//! keeps all of these bounds, so it bends the path by no more than rounding does.
//!
//! A curve that goes on as it did at the turn before is measured once, over the length that was
//! found there. Where its curvature has changed, it is compared with the one over half that length.

use super::probe::Probe;
use super::window::{Window, MM};
use crate::config::Limits;
use crate::real::{least, most, norm2, sqrt};
use crate::space::polygon::greatest;

/// The share of the curvature, or of the least one that bounds the speed, that rounding may make
/// up.
const QUIET: f32 = 0.01;

/// A second difference counts four points: each is off by one unit, mm.
const FINEST: f32 = 4.0 * MM;

/// A length is long enough where its square is too short by no more than this factor.
const NEAR_ENOUGH: f32 = 1.1;

/// The same for a length that was long enough at the turn before.
const STILL_NEAR_ENOUGH: f32 = 1.4;

/// Where rounding asks for less than this share of a length's square, the next turn tries
/// [`SHORTER`] of the length.
const TOO_LONG: f32 = 0.5;
const SHORTER: f32 = 0.75;

/// The length grows to this many times the shorter of the two pieces at most.
const LONGEST: f32 = 32.0;

/// The length grows to no more than this, mm.
const FARTHEST: f32 = 32.0;

/// The curvatures of two turns are alike where they differ by no more than this share of
/// [`Meeting::loudness`].
const ALIKE: f32 = 0.2;

/// A curvature may differ by this share of [`Meeting::loudness`] from the last one that was
/// compared with that over a shorter length.
const DRIFT: f32 = 0.05;

/// The second difference of three points may be off by this many times their rounding.
const OFF: f32 = 4.0;

/// A curvature over the acceleration of each axis, s²/mm², and the length to both sides over which
/// it holds, mm.
pub(super) type Curved<const AXES: usize> = ([f32; AXES], f32);

/// What the length for a turn's curvature depends on. Lengths in mm.
struct Meeting {
    /// Lengths of the two pieces.
    lengths: [f32; 2],
    /// The shorter of these.
    shorter: f32,
    /// 1/(highest squared speed) of the piece where that is lower, s²/mm².
    per_top_v2: f32,
    rounding: f32,
}

impl<const AXES: usize> Window<AXES> {
    /// The curvature at the start of a piece; `None` where that needs more path and `now` is not
    /// set.
    pub(super) fn curved(
        &self,
        number: u32,
        limits: &Limits<AXES>,
        now: bool,
        probe: &mut Probe<AXES>,
    ) -> Option<Curved<AXES>> {
        probe.goes_on = false;
        let meeting = self.meeting(number);
        let wanted = least(most(probe.wanted, meeting.shorter), meeting.longest());
        let room = least(self.room_ahead(number), self.room_behind(number));
        let reach = least(wanted, room);
        let bend = self.curvature(number, reach, limits, &mut probe.pieces);
        let loudness = meeting.loudness(&bend);
        let longer2 = meeting.error(&bend, reach, limits);
        let is_shortest = reach <= meeting.shorter;
        if is_shortest && longer2 <= NEAR_ENOUGH {
            probe.compared = sqrt(curvature2(&bend, limits));
            return Some((bend, reach));
        }
        let is_long_enough = longer2 <= STILL_NEAR_ENOUGH || reach < wanted;
        let goes_on = is_long_enough
            && self.is_as_before(number, &meeting, (&bend, loudness), limits, probe)
            && self.is_steady(number, &meeting, (&bend, reach), limits, probe);
        if goes_on {
            if longer2 < TOO_LONG {
                probe.wanted *= SHORTER;
            }
            probe.goes_on = true;
            return Some((bend, reach));
        }
        let curved = self.search(number, (&meeting, room), limits, now, probe)?;
        probe.compared = sqrt(curvature2(&curved.0, limits));
        Some(curved)
    }

    /// Tries one length after the other, the shorter piece's first.
    fn search(
        &self,
        number: u32,
        (meeting, room): (&Meeting, f32),
        limits: &Limits<AXES>,
        now: bool,
        probe: &mut Probe<AXES>,
    ) -> Option<Curved<AXES>> {
        let may_grow = if self.is_open(number) {
            self.room_ahead(number)
        } else {
            f32::INFINITY
        };
        let mut range = Range::ANY;
        let mut length = meeting.shorter;
        loop {
            probe.wanted = length;
            let is_open = may_grow < length;
            if is_open && !now {
                return None;
            }
            let reach = least(length, room);
            let curved = self.curvature(number, reach, limits, &mut probe.pieces);
            let bend = range.nearest(&curved);
            let longer2 = meeting.error(&bend, reach, limits);
            let is_cut_short = reach < length;
            if is_cut_short && !is_open {
                // Near a rest or a sharp turn motion is slow: the straightest path is enough.
                range.narrow(&curved, reach, meeting, limits);
                return Some((range.nearest(&[0.0; AXES]), reach));
            }
            if longer2 <= NEAR_ENOUGH || is_cut_short || length >= meeting.longest() {
                return Some((bend, reach));
            }
            range.narrow(&curved, reach, meeting, limits);
            length = least(length * least(sqrt(longer2), 2.0), meeting.longest());
        }
    }

    fn meeting(&self, number: u32) -> Meeting {
        let (before, after) = (self.placed(number.wrapping_sub(1)), self.placed(number));
        Meeting {
            lengths: [before.length, after.length],
            shorter: most(least(before.length, after.length), f32::MIN_POSITIVE),
            per_top_v2: most(before.piece.per_top_v2, after.piece.per_top_v2),
            rounding: most(before.piece.rounding, after.piece.rounding),
        }
    }

    /// The curvature over a length, over the acceleration of each axis, s²/mm². It is exact on a
    /// circle. The path is that long to both sides.
    pub(super) fn curvature(
        &self,
        number: u32,
        length: f32,
        limits: &Limits<AXES>,
        pieces: &mut [u32; 2],
    ) -> [f32; AXES] {
        let (mut bend, product2) = self.aside(number, length, pieces);
        let per_length2 = 1.0 / sqrt(product2);
        for (bend, per_acceleration) in bend.iter_mut().zip(&limits.per_acceleration) {
            // Coordinates are no finer: the path is straight.
            *bend = if bend.abs() > FINEST {
                *bend * per_length2 * per_acceleration
            } else {
                0.0
            };
        }
        bend
    }

    /// Whether a curvature is still as great as when it was last compared with that over a shorter
    /// length. Where it is not: whether the curvature over half its length is the same but for
    /// rounding.
    ///
    /// Small changes from turn to turn may add up. Where a line becomes a curve, the curvature of
    /// the path changes at once, but the curvature over a length grows little by little.
    fn is_steady(
        &self,
        number: u32,
        meeting: &Meeting,
        (bend, reach): (&[f32; AXES], f32),
        limits: &Limits<AXES>,
        probe: &mut Probe<AXES>,
    ) -> bool {
        let curvature = sqrt(curvature2(bend, limits));
        let drift = (curvature - probe.compared).abs() * greatest(bend);
        if drift <= DRIFT * meeting.loudness(bend) * curvature {
            return true;
        }
        let shorter = most(0.5 * reach, meeting.shorter);
        let closer = self.curvature(number, shorter, limits, &mut [0; 2]);
        let off = OFF * meeting.rounding / (shorter * shorter);
        let mut axes = closer.iter().zip(bend).zip(&limits.per_acceleration);
        let is_same = axes.all(|((closer, bend), per_acceleration)| {
            (closer - bend).abs() <= off * per_acceleration
        });
        if is_same {
            probe.compared = curvature;
        }
        is_same
    }

    /// Whether a curvature is like that of the turn before, and explains the turn between the two
    /// pieces, but for what rounding may have made of it.
    fn is_as_before(
        &self,
        number: u32,
        meeting: &Meeting,
        (bend, loudness): (&[f32; AXES], f32),
        limits: &Limits<AXES>,
        probe: &Probe<AXES>,
    ) -> bool {
        let (from, to) = (
            &self.placed(number.wrapping_sub(1)).course,
            &self.placed(number).course,
        );
        let [before, after] = meeting.lengths;
        let half = 0.5 * (before + after);
        let off = OFF * meeting.rounding * half;
        let near = ALIKE * loudness;
        let turns = from.iter().zip(to).zip(&limits.acceleration);
        let mut axes = turns.zip(bend.iter().zip(&probe.before));
        axes.all(|(((from, to), acceleration), (bend, last))| {
            let aside = (to - from - bend * acceleration * half) * before * after;
            aside.abs() <= off && (bend - last).abs() <= near
        })
    }
}

impl Meeting {
    fn longest(&self) -> f32 {
        least(LONGEST * self.shorter, FARTHEST)
    }

    /// The greater of a curvature and of the least one that bounds the speed, s²/mm².
    fn loudness(&self, bend: &[f32]) -> f32 {
        most(greatest(bend), self.per_top_v2)
    }

    /// The error of a curvature over a length, divided by the error that is allowed. Error and
    /// curvature both lie across the path, so the axes share the error as they share the curvature.
    /// Where the path does not turn, all of the error is taken to be on the weakest axis.
    fn error<const AXES: usize>(
        &self,
        bend: &[f32; AXES],
        length: f32,
        limits: &Limits<AXES>,
    ) -> f32 {
        let curvature2 = curvature2(bend, limits);
        let worst = greatest(bend);
        let per_acceleration = if curvature2 > 0.0 {
            worst / sqrt(curvature2)
        } else {
            limits.per_weakest
        };
        let allowed = QUIET * most(worst, self.per_top_v2);
        OFF * self.rounding * per_acceleration / (length * length * allowed)
    }
}

/// The square, 1/mm², of a curvature that is given over the acceleration of each axis.
pub(super) fn curvature2<const AXES: usize>(bend: &[f32; AXES], limits: &Limits<AXES>) -> f32 {
    let mut curvature = *bend;
    for (curvature, acceleration) in curvature.iter_mut().zip(&limits.acceleration) {
        *curvature *= acceleration;
    }
    norm2(&curvature)
}

/// For each axis the least and the greatest value that the curvature may have, s²/mm².
struct Range<const AXES: usize>([[f32; 2]; AXES]);

impl<const AXES: usize> Range<AXES> {
    const ANY: Self = Self([[f32::NEG_INFINITY, f32::INFINITY]; AXES]);

    /// Narrows the range by the curvature `bend` that was found over `length`. That may be off
    /// because points are rounded, and because they lie on pieces of uneven length.
    fn narrow(&mut self, bend: &[f32; AXES], length: f32, of: &Meeting, limits: &Limits<AXES>) {
        let per_length2 = 1.0 / (length * length);
        let longer = most(of.lengths[0], of.lengths[1]);
        let rounded = OFF * of.rounding * per_length2;
        let uneven = 0.25 * (longer * longer - of.shorter * of.shorter) * per_length2;
        let axes = bend.iter().zip(&limits.per_acceleration);
        for ([low, high], (bend, per_acceleration)) in self.0.iter_mut().zip(axes) {
            let off = rounded * per_acceleration + uneven * bend.abs();
            (*low, *high) = (
                most(*low, least(*high, bend - off)),
                least(*high, most(*low, bend + off)),
            );
        }
    }

    fn nearest(&self, bend: &[f32; AXES]) -> [f32; AXES] {
        let mut nearest = *bend;
        for (nearest, [low, high]) in nearest.iter_mut().zip(&self.0) {
            *nearest = most(least(*nearest, *high), *low);
        }
        nearest
    }
}
