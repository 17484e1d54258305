//! The curvature of a path of short pieces, at a place where two of them meet.
//!
//! ```text
//!             P(s)               The curvature at a place s of the path, over the length h to both sides, is its second difference
//!        _--o------o__
//!     o--             --o              k = (P(s+h) − 2·P(s) + P(s−h)) / h²
//!   P(s−h)             P(s+h)
//! ```
//!
//! Coordinates are rounded to a few decimals, each by up to `e`, which makes an error of `4·e/h²`. So `h` begins as the length of the
//! shorter of the two pieces. It grows while the error would cost more than [`QUIET`] of the speed:
//!
//! ```text
//!   4·e/h² ≤ QUIET · max(|k|, a/x)      x: the highest squared speed that the pieces may have
//! ```
//!
//! Each length that is tried bounds the curvature from both sides by its own error. The result keeps all of these bounds, so it bends
//! the path by no more than rounding does.
//!
//! A curve that goes on as it did at the turn before needs two lengths: that of the shorter piece, and the one that was found there.

use super::window::{Window, MM};
use crate::config::Limits;
use crate::real::{least, most, norm2, sqrt};

/// Share of the acceleration, or of the curvature, that rounding may make up.
const QUIET: f32 = 0.01;

/// Four points of which each is off by one unit, mm.
const FINEST: f32 = 4.0 * MM;

/// The length squared is long enough within this factor.
const NEAR_ENOUGH: f32 = 1.1;

/// The same for a length that was long enough at the turn before.
const STILL_NEAR_ENOUGH: f32 = 1.4;

/// The length grows to this many times the shorter of the two pieces at most.
const LONGEST: f32 = 32.0;

/// And to no more than this, mm.
const FARTHEST: f32 = 32.0;

/// By this share of the quietest curvature two turns may differ and still be alike.
const ALIKE: f32 = 0.2;

/// The second difference of three points may be off by this many times their rounding.
const OFF: f32 = 4.0;

/// A curvature, and the length to both sides over which it holds, mm.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Curved<const AXES: usize> {
    /// By the accelerations of the axes, s²/mm².
    pub(super) bend: [f32; AXES],
    pub(super) reach: f32,
}

/// How far the search for the curvature at one turn has come.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search<const AXES: usize> {
    /// The length that is tried next, mm; 0: none was tried.
    length: f32,
    range: Range<AXES>,
    /// Whether that length is the one of the turn before.
    is_predicted: bool,
}

impl<const AXES: usize> Search<AXES> {
    pub(super) const NEW: Self = Self {
        length: 0.0,
        range: Range([[0.0; 2]; AXES]),
        is_predicted: false,
    };
}

/// The place of a turn, as far as the search needs it.
struct Meeting {
    /// Lengths of the two pieces, mm.
    shorter: f32,
    /// The square of the longer one less that of the shorter one.
    uneven2: f32,
    /// 1/(highest squared speed).
    per_top_v2: f32,
    /// mm.
    rounding: f32,
}

impl<const AXES: usize> Window<AXES> {
    /// The curvature at the start of a piece; `None` where the path has to go on for that, and not `now`.
    pub(super) fn curved(
        &self,
        number: u32,
        limits: &Limits<AXES>,
        now: bool,
        search: &mut Search<AXES>,
    ) -> Option<Curved<AXES>> {
        let meeting = self.meeting(number);
        if search.length == 0.0 {
            if let Some(found) = self.by_the_two_pieces(number, &meeting, limits, search) {
                return Some(found);
            }
        }
        let room_behind = self.room_behind(number);
        let (room_ahead, is_open) = self.room_ahead(number);
        loop {
            let length = search.length;
            if room_ahead < length && is_open && !now {
                return None;
            }
            let reach = least(length, least(room_ahead, room_behind));
            let (ahead, behind) = (self.ahead(number, reach), self.behind(number, reach));
            let (bend, weakest) = curvature(&ahead, &behind, limits);
            if search.is_predicted && !self.is_as_before(&bend, &meeting) {
                search.is_predicted = false;
                search.length = 2.0 * meeting.shorter;
                continue;
            }
            let is_cut_short = reach < length;
            if is_cut_short && !(room_ahead < length && is_open) {
                // Near a rest or a sharp turn motion is slow: the straightest path is enough.
                search.range.narrow(&bend, reach, &meeting, limits);
                let bend = search.range.nearest(&[0.0; AXES]);
                return Some(Curved { bend, reach });
            }
            let curved = bend;
            let bend = search.range.nearest(&curved);
            let longer2 = meeting.error(&bend, weakest, reach);
            let enough = if search.is_predicted {
                STILL_NEAR_ENOUGH
            } else {
                NEAR_ENOUGH
            };
            if longer2 <= enough || is_cut_short || length >= meeting.longest() {
                return Some(Curved { bend, reach });
            }
            search.range.narrow(&curved, reach, &meeting, limits);
            search.is_predicted = false;
            search.length *= least(sqrt(longer2), 2.0);
        }
    }

