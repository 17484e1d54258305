//! The curvature of a path of short pieces, at a place at which two of them meet.
//!
//! ```text
//!             P(s)
//!        _--o------o__
//!     o--             --o
//!   P(s−h)             P(s+h)
//!
//!   k = (P(s+h) − 2·P(s) + P(s−h)) / (|P(s+h) − P(s)|·|P(s) − P(s−h)| + i(s+h) + i(s−h))
//! ```
//!
//! The curvature `k` at a place `s` of the path, measured over the length `h` to both sides, is the
//! second difference divided by the lengths of both chords. The ends of pieces lie on the curve
//! that was meant. A point `d` after the start of a piece of the length `l` lies inside that curve,
//! by `k·i` with `i = d·(l − d)/2`.
//!
//! Coordinates are rounded to a few decimals, each by up to `e`. That makes an error of `4·e/h²` in
//! `k`. So `h` begins as the length of the shorter of the two pieces, and grows until
//!
//! ```text
//!   4·e/h² ≤ ALLOWED_ERROR · max(|k|, a/x)
//! ```
//!
//! Here `x` is the lower of the two pieces' highest squared speeds, and `a` the acceleration across
//! the path. `a/x` is the least curvature that bounds the speed.
//!
//! Each length that is tried bounds the curvature from both sides by its own error. If the
//! curvature over a longer length is outside these bounds, it changes within that length, and the
//! last shorter one counts.
//!
//! If a curve goes on as at the turn before, its curvature is measured once, over the length
//! that was found at that turn. If the curvature has changed, it is compared with the curvature
//! over half that length.

use super::probe::{Probe, When};
use super::window::{Window, MM};
use crate::config::Limits;
use crate::real::{max, min, norm2, sqrt};
use crate::space::polygon::greatest;

/// The error that rounding may make, as a share of the curvature or of the least curvature that
/// bounds the speed, whichever is greater.
const ALLOWED_ERROR: f32 = 0.01;

/// The largest second difference that rounding to coordinate units can make, mm: it adds up four
/// coordinates, each off by one unit at most.
const FINEST: f32 = 4.0 * MM;

/// A length is long enough if its square is too small by no more than this factor.
const NEAR_ENOUGH: f32 = 1.1;

/// A length that was long enough at the turn before is still long enough if its square is too small
/// by no more than this factor.
const STILL_NEAR_ENOUGH: f32 = 1.4;

/// If less than this share of the length's square would be enough for rounding, the next turn tries
/// [`SHORTER`] of the length.
const TOO_LONG: f32 = 0.5;
const SHORTER: f32 = 0.75;

/// A piece is taken for a chord of the curve if it is at most this many times as long as the
/// shorter of the two pieces that meet. With 2, a line beside a curve would more often be taken for
/// a chord.
const ONE_CURVE: f32 = 1.5;

/// The greatest length, in lengths of the shorter of the two pieces.
const LONGEST: f32 = 32.0;

/// The greatest length, mm.
const FARTHEST: f32 = 32.0;

/// The curvatures of two turns are alike if they differ by no more than this share of
/// [`Meeting::reference`].
const ALIKE: f32 = 0.2;

/// A curvature is compared anew with the curvature over a shorter length once it differs by more
/// than this share of [`Meeting::reference`] from the last one compared.
const DRIFT: f32 = 0.05;

/// The greatest error of a second difference, in roundings of a point.
const OFF: f32 = 4.0;

/// A curvature over the acceleration of each axis, s²/mm², and the length to both sides over which
/// it holds, mm.
pub(super) type Curved<const AXES: usize> = ([f32; AXES], f32);

/// Two pieces that meet: the values that decide over which length the curvature is measured.
/// Lengths in mm.
struct Meeting {
    /// Lengths of the two pieces.
    lengths: [f32; 2],
    /// The shorter of these.
    shorter: f32,
    /// The length up to which a piece is taken for a chord of the curve.
    chord: f32,
    /// 1/(highest squared speed) of the slower piece, s²/mm².
    per_top_v2: f32,
    rounding: f32,
}

