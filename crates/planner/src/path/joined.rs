//! How far the pieces of a joined move leave the line from the first one's start to the last one's
//! end.
//!
//! ```text
//!            _--o--_
//!        o--    |    --o      the pieces
//!      .        c        .    c: their centre
//!     o---------+---------o   the move
//! ```
//!
//! The centre of an arc lies as far from the middle of its chord as two thirds of the sagitta. Where
//! the ends of pieces are rounded, they lie to both sides of a line, and their centre is on it.
//!
//! So pieces of a smooth curve are joined while the centre is near the line: long chords of a curve
//! turn sharply, and cost time. Where the pieces turn sharply themselves, as the outlines of pixels
//! do, nothing of the kind can be kept, and only their ends count (see `short`).

use super::window::SHARP2;
use crate::real::{norm2, sqrt};

/// The pieces of a joined move.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joined<const AXES: usize> {
    /// From the start of the first piece to the end of the last one, mm.
    way: [f32; AXES],
    /// The centre of the pieces, from the start of the first one, mm.
    centre: [f32; AXES],
    /// All pieces, one after the other, mm.
    length: f32,
    /// Whether a piece turns sharply away from those before it.
    is_jagged: bool,
}

impl<const AXES: usize> Joined<AXES> {
    /// One piece, which leads `way` mm on.
    pub(super) fn new(way: [f32; AXES]) -> Self {
        Self {
            way,
            centre: way.map(|way| 0.5 * way),
            length: sqrt(norm2(&way)),
            is_jagged: false,
        }
    }

    /// These pieces and one more, which leads `more` mm on.
    pub(super) fn with(&self, more: &[f32; AXES]) -> Self {
        let more_length = sqrt(norm2(more));
        let length = self.length + more_length;
        let share = more_length / length;
        let mut joined = *self;
        let mut along = 0.0;
        let axes = joined.way.iter_mut().zip(&mut joined.centre).zip(more);
        for ((way, centre), more) in axes {
            along += *way * more;
            *centre += (*way + 0.5 * more - *centre) * share;
            *way += more;
        }
        let straight = sqrt(norm2(&self.way)) * more_length;
        joined.length = length;
        joined.is_jagged |= along < (1.0 - 0.5 * SHARP2) * straight;
        joined
    }

    /// The square of the distance from the centre of smooth pieces to the middle of the line, mm²;
    /// 0 for jagged ones.
    pub(super) fn off2(&self) -> f32 {
        if self.is_jagged {
            return 0.0;
        }
        let mut off = self.centre;
        for (off, way) in off.iter_mut().zip(&self.way) {
            *off -= 0.5 * way;
        }
        norm2(&off)
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
            let off = f64::from(arc.off2()).sqrt();
            prop_assert!((off / (sagitta / 1.5) - 1.0).abs() < 0.02, "{} {}", off, sagitta);
        }
    }

    #[test]
    fn pieces_to_and_fro_are_on_their_line() {
        let to_and_fro = (0..40).fold(Joined::new([0.01, 0.001]), |joined, k| {
            joined.with(&[0.01, if k % 2 == 0 { -0.002 } else { 0.002 }])
        });
        assert!(to_and_fro.off2() < 0.001 * 0.001);
    }

    #[test]
    fn pieces_that_turn_sharply_are_on_any_line() {
        let corner = Joined::new([0.01, 0.0]).with(&[0.0, 0.01]);
        assert_eq!(corner.off2(), 0.0);
        let bend = Joined::new([0.01, 0.0]).with(&[0.01, 0.003]);
        assert!(bend.off2() > 0.0);
    }
}
