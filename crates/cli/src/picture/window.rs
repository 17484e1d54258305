//! The part of the plane that a picture shows.
//!
//! That is the whole path, so that the way from home to the work is seen. Work that would be a dot
//! then has the picture to itself, and what leads there ends at the frame.

use super::page::PLOT_WIDTH;
use super::plot::{is_aside, MOST_HEIGHT};
use leadscrew_sim::scene::{Hole, Toolpath};

/// Work has the picture to itself where that makes it so many times as large.
const ENOUGH: f64 = 4.0;
/// Room around it, mm: a single hole needs some.
const AROUND: f32 = 2.0;

/// A rectangle of the plane.
pub(super) struct Window {
    pub(super) low: [f32; 2],
    pub(super) high: [f32; 2],
    /// The path leads beyond it.
    pub(super) is_left: bool,
}

impl Window {
    /// The part to show of a path with these holes.
    pub(super) fn onto(path: &Toolpath, holes: &[Hole]) -> Self {
        let [low, high] = path.bounds();
        let whole = Self {
            low,
            high,
            is_left: false,
        };
        let (Some(x), Some(y)) = (extent(path, holes, 0), extent(path, holes, 1)) else {
            return whole;
        };
        let work = Self {
            low: [x[0], y[0]].map(|low| low - AROUND),
            high: [x[1], y[1]].map(|high| high + AROUND),
            is_left: true,
        };
        match work.per_mm() >= ENOUGH * whole.per_mm() {
            true => work,
            false => whole,
        }
    }

    /// Pixels of a millimetre in a plot that has room for it.
    fn per_mm(&self) -> f64 {
        let side = |axis: usize| f64::from(self.high[axis] - self.low[axis]).max(1e-3);
        (PLOT_WIDTH / side(0)).min(MOST_HEIGHT / side(1))
    }
}

/// The ends of cuts and holes along an axis, mm: of the tool's centre.
pub(super) fn extent(path: &Toolpath, holes: &[Hole], axis: usize) -> Option<[f32; 2]> {
    let cuts = path.moves().windows(2).filter(|pair| is_aside(pair));
    let cuts = cuts.flat_map(|pair| [pair[0].to[axis], pair[1].to[axis]]);
    let all = cuts.chain(holes.iter().map(|hole| hole.at[axis]));
    all.fold(None, |range, place| {
        let [low, high] = range.unwrap_or([place; 2]);
        Some([f32::min(low, place), f32::max(high, place)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_sim::scene::StrokeKind;

    /// A line of 10 mm that begins at `x`, with the way there.
    fn line_at(x: f64) -> Toolpath {
        let mut path = Toolpath::new([0.0; 3], true);
        path.go([x, 0.0, 0.0], StrokeKind::Travel);
        path.go([x + 10.0, 0.0, 0.0], StrokeKind::cut(0.0));
        path
    }

    #[test]
    fn the_way_to_the_work_is_shown_unless_the_work_would_be_a_dot() {
        let near = Window::onto(&line_at(40.0), &[]);
        assert_eq!(
            (near.low[0], near.high[0], near.is_left),
            (0.0, 50.0, false)
        );
        let far = Window::onto(&line_at(200.0), &[]);
        assert_eq!((far.low[0], far.high[0], far.is_left), (198.0, 212.0, true));
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
        let window = Window::onto(&away, &[hole]);
        assert_eq!((window.low, window.high), ([88.0, 3.0], [92.0, 7.0]));
        assert_eq!(extent(&path, &[hole], 0), Some([0.0, 90.0]));
    }
}
