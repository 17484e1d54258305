//! The distance by which the pieces of a joined move leave the line from the first one's start to
//! the last one's end.
//!
//! ```text
//!            _--o--_
//!        o--    |    --o      the pieces
//!      .        c        .    c: their centre
//!     o---------+---------o   the move
//! ```
//!
//! The centre of an arc is two thirds of the sagitta away from the middle of its chord. If
//! rounding moves the ends of pieces to both sides of a line, their centre is on the line.
//!
//! The pieces so far have the vector `W` from start to end, the length `L`, and their centre at
//! `W/2 + M/(2·L)`. One more piece with the vector `w` and the length `l` changes `M` to
//!
//! ```text
//!   M + l·W − L·w
//! ```
//!
//! Pieces of a smooth curve are joined while their centre is near the line: long chords of a curve
//! would turn sharply, and cost time. Outlines of pixels turn sharply anyway, so there the centre
//! does not matter.

use super::window::SHARP2;
use crate::real::{norm2, sqrt};

/// A piece that turns by more than half a degree away from those before it makes the joined move
/// *bent*. This is the square of the distance between the two unit vectors.
const BENT2: f32 = 1e-4;

/// The pieces of a joined move.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joined<const AXES: usize> {
    /// `W`: from the start of the first piece to the end of the last one, mm.
    way: [f32; AXES],
    /// `L`: the length of all pieces together, mm.
    length: f32,
    /// `M`, mm²: the centre lies `M/(2·L)` away from the middle of the line.
    aside: [f32; AXES],
    /// True if the pieces turn.
    pub(crate) is_bent: bool,
    /// True if a piece turns sharply away from those before it.
    is_jagged: bool,
}

impl<const AXES: usize> Joined<AXES> {
    /// One piece with the vector `way`, mm.
    pub(super) fn new(way: [f32; AXES]) -> Self {
        Self {
            way,
            length: sqrt(norm2(&way)),
            aside: [0.0; AXES],
            is_bent: false,
            is_jagged: false,
        }
    }

    /// These pieces and one more with the vector `more`, mm.
    pub(super) fn with(mut self, more: &[f32; AXES]) -> Self {
        let length = sqrt(norm2(more));
        let straight = sqrt(norm2(&self.way)) * length;
        let mut along = 0.0;
        for (axis, more) in more.iter().enumerate() {
            along += self.way[axis] * more;
            self.aside[axis] += length * self.way[axis] - self.length * more;
            self.way[axis] += more;
        }
        self.length += length;
        let turns_by_more_than = |distance2: f32| along < (1.0 - 0.5 * distance2) * straight;
        self.is_bent |= turns_by_more_than(BENT2);
        self.is_jagged |= turns_by_more_than(SHARP2);
        self
    }

    /// From the start of the first piece to the end of the last one, mm.
    pub(crate) const fn way(&self) -> [f32; AXES] {
        self.way
    }

    /// Returns true if the pieces may be one move: their centre is near the line, or they are
    /// jagged. `near2` is the square of the distance that counts as near, mm².
    pub(super) fn are_near(&self, near2: f32) -> bool {
        self.is_jagged || norm2(&self.aside) <= 4.0 * near2 * self.length * self.length
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// From the circle's equation: the middle of an arc is a sagitta away from its chord.
        #[test]
        fn the_centre_of_an_arc_is_two_thirds_of_its_sagitta_away(
            radius in 0.1f64..100.0, angle in 0.01f64..0.5, pieces in 12u32..40,
        ) {
            let at = |k: u32| {
                let turned = angle * f64::from(k) / f64::from(pieces);
                [radius * turned.sin(), radius * (1.0 - turned.cos())]
            };
            let way = |k| {
                let (from, to) = (at(k), at(k + 1));
                [0, 1].map(|axis| (to[axis] - from[axis]) as f32)
            };
            let arc = (1..pieces).fold(Joined::new(way(0)), |arc, k| arc.with(&way(k)));
            let sagitta = radius * (1.0 - (0.5 * angle).cos());
            let near2 = |share: f64| (share * sagitta / 1.5).powi(2) as f32;
            prop_assert!(arc.are_near(near2(1.02)) && !arc.are_near(near2(0.98)));
        }
    }

    #[test]
    fn pieces_to_and_fro_are_on_their_line() {
        let to_and_fro = (0..40).fold(Joined::new([0.01, 0.001]), |joined, k| {
            joined.with(&[0.01, if k % 2 == 0 { -0.002 } else { 0.002 }])
        });
        assert!(to_and_fro.are_near(0.001 * 0.001) && to_and_fro.is_bent);
    }

    #[test]
    fn pieces_that_turn_sharply_are_on_any_line() {
        let corner = Joined::new([0.01, 0.0]).with(&[0.0, 0.01]);
        assert!(corner.are_near(0.0) && corner.is_bent);
        let bend = Joined::new([0.01, 0.0]).with(&[0.01, 0.003]);
        assert!(!bend.are_near(0.0) && bend.is_bent);
        let straight = Joined::new([0.01, 0.0]).with(&[0.01, 0.0]);
        assert!(straight.are_near(0.0) && !straight.is_bent);
    }
}
