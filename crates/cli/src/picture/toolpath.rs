//! The path that the tool took.

use leadscrew_sim::scene::{Drawn, Way};

/// The use of the tool along a stroke.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum StrokeKind {
    /// A rapid (G0), a jog, or the machine driving itself.
    Travel,
    /// A feed move; `shade` is the output's power, 0 (off) to [`StrokeKind::SHADES`] (full).
    Cut {
        /// Power in steps of 1/[`StrokeKind::SHADES`].
        shade: u8,
    },
}

impl StrokeKind {
    /// Shades between off and full power.
    pub(crate) const SHADES: u8 = 255;

    /// A feed move at `share` of full power, 0 to 1.
    pub(crate) fn cut(share: f64) -> Self {
        Self::Cut {
            shade: (share * f64::from(Self::SHADES)).round() as u8,
        }
    }
}

/// Collects the moves of a job.
#[derive(Clone, Debug)]
pub(crate) struct Toolpath {
    /// `None` where only distances are wanted.
    moves: Option<Vec<Drawn>>,
    /// The line that asks for the following motion, counted from 1; 0 for none.
    pub(crate) line: u32,
    /// Where the tool went down and up again without moving aside: X and Y in mm.
    holes: Vec<[f32; 2]>,
    /// Whether the last move went straight down at feed.
    plunged: bool,
    at: [f64; 3],
    start: [f64; 3],
    cut_mm: f64,
    travel_mm: f64,
    /// The corners of the box around all feed moves.
    cut: Option<[[f64; 3]; 2]>,
}

impl Toolpath {
    /// Starts at `start`, X, Y, Z in mm. Strokes are kept only where they are to be `drawn`: memory stays flat otherwise.
    pub(crate) fn new(start: [f64; 3], drawn: bool) -> Self {
        Self {
            moves: drawn.then(|| vec![begin(start)]),
            line: 0,
            holes: Vec::new(),
            plunged: false,
            at: start,
            start,
            cut_mm: 0.0,
            travel_mm: 0.0,
            cut: None,
        }
    }

    /// Whether strokes are kept.
    pub(crate) fn is_drawn(&self) -> bool {
        self.moves.is_some()
    }

    /// The lowest and the highest X, Y and Z of all feed moves, mm; `None` where there was none.
    pub(crate) fn cut_bounds(&self) -> Option<[[f64; 3]; 2]> {
        self.cut
    }

    fn widen(&mut self, point: [f64; 3]) {
        let [low, high] = self.cut.get_or_insert([point; 2]);
        for axis in 0..3 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    }

    /// Goes on to `target`, X, Y, Z in mm.
    pub(crate) fn go(&mut self, target: [f64; 3], kind: StrokeKind) {
        let length = distance(self.at, target);
        match kind {
            StrokeKind::Travel => self.travel_mm += length,
            StrokeKind::Cut { .. } => {
                self.cut_mm += length;
                self.widen(self.at);
                self.widen(target);
            }
        }
        let (from, to) = (flat(self.at), flat(target));
        let rise = target[2] - self.at[2];
        self.at = target;
        let Some(moves) = &mut self.moves else {
            return;
        };
        moves.push(Drawn {
            to: target.map(|mm| mm as f32),
            line: self.line,
            way: match kind {
                StrokeKind::Travel => Way::Travel,
                StrokeKind::Cut { .. } => Way::Cut,
            },
            power: match kind {
                StrokeKind::Travel => 0.0,
                StrokeKind::Cut { shade } => f32::from(shade) / f32::from(StrokeKind::SHADES),
            },
        });
        if from == to {
            // A hole may be drilled in several strokes.
            if self.plunged && rise > 0.0 && self.holes.last() != Some(&to) {
                self.holes.push(to);
            }
            self.plunged = rise < 0.0 && kind != StrokeKind::Travel;
            return;
        }
        self.plunged = false;
    }

    /// Length of the feed moves, mm.
    pub(crate) fn cut_mm(&self) -> f64 {
        self.cut_mm
    }

    /// Length of all other moves, mm.
    pub(crate) fn travel_mm(&self) -> f64 {
        self.travel_mm
    }

    /// All moves, in order: the first is where the path begins.
    pub(crate) fn moves(&self) -> &[Drawn] {
        self.moves.as_deref().unwrap_or_default()
    }

    /// Drilled holes, in order: X and Y in mm.
    pub(crate) fn holes(&self) -> &[[f32; 2]] {
        &self.holes
    }

    /// Where the path starts and ends: X and Y in mm.
    pub(crate) fn ends(&self) -> [[f32; 2]; 2] {
        [flat(self.start), flat(self.at)]
    }

    /// The smallest and the largest X and Y of the path, mm.
    pub(crate) fn bounds(&self) -> [[f32; 2]; 2] {
        let first = flat(self.start);
        let points = self.moves().iter().map(|one| [one.to[0], one.to[1]]);
        points.fold([first, first], |[low, high], p| {
            [
                [low[0].min(p[0]), low[1].min(p[1])],
                [high[0].max(p[0]), high[1].max(p[1])],
            ]
        })
    }
}

fn begin(at: [f64; 3]) -> Drawn {
    Drawn {
        to: at.map(|mm| mm as f32),
        line: 0,
        way: Way::Jump,
        power: 0.0,
    }
}

fn flat(point: [f64; 3]) -> [f32; 2] {
    [point[0] as f32, point[1] as f32]
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_move_is_kept_and_lengths_add_up() {
        let mut path = Toolpath::new([0.0; 3], true);
        path.go([3.0, 4.0, 0.0], StrokeKind::Travel);
        path.go([3.0, 4.0, -2.0], StrokeKind::cut(0.0));
        path.go([6.0, 4.0, -2.0], StrokeKind::cut(0.0));
        path.go([6.0, 8.0, -2.0], StrokeKind::cut(0.0));
        path.go([6.0, 9.0, -2.0], StrokeKind::cut(1.0));
        assert_eq!(path.moves().len(), 6);
        assert_eq!((path.travel_mm(), path.cut_mm()), (5.0, 10.0));
        assert_eq!(path.bounds(), [[0.0, 0.0], [6.0, 9.0]]);
    }

    #[test]
    fn down_and_up_again_is_a_hole_and_a_plunge_into_a_cut_is_none() {
        let mut path = Toolpath::new([0.0; 3], true);
        for y in [1.0, 2.0] {
            path.go([5.0, y, 0.0], StrokeKind::Travel);
            for depth in [-1.0, 0.5, -2.0, 1.0] {
                let kind = if depth < 0.0 {
                    StrokeKind::cut(0.0)
                } else {
                    StrokeKind::Travel
                };
                path.go([5.0, y, depth], kind);
            }
        }
        path.go([5.0, 2.0, -1.0], StrokeKind::cut(0.0));
        path.go([9.0, 2.0, -1.0], StrokeKind::cut(0.0));
        path.go([9.0, 2.0, 1.0], StrokeKind::Travel);
        assert_eq!(path.holes(), [[5.0, 1.0], [5.0, 2.0]]);
    }
}
