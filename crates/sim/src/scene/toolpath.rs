//! The path that the tool took.

use super::{Drawn, Way};
use leadscrew_machine::explain::PlannedMove;
use leadscrew_planner::{Coordinate, MoveKind};

/// The use of the tool along a stroke.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum StrokeKind {
    /// A rapid (G0), a jog, motion that the machine makes on its own, or a feed move that does
    /// nothing ([`Tooling`]).
    Travel,
    /// Any other feed move; `shade` is the output's power, 0 (off) to [`StrokeKind::SHADES`]
    /// (full).
    Cut {
        /// Power in steps of 1/[`StrokeKind::SHADES`].
        shade: u8,
    },
}

impl StrokeKind {
    /// Shades between off and full power.
    pub const SHADES: u8 = 255;

    /// Makes a feed move at `share` of full power, 0 to 1.
    pub fn cut(share: f64) -> Self {
        Self::Cut {
            shade: (share * f64::from(Self::SHADES)).round() as u8,
        }
    }

    /// Returns the use of the tool, without the power.
    pub fn way(self) -> Way {
        match self {
            Self::Travel => Way::Travel,
            Self::Cut { .. } => Way::Cut,
        }
    }

    /// Returns the share of full power; 0 for travel.
    pub fn power(self) -> f32 {
        match self {
            Self::Travel => 0.0,
            Self::Cut { shade } => f32::from(shade) / f32::from(Self::SHADES),
        }
    }
}

/// The rule by which a feed move is a cut.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Tooling {
    /// The axis of the filament, on a 3D printer. A feed move that feeds no filament is travel.
    pub extruder: Option<usize>,
}

impl Tooling {
    /// Returns the use of the tool on a planned move.
    pub fn planned(self, planned: &PlannedMove<'_>) -> StrokeKind {
        match planned.kind {
            MoveKind::Feed => {
                let power = planned.power.share().to_num();
                self.feed(planned.begin, planned.target, power, planned.is_laser)
            }
            MoveKind::Rapid | MoveKind::Jog | MoveKind::System => StrokeKind::Travel,
        }
    }

    /// Returns the use of the tool on a feed move from `begin` to `target` at this share of full
    /// power. With a laser, a move without power is travel.
    pub fn feed(
        self,
        begin: &[Coordinate],
        target: &[Coordinate],
        power: f64,
        is_laser: bool,
    ) -> StrokeKind {
        let feeds = |axis: usize| target.get(axis) > begin.get(axis);
        let burns = !is_laser || power > 0.0;
        match burns && self.extruder.is_none_or(feeds) {
            true => StrokeKind::cut(power),
            false => StrokeKind::Travel,
        }
    }
}

/// Collects the moves of a job.
#[derive(Clone, Debug)]
pub struct Toolpath {
    /// All moves; `None` if only distances are wanted.
    moves: Option<Vec<Drawn>>,
    /// The line that asks for the following motion, counted from 1; 0 for none.
    pub line: u32,
    /// Diameter of the tool in use, mm; 0 if it is not known.
    pub tool_mm: f32,
    at: [f64; 3],
    start: [f64; 3],
    cut_mm: f64,
    travel_mm: f64,
    /// The corners of the box around all cuts.
    cut: Option<[[f64; 3]; 2]>,
}

impl Toolpath {
    /// Starts at `start`, X, Y, Z in mm. Moves are kept only if `drawn`; otherwise the memory does
    /// not grow with the job.
    pub fn new(start: [f64; 3], drawn: bool) -> Self {
        Self {
            moves: drawn.then(|| vec![begin(start)]),
            line: 0,
            tool_mm: 0.0,
            at: start,
            start,
            cut_mm: 0.0,
            travel_mm: 0.0,
            cut: None,
        }
    }

    /// Returns true if strokes are kept.
    pub fn is_drawn(&self) -> bool {
        self.moves.is_some()
    }

    /// Returns the lowest and the highest X, Y and Z of all cuts, mm; `None` if there was none.
    pub fn cut_bounds(&self) -> Option<[[f64; 3]; 2]> {
        self.cut
    }

    fn widen(&mut self, point: [f64; 3]) {
        let [low, high] = self.cut.get_or_insert([point; 2]);
        for axis in 0..3 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    }

    /// Continues from `place`, X, Y, Z in mm, to which the machine has moved on its own. Nothing is
    /// drawn up to there.
    pub fn resume_at(&mut self, place: [f64; 3]) {
        if distance(self.at, place) < SAME_PLACE {
            return;
        }
        self.at = place;
        let is_begin = self.cut_mm == 0.0 && self.travel_mm == 0.0;
        if is_begin {
            self.start = place;
        }
        match &mut self.moves {
            Some(moves) if is_begin => *moves = vec![begin(place)],
            Some(moves) => moves.push(begin(place)),
            None => {}
        }
    }