impl<const AXES: usize> Window<AXES> {
    /// The curvature at the start of a piece; `None` if more path has to be known for it.
    pub(super) fn curved(
        &self,
        number: u32,
        limits: &Limits<AXES>,
        when: When,
        probe: &mut Probe<AXES>,
    ) -> Option<Curved<AXES>> {
        probe.goes_on = false;
        let meeting = self.meeting(number);
        let wanted = min(max(probe.wanted, meeting.shorter), meeting.longest());
        let room = min(self.room_ahead(number), self.room_behind(number));
        let reach = min(wanted, room);
        let bend = self.curvature(number, reach, meeting.chord, limits, &mut probe.pieces);
        let reference = meeting.reference(&bend);
        let longer2 = meeting.error(&bend, reach, limits);
        let is_shortest = reach <= meeting.shorter;
        if is_shortest && longer2 <= NEAR_ENOUGH {
            probe.compared = sqrt(curvature2(&bend, limits));
            return Some((bend, reach));
        }
        let is_long_enough = longer2 <= STILL_NEAR_ENOUGH || reach < wanted;
        let goes_on = is_long_enough
            && self.is_as_before(number, &meeting, (&bend, reference), limits, probe)
            && self.is_steady(number, &meeting, (&bend, reach), limits, probe);
        if goes_on {
            if longer2 < TOO_LONG {
                probe.wanted *= SHORTER;
            }
            probe.goes_on = true;
            return Some((bend, reach));
        }
        let curved = self.search(number, (&meeting, room), limits, when, probe)?;
        probe.compared = sqrt(curvature2(&curved.0, limits));
        Some(curved)
    }

    /// Tries one length after the other, beginning with the length of the shorter piece.
    fn search(
        &self,
        number: u32,
        (meeting, room): (&Meeting, f32),
        limits: &Limits<AXES>,
        when: When,
        probe: &mut Probe<AXES>,
    ) -> Option<Curved<AXES>> {
        let known = if when == When::Known && self.is_open(number) {
            self.room_ahead(number)
        } else {
            f32::INFINITY
        };
        let mut range = Range::ANY;
        let mut closer: Option<Curved<AXES>> = None;
        let mut length = meeting.shorter;
        loop {
            probe.wanted = length;
            if known < length {
                return None;
            }
            let reach = min(length, room);
            let curved = self.curvature(number, reach, meeting.chord, limits, &mut probe.pieces);
            let bend = range.nearest(&curved);
            let longer2 = meeting.error(&bend, reach, limits);
            if reach < length {
                // The length cannot grow because of a rest, a sharp turn or the end of the path.
                // Motion is slow there, so the straightest path within the bounds is good enough.
                range.narrow(&curved, reach, meeting, limits);
                return Some((range.nearest(&[0.0; AXES]), reach));
            }
            if let Some(closer) = closer.filter(|_| bend != curved) {
                probe.wanted = closer.1;
                return Some(closer);
            }
            if longer2 <= NEAR_ENOUGH || length >= meeting.longest() {
                return Some((bend, reach));
            }
            closer = Some((bend, reach));
            range.narrow(&curved, reach, meeting, limits);
            length = min(length * min(sqrt(longer2), 2.0), meeting.longest());
        }
    }

    /// Returns how the piece meets the one before it.
    fn meeting(&self, number: u32) -> Meeting {
        let (before, after) = (self.placed(number.wrapping_sub(1)), self.placed(number));
        let shorter = max(min(before.length, after.length), f32::MIN_POSITIVE);
        Meeting {
            lengths: [before.length, after.length],
            shorter,
            chord: ONE_CURVE * shorter,
            per_top_v2: max(before.piece.per_top_v2, after.piece.per_top_v2),
            rounding: max(before.piece.rounding, after.piece.rounding),
        }
    }

