//! Moves as the data of an SVG path, with no more points than can be seen.

use std::fmt::Write as _;

/// The distance by which a left-out point may be from the line that replaces it, pixels.
const MISS: f64 = 0.25;
/// The most points that are left out in a row: each new line is compared with all of them.
const LEFT_OUT: usize = 32;

/// The path of moves that are added in order.
#[derive(Default)]
pub(super) struct Line {
    data: String,
    /// The number of the last move.
    last: Option<usize>,
    /// The last point in the data.
    at: [f64; 2],
    /// Points after `at` that are not in the data yet. They fit one line, so only the last of them
    /// will be added.
    open: Vec<[f64; 2]>,
}

impl Line {
    /// Adds the move with number `index`. If it continues the move before it, only its end is
    /// added.
    pub(super) fn go(&mut self, index: usize, [from, to]: [[f64; 2]; 2]) {
        let goes_on = index
            .checked_sub(1)
            .is_some_and(|before| self.last == Some(before));
        if !goes_on {
            self.close();
            self.point('M', from);
        }
        self.last = Some(index);
        let at = self.at;
        let fits = self
            .open
            .iter()
            .all(|point| distance(*point, at, to) <= MISS);
        if !fits || self.open.len() == LEFT_OUT {
            self.close();
        }
        self.open.push(to);
    }

    /// The data of all moves.
    pub(super) fn finish(mut self) -> String {
        self.close();
        self.data
    }

    /// Adds the last of the open points to the data.
    fn close(&mut self) {
        if let Some(last) = self.open.pop() {
            self.point('L', last);
        }
        self.open.clear();
    }

    fn point(&mut self, kind: char, at: [f64; 2]) {
        self.at = at;
        // Writing to a string cannot fail.
        let _ = write!(self.data, "{kind}{:.1} {:.1}", at[0], at[1]);
    }
}

/// Returns how far a point is from the straight line between two others.
fn distance(point: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let along = [to[0] - from[0], to[1] - from[1]];
    let beside = [point[0] - from[0], point[1] - from[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let share = (along[0] * beside[0] + along[1] * beside[1]) / square.max(1e-12);
    let share = share.clamp(0.0, 1.0);
    (beside[0] - along[0] * share).hypot(beside[1] - along[1] * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(points: &[[f64; 2]]) -> String {
        let mut line = Line::default();
        for (index, pair) in points.windows(2).enumerate() {
            line.go(index, [pair[0], pair[1]]);
        }
        line.finish()
    }

    /// The points of a path's data.
    fn points(data: &str) -> Vec<[f64; 2]> {
        let all = data.split(['M', 'L']).filter(|part| !part.is_empty());
        let two = |part: &str| {
            let (x, y) = part.split_once(' ').unwrap();
            [x.parse().unwrap(), y.parse().unwrap()]
        };
        all.map(two).collect()
    }

    #[test]
    fn a_straight_line_has_two_points_and_each_corner_one() {
        let points = [[0.0, 0.0], [1.0, 0.0], [5.0, 0.0], [5.0, 2.0], [5.0, 9.0]];
        assert_eq!(data(&points), "M0.0 0.0L5.0 0.0L5.0 9.0");
        // A turn back along the same line is a corner, too.
        assert_eq!(
            data(&[[0.0, 0.0], [9.0, 0.0], [4.0, 0.0]]),
            "M0.0 0.0L9.0 0.0L4.0 0.0"
        );
    }

    #[test]
    fn moves_that_do_not_follow_each_other_are_two_lines() {
        let mut line = Line::default();
        line.go(0, [[0.0, 0.0], [3.0, 0.0]]);
        line.go(5, [[6.0, 0.0], [6.0, 0.1]]);
        assert_eq!(line.finish(), "M0.0 0.0L3.0 0.0M6.0 0.0L6.0 0.1");
    }

    #[test]
    fn a_circle_has_few_points_and_none_is_missed_by_more_than_is_seen() {
        let circle: Vec<[f64; 2]> = (0..=1000)
            .map(|k| f64::from(k) * std::f64::consts::TAU / 1000.0)
            .map(|angle| [50.0 + 20.0 * angle.cos(), 50.0 + 20.0 * angle.sin()])
            .collect();
        let kept = points(&data(&circle));
        assert!(kept.len() < 60, "{}", kept.len());
        let nearest = |point: &[f64; 2]| {
            let lines = kept
                .windows(2)
                .map(|pair| distance(*point, pair[0], pair[1]));
            lines.fold(f64::INFINITY, f64::min)
        };
        // Coordinates are rounded to a tenth of a pixel.
        let most = circle.iter().map(nearest).fold(0.0, f64::max);
        assert!(most <= MISS + 0.08, "{most}");
    }
}