    /// Continues to `target`, X, Y, Z in mm.
    pub fn go(&mut self, target: [f64; 3], kind: StrokeKind) {
        let length = distance(self.at, target);
        match kind {
            StrokeKind::Travel => self.travel_mm += length,
            StrokeKind::Cut { .. } => {
                self.cut_mm += length;
                self.widen(self.at);
                self.widen(target);
            }
        }
        self.at = target;
        let Some(moves) = &mut self.moves else {
            return;
        };
        moves.push(Drawn {
            to: target.map(|mm| mm as f32),
            line: self.line,
            way: kind.way(),
            power: kind.power(),
            tool_mm: self.tool_mm,
        });
    }

    /// Continues along a curve of this length, mm, to the last of `points`, X, Y, Z in mm, among
    /// which are the curve's lowest and highest. For a path that is not drawn.
    pub fn bend(&mut self, length: f64, points: impl Iterator<Item = [f64; 3]>, kind: StrokeKind) {
        let is_cut = kind != StrokeKind::Travel;
        match is_cut {
            true => self.cut_mm += length,
            false => self.travel_mm += length,
        }
        let begin = self.at;
        for point in points {
            self.at = point;
            if is_cut {
                self.widen(point);
            }
        }
        if is_cut {
            self.widen(begin);
        }
    }

    /// Returns the length of the cuts, mm.
    pub fn cut_mm(&self) -> f64 {
        self.cut_mm
    }

    /// Returns the length of all other moves, mm.
    pub fn travel_mm(&self) -> f64 {
        self.travel_mm
    }

    /// Returns all moves, in order: the first is the beginning of the path.
    pub fn moves(&self) -> &[Drawn] {
        self.moves.as_deref().unwrap_or_default()
    }

    /// Sets lines and tools that become known only after the moves. `of` maps the line number
    /// stored in a move to the line and the tool's diameter.
    pub fn tell_lines(&mut self, of: impl Fn(u32) -> (u32, f32)) {
        for one in self.moves.iter_mut().flatten() {
            (one.line, one.tool_mm) = of(one.line);
        }
    }

    /// Returns the drilled holes, in order: places at which the tool went down at feed rate, and up
    /// again or not at all, without moving in X or Y. Consecutive strokes at one place are one
    /// hole. If some cuts have power, a stroke without power makes none: the spindle is off.
    pub fn holes(&self) -> Vec<Hole> {
        let turns = |one: &Drawn| one.way == Way::Cut && one.power > 0.0;
        let switches = self.moves().iter().any(turns);
        let mut holes: Vec<Hole> = Vec::new();
        let mut plunge: Option<Hole> = None;
        for pair in self.moves().windows(2) {
            let (from, to) = (pair[0].to, pair[1].to);
            let is_jump = pair[1].way == Way::Jump;
            if !is_jump && !is_vertical(pair) {
                plunge = None;
            } else if is_jump || to[2] > from[2] {
                add(&mut holes, plunge.take());
            } else if to[2] < from[2] {
                let new = Hole {
                    at: [to[0], to[1]],
                    bottom: to[2],
                    tool_mm: pair[1].tool_mm,
                };
                let drills = pair[1].way == Way::Cut && (turns(&pair[1]) || !switches);
                plunge = drills.then_some(new);
            }
        }
        add(&mut holes, plunge);
        holes
    }

    /// Returns the highest and the lowest Z at which the tool works, mm. For a move straight down
    /// only its end counts, since the move may begin above the material.
    pub fn depths(&self) -> Option<[f32; 2]> {
        let cuts = self.moves().windows(2);
        let cuts = cuts.filter(|pair| pair[1].way == Way::Cut && !is_upward(pair));
        let heights = cuts.flat_map(|pair| {
            let begin = (!is_vertical(pair)).then_some(pair[0].to[2]);
            begin.into_iter().chain([pair[1].to[2]])
        });
        heights.fold(None, |range, z| {
            let [top, bottom] = range.unwrap_or([z; 2]);
            Some([f32::max(top, z), f32::min(bottom, z)])
        })
    }

    /// Returns the heights of cuts at constant Z, mm, the highest first; empty if there are more
    /// than `most`.
    pub fn passes(&self, most: usize) -> Vec<f32> {
        let mut passes: Vec<f32> = Vec::new();
        for pair in self.moves().windows(2) {
            let is_level = (pair[0].to[2] - pair[1].to[2]).abs() < SAME;
            if pair[1].way != Way::Cut || !is_level || is_vertical(pair) {
                continue;
            }
            if passes.iter().all(|z| (z - pair[1].to[2]).abs() >= SAME) {
                if passes.len() == most {
                    return Vec::new();
                }
                passes.push(pair[1].to[2]);
            }
        }
        passes.sort_by(|a, b| b.total_cmp(a));
        passes
    }

    /// Returns start and end of the path: X and Y in mm.
    pub fn ends(&self) -> [[f32; 2]; 2] {
        [flat(self.start), flat(self.at)]
    }