    /// The curvature measured over a length to both sides, divided by the acceleration of each
    /// axis, s²/mm². It is exact on a circle in pieces of the same length, none of them longer than
    /// `chord`. The caller has checked that the path is that long to both sides.
    pub(super) fn curvature(
        &self,
        number: u32,
        length: f32,
        chord: f32,
        limits: &Limits<AXES>,
        pieces: &mut [u32; 2],
    ) -> [f32; AXES] {
        let (mut bend, area) = self.aside(number, length, chord, pieces);
        let per_length2 = 1.0 / area;
        for (bend, per_acceleration) in bend.iter_mut().zip(&limits.per_acceleration) {
            // Anything less may be rounding: the path is straight.
            *bend = if bend.abs() > FINEST {
                *bend * per_length2 * per_acceleration
            } else {
                0.0
            };
        }
        bend
    }

    /// Returns true if a curvature is still the one that was last compared with the curvature over
    /// a shorter length. If it has changed, it is compared again: whether the curvature over half
    /// the length is the same, except for rounding.
    ///
    /// Without this, small changes could add up from turn to turn. When a line becomes a curve,
    /// the curvature of the path changes at once, but the curvature over a length grows little by
    /// little.
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
        if drift <= DRIFT * meeting.reference(bend) * curvature {
            return true;
        }
        let shorter = max(0.5 * reach, meeting.shorter);
        let closer = self.curvature(number, shorter, meeting.chord, limits, &mut [0; 2]);
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

    /// Returns true if a curvature is like the one at the turn before, and explains the turn
    /// between the two pieces, except for rounding.
    fn is_as_before(
        &self,
        number: u32,
        meeting: &Meeting,
        (bend, reference): (&[f32; AXES], f32),
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
        let near = ALIKE * reference;
        let turns = from.iter().zip(to).zip(&limits.acceleration);
        let mut axes = turns.zip(bend.iter().zip(&probe.before));
        axes.all(|(((from, to), acceleration), (bend, last))| {
            let aside = (to - from - bend * acceleration * half) * before * after;
            aside.abs() <= off && (bend - last).abs() <= near
        })
    }
}

impl Meeting {
    /// The greatest length over which the curvature is measured, mm.
    fn longest(&self) -> f32 {
        min(LONGEST * self.shorter, FARTHEST)
    }

    /// The value that errors and changes are compared with: the curvature, or the least curvature
    /// that bounds the speed if that is greater, s²/mm².
    fn reference(&self, bend: &[f32]) -> f32 {
        max(greatest(bend), self.per_top_v2)
    }

    /// The error of a curvature measured over a length, divided by the allowed error. Error and
    /// curvature both lie across the path, so the axes share the error in the same proportion.
    /// If the path does not turn, all of the error is taken to be on the weakest axis.
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
        let allowed = ALLOWED_ERROR * max(worst, self.per_top_v2);
        OFF * self.rounding * per_acceleration / (length * length * allowed)
    }
}

/// The square (1/mm²) of a curvature that is given divided by the acceleration of each axis.
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

    /// Narrows the range by the curvature `bend` that was measured over `length`. Its error comes
    /// from rounded points, and from points on pieces of uneven length.
    fn narrow(&mut self, bend: &[f32; AXES], length: f32, of: &Meeting, limits: &Limits<AXES>) {
        let per_length2 = 1.0 / (length * length);
        let longer = max(of.lengths[0], of.lengths[1]);
        let rounded = OFF * of.rounding * per_length2;
        let uneven = 0.25 * (longer * longer - of.shorter * of.shorter) * per_length2;
        let axes = bend.iter().zip(&limits.per_acceleration);
        for ([low, high], (bend, per_acceleration)) in self.0.iter_mut().zip(axes) {
            let off = rounded * per_acceleration + uneven * bend.abs();
            (*low, *high) = (
                max(*low, min(*high, bend - off)),
                min(*high, max(*low, bend + off)),
            );
        }
    }

    /// The curvature within the range that is nearest to `bend`.
    fn nearest(&self, bend: &[f32; AXES]) -> [f32; AXES] {
        let mut nearest = *bend;
        for (nearest, [low, high]) in nearest.iter_mut().zip(&self.0) {
            *nearest = max(min(*nearest, *high), *low);
        }
        nearest
    }
}
