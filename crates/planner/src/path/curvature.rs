//! The curvature of a path of short pieces, at a place where two of them meet.
//!
//! ```text
//!             P(s)               The curvature at a place s of the path, over the length h to both sides, is its second difference
//!        _--o------o__
//!     o--             --o              k = (P(s+h) − 2·P(s) + P(s−h)) / h²
//!   P(s−h)             P(s+h)
//! ```
//!
//! Coordinates are rounded to a few decimals, each by up to `e`, which makes an error of `4·e/h²`.
//! So `h` begins as the length of the shorter of the two pieces. It grows while the error would
//! cost more than [`QUIET`] of the speed:
//!
//! ```text
//!   4·e/h² ≤ QUIET · max(|k|, a/x)      x: the highest squared speed that the pieces may have
//! ```
//!
//! Each length that is tried bounds the curvature from both sides by its own error. The result
//! keeps all of these bounds, so it bends the path by no more than rounding does.
//!
//! A curve that goes on as it did at the turn before is measured once, over the length that was
//! found there. Now and then it is compared with half that length.

use super::probe::Probe;
use super::window::{Window, MM};
use crate::config::Limits;
use crate::real::{least, most, norm2, sqrt};
use crate::space::polygon::greatest;

/// Share of the acceleration, or of the curvature, that rounding may make up.
const QUIET: f32 = 0.01;

/// Four points of which each is off by one unit, mm.
const FINEST: f32 = 4.0 * MM;

/// The length squared is long enough within this factor.
const NEAR_ENOUGH: f32 = 1.1;

/// The same for a length that was long enough at the turn before.
const STILL_NEAR_ENOUGH: f32 = 1.4;

/// From this on it is longer than it need be, and is a little shorter at the next turn.
const TOO_LONG: f32 = 0.5;
const SHORTER: f32 = 0.75;

/// The length grows to this many times the shorter of the two pieces at most.
const LONGEST: f32 = 32.0;

/// And to no more than this, mm.
const FARTHEST: f32 = 32.0;

/// By this share of the quietest curvature two turns may differ and still be alike.
const ALIKE: f32 = 0.2;

/// By this share of it a turn may differ from the last one that was compared with a shorter length.
const DRIFT: f32 = 0.05;

/// The second difference of three points may be off by this many times their rounding.
const OFF: f32 = 4.0;

/// A curvature by the accelerations of the axes, s²/mm², and the length to both sides over which it
/// holds, mm.
pub(super) type Curved<const AXES: usize> = ([f32; AXES], f32);

/// The place of a turn, as far as its curvature depends on it. Lengths in mm.
struct Meeting {
    /// Of the two pieces.
    lengths: [f32; 2],
    /// The shorter of these.
    shorter: f32,
    /// 1/(highest squared speed).
    per_top_v2: f32,
    rounding: f32,
}

impl<const AXES: usize> Window<AXES> {
    /// The curvature at the start of a piece; `None` where the path has to go on for that, and not
    /// `now`.
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

    /// The curvature over a length, by accelerations, exact on a circle; there is as much path.
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
            // Coordinates are no finer.
            *bend = if bend.abs() > FINEST {
                *bend * per_length2 * per_acceleration
            } else {
                0.0
            };
        }
        bend
    }

    /// Whether a curvature is still as great as when it was last compared with shorter lengths, or
    /// that over half its length is the same but for rounding.
    ///
    /// From turn to turn it may change little, and much in the end: where a line becomes a curve,
    /// that over a length grows little by little, while that of the path is there at once.
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

    /// Whether a curvature is like that of the turn before, and explains how the two pieces turn,
    /// but for what rounding does.
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

    /// The error of a curvature over a length by the error that is allowed. Both lie across the
    /// path, so the axes share one as they share the other. Where nothing turns, the weakest axis
    /// may.
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

/// The square of a curvature that is by accelerations, 1/mm².
pub(super) fn curvature2<const AXES: usize>(bend: &[f32; AXES], limits: &Limits<AXES>) -> f32 {
    let mut curvature = *bend;
    for (curvature, acceleration) in curvature.iter_mut().zip(&limits.acceleration) {
        *curvature *= acceleration;
    }
    norm2(&curvature)
}

/// Between which values the curvature lies, for each axis.
struct Range<const AXES: usize>([[f32; 2]; AXES]);

impl<const AXES: usize> Range<AXES> {
    const ANY: Self = Self([[f32::NEG_INFINITY, f32::INFINITY]; AXES]);

    /// Leaves the part of it that points over `length` allow: they are rounded, and lie on pieces
    /// of uneven length.
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