    /// Returns the smallest and the largest X and Y of the path, mm.
    pub fn bounds(&self) -> [[f32; 2]; 2] {
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

/// Places closer than this are the same, mm: such a move is shorter than a step.
const SAME_PLACE: f64 = 0.02;

/// Heights closer than this are the same, mm.
const SAME: f32 = 1e-3;

/// A drilled hole.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hole {
    /// X and Y in mm.
    pub at: [f32; 2],
    /// The lowest Z of the tool, mm.
    pub bottom: f32,
    /// Diameter of the tool, mm; 0 if it is not known.
    pub tool_mm: f32,
}

/// Adds a hole, or deepens the last one if that is at the same place.
fn add(holes: &mut Vec<Hole>, new: Option<Hole>) {
    match (new, holes.last_mut()) {
        (Some(new), Some(last)) if last.at == new.at => last.bottom = last.bottom.min(new.bottom),
        (Some(new), _) => holes.push(new),
        (None, _) => {}
    }
}

/// Returns true if a move keeps its X and Y.
fn is_vertical(pair: &[Drawn]) -> bool {
    pair[0].to[..2] == pair[1].to[..2]
}

/// Returns true if a move goes straight up, so that it cuts nothing.
fn is_upward(pair: &[Drawn]) -> bool {
    is_vertical(pair) && pair[1].to[2] >= pair[0].to[2]
}

fn begin(at: [f64; 3]) -> Drawn {
    Drawn {
        to: at.map(|mm| mm as f32),
        line: 0,
        way: Way::Jump,
        power: 0.0,
        tool_mm: 0.0,
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
        let holes = path.holes();
        let places: Vec<[f32; 2]> = holes.iter().map(|hole| hole.at).collect();
        assert_eq!(places, [[5.0, 1.0], [5.0, 2.0]]);
        assert!(holes.iter().all(|hole| hole.bottom == -2.0), "{holes:?}");
        // The machine leaves the first of these holes on its own, and the job ends in the second.
        for x in [7.0, 8.0] {
            path.resume_at([x, 2.0, 1.0]);
            path.go([x, 2.0, -3.0], StrokeKind::cut(0.0));
        }
        assert_eq!(path.holes().len(), 4);
    }

    #[test]
    fn a_spindle_that_is_off_drills_no_hole_beside_one_that_turns() {
        let drill = |last: f64| {
            let mut path = Toolpath::new([0.0, 0.0, 1.0], true);
            path.go([5.0, 0.0, 1.0], StrokeKind::Travel);
            path.go([5.0, 0.0, -2.0], StrokeKind::cut(1.0));
            path.go([5.0, 0.0, 1.0], StrokeKind::Travel);
            path.go([0.0, 0.0, 1.0], StrokeKind::Travel);
            path.go([0.0, 0.0, 0.0], StrokeKind::cut(last));
            path.holes().len()
        };
        assert_eq!([drill(1.0), drill(0.0)], [2, 1]);
    }

    #[test]
    fn passes_are_the_heights_of_level_cuts_and_a_plunge_begins_above_the_material() {
        let mut path = Toolpath::new([0.0, 0.0, 5.0], true);
        for z in [-1.0, -2.0] {
            path.go([0.0, 0.0, z], StrokeKind::cut(0.0));
            path.go([9.0, 0.0, z], StrokeKind::cut(0.0));
            path.go([9.0, 0.0, 5.0], StrokeKind::cut(0.0));
            path.go([0.0, 0.0, 5.0], StrokeKind::Travel);
        }
        assert_eq!(path.depths(), Some([-1.0, -2.0]));
        assert_eq!(path.passes(8), [-1.0, -2.0]);
        assert!(path.passes(1).is_empty());
    }

    #[test]
    fn a_printers_feed_moves_are_cuts_where_they_feed_filament() {
        let at = |places: [f64; 4]| places.map(|mm| Coordinate::from_nanos((mm * 1e9) as i64));
        let begin = at([0.0, 0.0, 0.3, 1.0]);
        let printer = Tooling { extruder: Some(3) };
        let kind = |tooling: Tooling, end| tooling.feed(&begin, &at(end), 0.0, false).way();
        assert_eq!(kind(printer, [9.0, 0.0, 0.3, 1.2]), Way::Cut);
        assert_eq!(kind(printer, [9.0, 0.0, 0.3, 1.0]), Way::Travel);
        assert_eq!(kind(printer, [9.0, 0.0, 0.3, 0.5]), Way::Travel);
        assert_eq!(kind(Tooling::default(), [9.0, 0.0, 0.3, 1.0]), Way::Cut);
    }

    #[test]
    fn a_laser_s_feed_moves_without_power_are_travel() {
        let way = |power, is_laser| Tooling::default().feed(&[], &[], power, is_laser).way();
        assert_eq!(way(0.1, true), Way::Cut);
        assert_eq!(way(0.0, true), Way::Travel);
        assert_eq!(way(0.0, false), Way::Cut);
    }

    #[test]
    fn lines_and_tools_may_become_known_afterwards() {
        let mut path = Toolpath::new([0.0; 3], true);
        path.line = 2;
        path.go([5.0, 0.0, -1.0], StrokeKind::cut(0.0));
        path.tell_lines(|line| (line + 40, 3.0));
        let last = path.moves()[1];
        assert_eq!((last.line, last.tool_mm), (42, 3.0));
    }
}
