//! How fast a path may turn where two of its pieces meet.
//!
//! A turn of less than 22 degrees may be part of a smooth curve: then its curvature bounds the squared speed, and so does junction
//! deviation, unless the curve explains the turn. It does where the points need to be off by no more than rounding makes them.
//!
//! A sharper turn is a corner. Between short pieces its curvature counts as well, over two pieces to both sides: turns to and fro cancel.

use super::curvature::{curvature, Search};
use super::window::{Placed, Window};
use crate::config::Limits;
use crate::path::junction::junction_v2;
use crate::real::{least, most};
use crate::space::polygon::cap;

/// The path about a corner is looked at no farther than this, mm.
const FARTHEST: f32 = 32.0;

/// How a path turns where two pieces meet.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Turn<const AXES: usize> {
    /// Curvature by accelerations, s²/mm².
    pub(crate) bend: [f32; AXES],
    /// How far it reaches to both sides, mm; 0: it is none.
    pub(crate) reach: f32,
    /// Highest squared speed, mm²/s².
    pub(crate) v2: f32,
}

impl<const AXES: usize> Turn<AXES> {
    /// A start from rest.
    pub(crate) const REST: Self = Self::corner(0.0);

    /// A corner, which has no curvature: the jump of its speed is what `$11` allows.
    pub(crate) const fn corner(v2: f32) -> Self {
        Self {
            bend: [0.0; AXES],
            reach: 0.0,
            v2,
        }
    }
}

impl<const AXES: usize> Window<AXES> {
    /// The turn at the start of a piece; `None` where the path has to go on for that, and not `now`.
    pub(super) fn turn(
        &self,
        number: u32,
        limits: &Limits<AXES>,
        now: bool,
        search: &mut Search<AXES>,
    ) -> Option<Turn<AXES>> {
        if self.is_sharp(number) {
            return self.corner(number, limits, now).map(Turn::corner);
        }
        let curved = self.curved(number, limits, now, search)?;
        let (before, after) = (self.placed(number.wrapping_sub(1)), self.placed(number));
        let corner = if explains(&curved.bend, before, after, limits) {
            f32::INFINITY
        } else {
            junction_v2(&before.piece.direction, &after.piece.direction, limits)
        };
        let is_straight = curved.bend == [0.0; AXES];
        Some(Turn {
            v2: least(corner, cap(&curved.bend)),
            reach: if is_straight { 0.0 } else { curved.reach },
            bend: curved.bend,
        })
    }

    /// The highest squared speed at a corner, mm²/s².
    fn corner(&self, number: u32, limits: &Limits<AXES>, now: bool) -> Option<f32> {
        let (before, after) = (self.placed(number.wrapping_sub(1)), self.placed(number));
        let (u0, u1) = (&before.piece.direction, &after.piece.direction);
        let corner = junction_v2(u0, u1, limits);
        let shorter = least(before.length, after.length);
        let (bend, _) = curvature(&u1.map(|u| u * shorter), &u0.map(|u| -u * shorter), limits);
        if corner < cap(&bend) {
            return Some(corner);
        }
        if self.is_last(number) && !now {
            return None;
        }
        let two_before = before.length + self.length_of(number.wrapping_sub(2));
        let two_after = after.length + self.length_of(number.wrapping_add(1));
        let wanted = least(least(two_before, two_after), FARTHEST);
        let length = least(
            wanted,
            least(self.all_ahead(number), self.all_behind(number)),
        );
        let (ahead, behind) = (self.ahead(number, length), self.behind(number, length));
        let (bend, _) = curvature(&ahead, &behind, limits);
        Some(least(corner, cap(&bend)))
    }
}

/// Whether a curve explains a turn: rounding may have made the rest of it.
fn explains<const AXES: usize>(
    bend: &[f32; AXES],
    before: &Placed<AXES>,
    after: &Placed<AXES>,
    limits: &Limits<AXES>,
) -> bool {
    if before.piece.is_chord && after.piece.is_chord {
        return true;
    }
    let all = before.length + after.length;
    let share = before.length * after.length / most(all, f32::MIN_POSITIVE);
    let (from, to) = (&before.piece.direction, &after.piece.direction);
    let mut axes = from.iter().zip(to).zip(bend).zip(&limits.rounding);
    axes.all(|(((from, to), bend), (per_acceleration, rounding))| {
        let curved = 0.5 * all * bend / per_acceleration;
        (to - from - curved).abs() * share <= 2.0 * rounding
    })
}
