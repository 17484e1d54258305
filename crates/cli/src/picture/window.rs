//! The part of the plane that a picture shows.
//!
//! Usually it is the whole path, so that the way from home to the work is visible. But if the work
//! would then be a dot, only the work is shown, and the way to it ends at the frame.

use super::page::{MOST_HEIGHT, PLOT_WIDTH};
use leadscrew_sim::scene::{Drawn, Hole, Toolpath, Way};

/// Only the work is shown if this makes it at least this many times as large.
const ENOUGH: f64 = 4.0;
/// Room around the work, mm, which a single hole needs.
const AROUND: f32 = 2.0;

/// A rectangle of the plane.
pub(super) struct Window {
    pub(super) low: [f32; 2],
    pub(super) high: [f32; 2],
    /// True if the path goes beyond the rectangle.
    pub(super) path_leaves: bool,
}

impl Window {
    /// The part to show of a path that has these holes, and of the box between the ends of the travel of X
    /// and Y.
    pub(super) fn onto(path: &Toolpath, holes: &[Hole], travel: Option<[[f32; 2]; 2]>) -> Self {
        let [mut low, mut high] = path.bounds();
        for (axis, [begin, end]) in travel.into_iter().flatten().enumerate() {
            (low[axis], high[axis]) = (low[axis].min(begin), high[axis].max(end));
        }
        let whole = Self {
            low,
            high,
            path_leaves: false,
        };
        let (Some(x), Some(y)) = (extent(path, holes, 0), extent(path, holes, 1)) else {
            return whole;
        };
        let work = Self {
            low: [x[0], y[0]].map(|low| low - AROUND),
            high: [x[1], y[1]].map(|high| high + AROUND),
            path_leaves: true,
        };
        match work.per_mm() >= ENOUGH * whole.per_mm() {
            true => work,
            false => whole,
        }
    }

    /// Pixels per millimetre with which the window fills the largest plot.
    fn per_mm(&self) -> f64 {
        let side = |axis: usize| f64::from(self.high[axis] - self.low[axis]).max(1e-3);
        (PLOT_WIDTH / side(0)).min(MOST_HEIGHT / side(1))
    }
}

/// The range of cuts and holes along an axis, mm, measured at the tool's centre.
pub(super) fn extent(path: &Toolpath, holes: &[Hole], axis: usize) -> Option<[f32; 2]> {
    let cuts = path.moves().windows(2).filter(|pair| is_aside(pair));
    let cuts = cuts.flat_map(|pair| [pair[0].to[axis], pair[1].to[axis]]);
    let all = cuts.chain(holes.iter().map(|hole| hole.at[axis]));
    all.fold(None, |range, place| {
        let [low, high] = range.unwrap_or([place; 2]);
        Some([f32::min(low, place), f32::max(high, place)])
    })
}

/// Returns true if a move cuts and moves in X or Y, not straight up or down.
pub(super) fn is_aside(pair: &[Drawn]) -> bool {
    pair[1].way == Way::Cut && pair[0].to[..2] != pair[1].to[..2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_sim::scene::StrokeKind;

    /// A path with a cut of 10 mm that begins at `x`, and the travel to it.
    fn line_at(x: f64) -> Toolpath {
        let mut path = Toolpath::new([0.0; 3], true);
        path.go([x, 0.0, 0.0], StrokeKind::Travel);
        path.go([x + 10.0, 0.0, 0.0], StrokeKind::cut(0.0));
        path
    }

    #[test]
    fn the_way_to_the_work_is_shown_unless_the_work_would_be_a_dot() {
        let near = Window::onto(&line_at(40.0), &[], None);
        assert_eq!(
            (near.low[0], near.high[0], near.path_leaves),
            (0.0, 50.0, false)
        );
        let far = Window::onto(&line_at(200.0), &[], None);
        assert_eq!(
            (far.low[0], far.high[0], far.path_leaves),
            (198.0, 212.0, true)
        );
    }

    #[test]
    fn a_single_hole_has_room_around_it() {
        let path = line_at(0.0);
        let hole = Hole {
            at: [90.0, 5.0],
            bottom: -1.0,
            tool_mm: 0.0,
        };
        let mut away = Toolpath::new([0.0; 3], true);
        away.go([90.0, 5.0, 0.0], StrokeKind::Travel);
        let window = Window::onto(&away, &[hole], None);
        assert_eq!((window.low, window.high), ([88.0, 3.0], [92.0, 7.0]));
        assert_eq!(extent(&path, &[hole], 0), Some([0.0, 90.0]));
    }
}
