//! The heights of a surface at the places of a grid.

use crate::{Fault, Faults};

/// The farthest that two places of one row or column may be apart, mm: a machine that was told to go
/// to X10 stops within a step of it.
const SAME: f64 = 0.02;

/// The heights of a surface at the places of a grid, mm.
///
/// Between four places the height is bilinear: their weighted mean. Beside the grid it is the height
/// of the nearest place in the grid.
///
/// ```
/// use leadscrew_import::level::Map;
///
/// let map = Map::read("0,0,0\n10,0,1\n0,10,0\n10,10,3\n", [0.0; 3]).unwrap();
/// assert_eq!(map.height([5.0, 5.0]), 1.0);
/// assert_eq!(map.height([20.0, 10.0]), 3.0);
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct Map {
    /// The columns and rows, ascending.
    lines: [Vec<f64>; 2],
    /// The heights at the places, row by row.
    heights: Vec<f64>,
}

impl Map {
    /// Reads places and heights, one a line: `X,Y,Z`, with commas, semicolons or blanks between
    /// them; or probe reports as the machine sends them, `[PRB:X,Y,Z:1]`, from which `origin`, the
    /// machine position of work zero, is subtracted. Other text at the start is a heading.
    ///
    /// # Errors
    /// Lines that are no place, and places that make no grid of at least two columns and rows.
    pub fn read(text: &str, origin: [f64; 3]) -> Result<Self, Faults> {
        let (mut places, mut faults): (Vec<[f64; 3]>, Vec<Fault>) = (Vec::new(), Vec::new());
        for (index, line) in text.lines().enumerate() {
            let line = line.trim();
            if line.is_empty() || line.starts_with(['#', ';']) {
                continue;
            }
            match place(line, origin) {
                Ok(place) => places.push(place),
                Err(_) if places.is_empty() && faults.is_empty() && index == 0 => {}
                Err(message) => faults.push(Fault::new(index + 1, 1, message)),
            }
        }
        if !faults.is_empty() {
            return Err(Faults(faults));
        }
        Self::of(&places).map_err(|message| Faults(vec![Fault::new(1, 1, message)]))
    }

    fn of(places: &[[f64; 3]]) -> Result<Self, String> {
        if places.is_empty() {
            return Err("no place stands in it: expected X,Y,Z in mm in each line".to_owned());
        }
        let lines = [0, 1].map(|axis| {
            let mut all: Vec<f64> = places.iter().map(|place| place[axis]).collect();
            all.sort_by(f64::total_cmp);
            all.dedup_by(|next, kept| *next - *kept <= SAME);
            all
        });
        let [columns, rows] = &lines;
        if columns.len() < 2 || rows.len() < 2 {
            return Err("expected a grid of at least two columns and two rows".to_owned());
        }
        let mut heights = Vec::new();
        for y in rows {
            for x in columns {
                let is_here = |place: &&[f64; 3]| {
                    (0.0..=SAME).contains(&(place[0] - x)) && (0.0..=SAME).contains(&(place[1] - y))
                };
                let found = places.iter().rfind(is_here);
                let found =
                    found.ok_or_else(|| format!("the grid has no height at X{x:.3} Y{y:.3}"))?;
                heights.push(found[2]);
            }
        }
        Ok(Self { lines, heights })
    }

    /// Returns the height at a place, mm.
    pub fn height(&self, at: [f64; 2]) -> f64 {
        let [(column, x), (row, y)] = [0, 1].map(|axis| cell(&self.lines[axis], at[axis]));
        let corner = |right: usize, up: usize| {
            let index = (row + up) * self.lines[0].len() + column + right;
            self.heights.get(index).copied().unwrap_or(0.0)
        };
        let low = corner(0, 0) * (1.0 - x) + corner(1, 0) * x;
        let high = corner(0, 1) * (1.0 - x) + corner(1, 1) * x;
        low * (1.0 - y) + high * y
    }

    /// Returns true if a place lies within the grid, to [`SAME`].
    pub fn covers(&self, at: [f64; 2]) -> bool {
        self.bounds()
            .iter()
            .zip(at)
            .all(|((low, high), at)| (low - SAME..=high + SAME).contains(&at))
    }

    /// Returns the first and the last column, the first and the last row, mm.
    pub fn bounds(&self) -> [(f64, f64); 2] {
        [0, 1].map(|axis| {
            let lines = &self.lines[axis];
            let ends = lines.first().zip(lines.last());
            ends.map_or((0.0, 0.0), |(low, high)| (*low, *high))
        })
    }