    /// The curvature by the two pieces alone, where that is good enough; else the search goes on from there.
    fn by_the_two_pieces(
        &self,
        number: u32,
        meeting: &Meeting,
        limits: &Limits<AXES>,
        search: &mut Search<AXES>,
    ) -> Option<Curved<AXES>> {
        let length = meeting.shorter;
        let ahead = self.placed(number).along(length);
        let behind = self.placed(number.wrapping_sub(1)).along(-length);
        let (bend, weakest) = curvature(&ahead, &behind, limits);
        let longer2 = meeting.error(&bend, weakest, length);
        if longer2 <= NEAR_ENOUGH || length >= meeting.longest() {
            return Some(Curved {
                bend,
                reach: length,
            });
        }
        search.range = Range::ANY;
        search.range.narrow(&bend, length, meeting, limits);
        let before = &self.settled;
        search.is_predicted = before.reach > length && search.range.has(&before.bend);
        search.length = if search.is_predicted {
            least(before.reach, meeting.longest())
        } else {
            length * least(sqrt(longer2), 2.0)
        };
        None
    }

    fn meeting(&self, number: u32) -> Meeting {
        let (before, after) = (self.placed(number.wrapping_sub(1)), self.placed(number));
        let shorter = most(least(before.length, after.length), f32::MIN_POSITIVE);
        let longer = most(before.length, after.length);
        Meeting {
            shorter,
            uneven2: longer * longer - shorter * shorter,
            per_top_v2: 1.0 / least(before.piece.top_v2, after.piece.top_v2),
            rounding: most(before.piece.rounding, after.piece.rounding),
        }
    }

    /// Whether a curvature is like that of the turn before.
    fn is_as_before(&self, bend: &[f32; AXES], meeting: &Meeting) -> bool {
        let before = &self.settled.bend;
        let near = ALIKE * meeting.loudness(before);
        let mut axes = before.iter().zip(bend);
        axes.all(|(before, bend)| (bend - before).abs() <= near)
    }
}

impl Meeting {
    fn longest(&self) -> f32 {
        least(LONGEST * self.shorter, FARTHEST)
    }

    /// The greater of a curvature and of the least one that bounds the speed, s²/mm².
    fn loudness(&self, bend: &[f32]) -> f32 {
        let worst = bend.iter().fold(0.0, |worst, b| most(worst, b.abs()));
        most(worst, self.per_top_v2)
    }

    /// The error of a curvature over a length by the error that is allowed; `weakest` as in [`curvature`].
    fn error(&self, bend: &[f32], weakest: f32, length: f32) -> f32 {
        OFF * self.rounding * weakest / (QUIET * length * length * self.loudness(bend))
    }
}

/// Between which values the curvature lies, for each axis.
#[derive(Clone, Copy, Debug)]
struct Range<const AXES: usize>([[f32; 2]; AXES]);

impl<const AXES: usize> Range<AXES> {
    const ANY: Self = Self([[f32::NEG_INFINITY, f32::INFINITY]; AXES]);

    /// Leaves the part of it that points over `length` allow: they are rounded, and lie on pieces of uneven length.
    fn narrow(&mut self, bend: &[f32; AXES], length: f32, of: &Meeting, limits: &Limits<AXES>) {
        let per_length2 = 1.0 / (length * length);
        let rounded = OFF * of.rounding * per_length2;
        let uneven = 0.25 * of.uneven2 * per_length2;
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

    fn has(&self, bend: &[f32; AXES]) -> bool {
        let mut axes = self.0.iter().zip(bend);
        axes.all(|([low, high], bend)| low <= bend && bend <= high)
    }
}

/// The curvature, by accelerations, between two ways of the same length, exact on a circle; and 1/acceleration of the weakest axis that
/// moves.
pub(super) fn curvature<const AXES: usize>(
    ahead: &[f32; AXES],
    behind: &[f32; AXES],
    limits: &Limits<AXES>,
) -> ([f32; AXES], f32) {
    let per_length2 = 1.0 / sqrt(norm2(ahead) * norm2(behind));
    let (mut bend, mut weakest) = ([0.0; AXES], 0.0);
    let axes = ahead.iter().zip(behind).zip(&limits.per_acceleration);
    for (bend, ((ahead, behind), per_acceleration)) in bend.iter_mut().zip(axes) {
        let aside = ahead + behind;
        // Coordinates are no finer.
        if aside.abs() > FINEST {
            *bend = aside * per_length2 * per_acceleration;
        }
        if *ahead != 0.0 || *behind != 0.0 {
            weakest = most(weakest, *per_acceleration);
        }
    }
    (bend, weakest)
}
