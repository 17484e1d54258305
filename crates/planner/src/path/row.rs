//! A row of a raster: moves that go straight on at one feed and differ only in power are planned as
//! one move.
//!
//! ```text
//!   X1 S10   X2 S80   G0 X2.5 S0   G1 X3 S40        one planned move, its first power 10,
//!   |--------|========|            |----|     -->   and the pixels 80, 0, 40
//! ```
//!
//! See [`crate::emit::pixel`].
//!
//! The look-ahead is limited to a number `N` of moves. If each pixel of 0.1 mm were a move, 1024
//! moves would let a machine of 500 mm/s² go no faster than 320 mm/s (`√(2·a·N·L)`).
//!
//! All moves of a row belong to a laser, go on in exactly the same direction (counted in steps),
//! and have the same feed in mm/min and the same mode. So neither the limits nor the corner before
//! the row change as it grows.
//!
//! A short rapid between pixels (`G0 … S0`) belongs to the row: it gets the row's speed and no
//! power. By itself, in a gap of length `L`, a rapid would accelerate from the speed `v` until its
//! middle. That would save no more than the share `a·L/4v²` of its time. If that is less than a
//! thousandth, the gap is part of the row. A longer gap is a move of its own. Of such gaps and the
//! rows between them at most 250 lie in the distance `v²/2a` that stopping takes.

use crate::built::RASTERS;
use crate::emit::pixel::{Packed, Pixel};
use crate::{Feed, Move, MoveKind, MovePower};
use leadscrew_stepper::{Line, Power};

/// The last queued move, while the next one may be merged into it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Row<const MOTORS: usize> {
    /// Steps of each motor, with signs.
    delta: [i32; MOTORS],
    /// The motor with the most steps.
    dominant: usize,
    /// Power at its end.
    power: MovePower,
    /// The step of the dominant motor at which this power began.
    changed: u32,
    /// Feed, mm/s.
    feed: f32,
}

impl<const MOTORS: usize> Row<MOTORS> {
    /// Begins with a move by `delta` steps; `None` if it has no laser power, is a chord of an
    /// arc, or is no feed move in mm/min.
    pub(crate) fn begin<const AXES: usize>(of: &Move<AXES>, delta: [i32; MOTORS]) -> Option<Self> {
        match of.power {
            MovePower::Off | MovePower::Spindle { .. } => None,
            MovePower::Constant { .. } | MovePower::Dynamic { .. } if !RASTERS => None,
            MovePower::Constant { .. } | MovePower::Dynamic { .. } => Some(Self {
                feed: row_feed(of)?,
                delta,
                dominant: dominant(&delta),
                power: of.power,
                changed: 0,
            }),
        }
    }

    /// The row with one more move, and the pixel that it adds; `None` if the row does not go on.
    pub(crate) fn extended<const AXES: usize>(
        &self,
        of: &Move<AXES>,
        delta: [i32; MOTORS],
    ) -> Option<(Self, Packed)> {
        let power = self.part(of)?;
        let longer = self.longer(&delta)?;
        let changed = self.along(&self.delta).unsigned_abs();
        let pixel = Pixel {
            after: changed - self.changed,
            power,
            line_number: of.line_number,
        };
        let row = Self {
            delta: longer,
            power: self.power.with(power),
            changed,
            ..*self
        };
        Some((row, pixel.packed()?))
    }

    /// Steps of each motor over the whole row.
    pub(crate) const fn delta(&self) -> [i32; MOTORS] {
        self.delta
    }

    /// The row's steps together with `delta`. `None` if `delta` leads in another direction, or
    /// the sum is more than one line can have.
    fn longer(&self, delta: &[i32; MOTORS]) -> Option<[i32; MOTORS]> {
        let (way, on) = (self.along(&self.delta), self.along(delta));
        if (way > 0) != (on > 0) {
            return None;
        }
        let mut longer = *delta;
        for (steps, so_far) in longer.iter_mut().zip(self.delta) {
            if i64::from(*steps) * i64::from(way) != i64::from(so_far) * i64::from(on) {
                return None;
            }
            *steps = steps.checked_add(so_far)?;
        }
        Line::new(longer).ok().map(|_| longer)
    }

    /// Steps of the row's dominant motor in `delta`.
    fn along(&self, delta: &[i32; MOTORS]) -> i32 {
        delta.get(self.dominant).copied().unwrap_or(0)
    }

    /// The power of a move that may be a part of the row; `None` if it may not.
    fn part<const AXES: usize>(&self, of: &Move<AXES>) -> Option<Power> {
        let power = of.power.programmed();
        let fits = match of.power {
            MovePower::Spindle { .. } => false,
            MovePower::Off => is_gap(of),
            MovePower::Constant { .. } | MovePower::Dynamic { .. } => {
                self.power.with(power) == of.power && row_feed(of) == Some(self.feed)
            }
        };
        (fits && of.outputs.is_none()).then_some(power)
    }
}

/// The motor with the most steps.
fn dominant<const MOTORS: usize>(delta: &[i32; MOTORS]) -> usize {
    let steps = delta.iter().map(|steps| steps.unsigned_abs());
    steps
        .enumerate()
        .max_by_key(|(_, steps)| *steps)
        .map_or(0, |(motor, _)| motor)
}

/// The feed, mm/s, of a move that may be part of a row; `None` if it may not.
fn row_feed<const AXES: usize>(of: &Move<AXES>) -> Option<f32> {
    if of.kind != MoveKind::Feed || of.curve.is_some() {
        return None;
    }
    match of.feed {
        Feed::PerMinute(feed) => Some(feed),
        Feed::Rapid | Feed::InverseTime(_) => None,
    }
}

/// Returns true if a move is a straight rapid. [`is_short`] tells whether such a rapid may be part
/// of a row.
pub(crate) fn is_gap<const AXES: usize>(of: &Move<AXES>) -> bool {
    of.kind == MoveKind::Rapid && of.curve.is_none()
}

/// Returns true if a rapid of `length` mm saves next to no time over a row at `speed` mm/s, on a
/// machine with the acceleration `acceleration`, mm/s².
pub(crate) fn is_short(length: f32, speed: f32, acceleration: f32) -> bool {
    /// The value of `a·L/v²` that saves a thousandth of the time.
    const LITTLE: f32 = 4.0 / 1000.0;
    acceleration * length <= LITTLE * speed * speed
}

#[cfg(test)]
mod tests;