    /// Returns how far the surface may be from the map between its places, mm; `None` if the grid
    /// is too small to show how the surface curves. Three places in a row show the surface's
    /// curvature. A quarter is added, since the surface may curve most between the places.
    ///
    /// ```
    /// use leadscrew_import::level::Map;
    ///
    /// let rows = [0, 10, 20].map(|y| format!("0,{y},0\n10,{y},0.4\n20,{y},0\n"));
    /// let map = Map::read(&rows.concat(), [0.0; 3]).unwrap();
    /// assert!((map.error().unwrap() - 0.125).abs() < 1e-9);
    /// ```
    pub fn error(&self) -> Option<f64> {
        let columns = self.lines[0].len();
        let row = |row: usize| self.heights.iter().skip(row * columns).take(columns);
        let column = |column: usize| self.heights.iter().skip(column).step_by(columns);
        let along_x = (0..self.lines[1].len()).map(|at| bulge(&self.lines[0], row(at)));
        let along_y = (0..columns).map(|at| bulge(&self.lines[1], column(at)));
        let most = |all: Option<Vec<f64>>| Some(all?.into_iter().fold(0.0, f64::max));
        Some(1.25 * (most(along_x.collect())? + most(along_y.collect())?))
    }

    /// Returns [`Map::error`] in words.
    pub fn accuracy(&self) -> String {
        match self.error() {
            Some(error) => format!("between its places the surface is within {error:.3} mm of it"),
            None => "three columns and rows would show how the surface curves between them".into(),
        }
    }

    /// The parts of the way from one place to another at which it must be cut, ascending from above
    /// 0 to 1, so that the surface is straight along each piece to `tolerance` mm.
    pub(super) fn cuts(&self, from: [f64; 2], to: [f64; 2], tolerance: f64) -> Vec<f64> {
        let mut borders = vec![0.0, 1.0];
        for axis in 0..2 {
            let way = to[axis] - from[axis];
            let parts = self.lines[axis]
                .iter()
                .map(|line| (line - from[axis]) / way);
            borders.extend(parts.filter(|part| *part > 1e-9 && *part < 1.0 - 1e-9));
        }
        borders.sort_by(f64::total_cmp);
        let mut cuts = Vec::new();
        for pair in borders.windows(2) {
            let (begin, end) = (pair[0], pair[1]);
            let at = |part: f64| [0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis]));
            // Within a cell the surface is a parabola along the way: it is farthest from its chord
            // in the middle, and n pieces are closer to it by n squared.
            let middle = self.height(at((begin + end) / 2.0));
            let chord = (self.height(at(begin)) + self.height(at(end))) / 2.0;
            let pieces = ((middle - chord).abs() / tolerance).sqrt().ceil().max(1.0) as u32;
            for piece in 1..=pieces {
                cuts.push(begin + (end - begin) * f64::from(piece) / f64::from(pieces));
            }
        }
        cuts
    }
}

/// Returns how far a parabola through each three heights in a line is from its chords at most;
/// `None` for fewer than three.
fn bulge<'a>(places: &[f64], heights: impl Iterator<Item = &'a f64>) -> Option<f64> {
    let all: Vec<_> = places.iter().zip(heights).collect();
    let bulges = all.windows(3).filter_map(|three| {
        let [(a, low), (b, middle), (c, high)] = three else {
            return None;
        };
        let (before, behind) = (*b - *a, *c - *b);
        let bend = ((*high - *middle) / behind - (*middle - *low) / before) / (before + behind);
        Some(bend.abs() * before.max(behind).powi(2) / 4.0)
    });
    bulges.reduce(f64::max)
}

/// The cell of a coordinate, and its place in the cell from 0 to 1.
fn cell(lines: &[f64], at: f64) -> (usize, f64) {
    let above = lines.partition_point(|line| *line <= at);
    let index = above.clamp(1, lines.len().saturating_sub(1).max(1)) - 1;
    match lines.get(index..index + 2) {
        Some([low, high]) => (index, ((at - low) / (high - low)).clamp(0.0, 1.0)),
        Some(_) | None => (0, 0.0),
    }
}

fn place(line: &str, origin: [f64; 3]) -> Result<[f64; 3], &'static str> {
    const EXPECTED: &str = "expected X,Y,Z in mm, or [PRB:X,Y,Z:1]";
    let (numbers, zero) = match line.strip_prefix("[PRB:") {
        Some(report) => {
            let (numbers, success) = report.split_once(':').ok_or(EXPECTED)?;
            if success != "1]" {
                return Err("this probe touched nothing: probe the place again");
            }
            (numbers, origin)
        }
        None => (line, [0.0; 3]),
    };
    let numbers = numbers
        .split([',', ';', ' ', '\t'])
        .filter(|part| !part.is_empty());
    let numbers: Result<Vec<f64>, _> = numbers.map(str::parse).collect();
    let numbers = numbers.map_err(|_| EXPECTED)?;
    let [x, y, z, ..] = numbers[..] else {
        return Err(EXPECTED);
    };
    let at = [x - zero[0], y - zero[1], z - zero[2]];
    match at.iter().all(|mm| mm.abs() <= 1e5) {
        true => Ok(at),
        false => Err(EXPECTED),
    }
}
