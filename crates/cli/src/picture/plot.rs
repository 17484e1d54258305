//! The toolpath in its coordinate system: cuts as wide as their tool, holes as wide as their drill.
//!
//! If a tool's diameter is known, the material that it takes away is drawn pale, and the path of
//! its centre in full colour on top.

use super::caption::Caption;
use super::ink;
use super::line::Line;
use super::page::{rectangle, Frame, INK, LEFT, MOST_HEIGHT, PLOT_WIDTH, TOP};
use super::raster::Raster;
use super::scale::{label, Scale};
use super::window::{extent, is_aside, Window};
use leadscrew_sim::scene::{Drawn, Hole, Toolpath, Way};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use svg::node::element::{Circle, ClipPath, Definitions, Group, Image, Path, Rectangle, Use};

// Pixels.
const LEAST_HEIGHT: f64 = 160.0;
/// Width of a cut whose tool has no known width: a visible thin line.
pub(super) const HAIR: f64 = 1.4;
/// Radius of a hole whose drill is not known, which shows around the dot of the end; and the least
/// visible radius.
pub(super) const PLAIN_HOLE: f64 = 4.0;
const LEAST_HOLE: f64 = 1.2;
/// Length of cut from one arrow to the next; the size of a square that has at most one arrow; and
/// the most arrows.
const ARROW_EVERY: f64 = 90.0;
const APART: f64 = 40.0;
const ARROWS: usize = 150;

/// The diameter of a laser's spot, mm.
const SPOT: f64 = 0.1;
/// The number of colours of a scale: more could not be distinguished.
pub(super) const LEVELS: u8 = 24;
/// The most passes that are drawn in colours of their own; and the most passes on top of each other
/// whose edges are all shown.
const PASSES: usize = 8;
const STACKED: usize = 5;
/// The width by which a pass is drawn wider than the pass on top of it, pixels.
const STANDS_OUT: f64 = 1.6;

const START: &str = "#2a7f62";

/// The parts of the picture's coordinate system.
pub(super) struct Plot<'a> {
    path: &'a Toolpath,
    pub(super) frame: Frame,
    pub(super) x: Scale,
    pub(super) y: Scale,
    per_mm: f64,
    /// True if the path goes beyond the edges of the picture.
    pub(super) leads_out: bool,
    /// The S value of a laser's full power; `None` if S is a spindle's speed.
    pub(super) full_power_s: Option<f64>,
    /// The tool's work on the material.
    pub(super) work: &'static str,
    travel: Option<[[f32; 2]; 2]>,
    /// The highest and the lowest Z of cuts, mm.
    pub(super) depth: [f32; 2],
    /// The heights of cuts at constant Z; empty if there are many.
    pub(super) passes: Vec<f32>,
    pub(super) holes: Vec<Hole>,
    raster: Option<Raster>,
}

impl<'a> Plot<'a> {
    /// Makes a plot with the same scale, in pixels per millimetre, for X and Y.
    pub(super) fn new(path: &'a Toolpath, caption: &Caption) -> Self {
        let full_power_s = caption.full_power_s;
        let is_laser = full_power_s.is_some();
        let room = if is_laser { 0.0 } else { widest(path) / 2.0 };
        let holes = path.holes();
        let window = Window::onto(path, &holes, caption.travel);
        let [low, high] = [window.low, window.high].map(|corner| corner.map(f64::from));
        let span = [0, 1].map(|axis: usize| (high[axis] - low[axis]).max(1e-3) * 1.08 + 2.0 * room);
        let per_mm = (PLOT_WIDTH / span[0]).min(MOST_HEIGHT / span[1]);
        let height = (span[1] * per_mm).max(LEAST_HEIGHT);
        let frame = Frame { top: TOP, height };
        let half = [PLOT_WIDTH / per_mm / 2.0, height / per_mm / 2.0];
        let middle = [(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0];
        let ends = |axis: usize| [middle[axis] - half[axis], middle[axis] + half[axis]];
        let ([left, right], [below, above]) = (ends(0), ends(1));
        Self {
            path,
            frame,
            x: Scale::new(left, right, LEFT, LEFT + PLOT_WIDTH),
            y: Scale::new(below, above, frame.bottom(), frame.top),
            per_mm,
            leads_out: window.path_leaves,
            full_power_s,
            work: caption.work,
            travel: caption.travel,
            depth: path.depths().unwrap_or_default(),
            passes: path.passes(PASSES),
            holes,
            raster: is_laser.then(|| Raster::of(path.moves())).flatten(),
        }
    }

    /// The titles of the axes, with the extent of the work. If the place in the machine is known,
    /// they say that they count from its zero.
    pub(super) fn titles(&self) -> [String; 2] {
        let whose = if self.travel.is_some() {
            "machine "
        } else {
            ""
        };
        [("X", 0), ("Y", 1)].map(
            |(axis, index)| match extent(self.path, &self.holes, index) {
                Some(ends) => {
                    let [low, high] =
                        ends.map(|end| label((f64::from(end) * 100.0).round() / 100.0));
                    format!("{whose}{axis} mm ({} from {low} to {high})", self.work)
                }
                None => format!("{whose}{axis} mm"),
            },
        )
    }

    fn at(&self, point: [f32; 2]) -> [f64; 2] {
        [self.x.pixel(point[0].into()), self.y.pixel(point[1].into())]
    }

    fn ends_of(&self, pair: &[Drawn]) -> [[f64; 2]; 2] {
        [0, 1].map(|end: usize| self.at([pair[end].to[0], pair[end].to[1]]))
    }

    /// A move's place on the scale of power or depth, from 0 to [`LEVELS`].
    fn level(&self, pair: &[Drawn]) -> u8 {
        match self.full_power_s {
            Some(_) => (pair[1].power.clamp(0.0, 1.0) * f32::from(LEVELS)).round() as u8,
            None => self.level_of((pair[0].to[2] + pair[1].to[2]) / 2.0),
        }
    }

    /// A height's place on the scale of depth.
    pub(super) fn level_of(&self, z: f32) -> u8 {
        let [top, bottom] = self.depth;
        // If all cuts have one depth, they get the last colour.
        let share = 1.0 - (z - bottom) / (top - bottom).max(1e-3);
        (share.clamp(0.0, 1.0) * f32::from(LEVELS)).round() as u8
    }

    pub(super) fn colour(&self, level: u8) -> String {
        let share = f64::from(level) / f64::from(LEVELS);
        match self.full_power_s {
            Some(_) => ink::power(share),
            None => ink::depth(share),
        }
    }

    /// The rows of an engraving as an image.
    pub(super) fn image(&self) -> Option<Image> {
        let raster = self.raster.as_ref()?;
        let [left, bottom] = [self.x.pixel(raster.low[0]), self.y.pixel(raster.low[1])];
        let [right, top] = [self.x.pixel(raster.high[0]), self.y.pixel(raster.high[1])];
        Some(
            Image::new()
                .set("x", left)
                .set("y", top)
                .set("width", right - left)
                .set("height", bottom - top)
                .set("preserveAspectRatio", "none")
                // The grid shows through if nothing is burnt.
                .set("style", "mix-blend-mode:multiply")
                .set("href", raster.address(self.per_mm)),
        )
    }

    fn is_in_image(&self, pair: &[Drawn]) -> bool {
        self.raster.as_ref().is_some_and(|raster| raster.has(pair))
    }

    /// Returns true if later passes lie higher, as a 3D printer's layers do.
    pub(super) fn builds_up(&self) -> bool {
        let mut cuts = self.path.moves().iter().filter(|one| one.way == Way::Cut);
        match (cuts.next(), cuts.next_back()) {
            (Some(first), Some(last)) => first.to[2] < last.to[2],
            (_, _) => false,
        }
    }

    /// All moves: one path for each colour and tool, with later passes on top.
    pub(super) fn strokes(&self) -> Group {
        let mut travels = Line::default();
        let mut cuts: BTreeMap<(i16, u32), Line> = BTreeMap::new();
        let order = if self.builds_up() { -1 } else { 1 };
        for (index, pair) in self.path.moves().windows(2).enumerate() {
            let [from, to] = self.ends_of(pair);
            if self.is_in_image(pair) {
                continue;
            }
            match pair[1].way {
                Way::Jump => {}
                Way::Travel => travels.go(index, [from, to]),
                // A hole is not drawn as a cut: `holes` draws it.
                Way::Cut if from == to => {}
                Way::Cut => {
                    let tool = (pair[1].tool_mm * 1000.0).round() as u32;
                    let key = (order * i16::from(self.level(pair)), tool);
                    cuts.entry(key).or_default().go(index, [from, to]);
                }
            }
        }
        let group = Group::new()
            .set("fill", "none")
            .set("stroke-linejoin", "round")
            .set("stroke-linecap", "round");
        let mut dashed = Group::new();
        let travels = travels.finish();
        if !travels.is_empty() {
            let path = Path::new().set("d", travels).set("stroke", ink::travel());
            dashed = dashed.add(path.set("stroke-width", 0.8).set("stroke-dasharray", "4 3"));
        }
        let [kept, pale, full] = self.cuts(cuts);
        group.add(kept).add(pale).add(dashed).add(full)
    }

    /// The cuts: their paths, the material that they take away, and the lines of the tool's centre.
    fn cuts(&self, cuts: BTreeMap<(i16, u32), Line>) -> [Group; 3] {
        let is_laser = self.full_power_s.is_some();
        let spot = if is_laser { SPOT * self.per_mm } else { 0.0 }.max(HAIR);
        let (mut kept, mut pale, mut full) = (Definitions::new(), Group::new(), Group::new());
        for (number, ((level, tool), cut)) in cuts.into_iter().enumerate() {
            let colour = self.colour(level.unsigned_abs() as u8);
            let hair = spot + self.stands_out(level);
            let wide = f64::from(tool) / 1000.0 * self.per_mm;
            let path = Path::new().set("d", cut.finish());
            if is_laser || wide <= hair {
                full = full.add(path.set("stroke", colour).set("stroke-width", hair));
                continue;
            }
            let name = format!("cut{number}");
            kept = kept.add(path.set("id", name.as_str()));
            let again = || Use::new().set("href", format!("#{name}"));
            let share = f64::from(level.unsigned_abs()) / f64::from(LEVELS);
            let swept = again().set("stroke", ink::pale_depth(share));
            pale = pale.add(swept.set("stroke-width", hundredths(wide)));
            full = full.add(again().set("stroke", colour).set("stroke-width", hair));
        }
        [Group::new().add(kept), pale, full]
    }

    /// Returns how much wider a cut drawn at `order` is than the pass drawn last, pixels. So a pass
    /// shows on both sides of the passes on top of it.
    fn stands_out(&self, order: i16) -> f64 {
        let sign = if self.builds_up() { -1 } else { 1 };
        let orders = self
            .passes
            .iter()
            .map(|z| sign * i16::from(self.level_of(*z)));
        let above = orders.filter(|other| *other > order).count();
        match self.passes.len() {
            2..=STACKED => above as f64 * STANDS_OUT,
            _ => 0.0,
        }
    }

    /// Arrows that show the direction in which the tool cuts.
    pub(super) fn arrows(&self) -> Path {
        let mut data = String::new();
        let mut taken = BTreeSet::new();
        let mut since = ARROW_EVERY / 2.0;
        for pair in self.path.moves().windows(2) {
            if pair[1].way != Way::Cut || self.is_in_image(pair) || taken.len() >= ARROWS {
                continue;
            }
            let [from, to] = self.ends_of(pair);
            let way = [to[0] - from[0], to[1] - from[1]];
            let length = way[0].hypot(way[1]);
            since += length;
            if since < ARROW_EVERY || length < 1e-6 {
                continue;
            }
            let middle = [(from[0] + to[0]) / 2.0, (from[1] + to[1]) / 2.0];
            if taken.insert(middle.map(|place| (place / APART) as i32)) {
                since = 0.0;
                arrow(&mut data, middle, way.map(|part| part / length * 4.0));
            }
        }
        Path::new()
            .set("d", data)
            .set("fill", INK)
            .set("fill-opacity", 0.75)
    }

    /// The drilled holes, each with the diameter of its drill.
    pub(super) fn holes(&self) -> Group {
        let mut group = Group::new();
        for hole in &self.holes {
            let [x, y] = self.at(hole.at);
            group = group.add(self.hole(hole, (hundredths(x), hundredths(y))));
        }
        group
    }

    /// The mark of a hole, drawn at `at`.
    pub(super) fn hole(&self, hole: &Hole, at: (f64, f64)) -> Circle {
        let level = self.level_of(hole.bottom);
        let radius = f64::from(hole.tool_mm) / 2.0 * self.per_mm;
        let share = f64::from(level) / f64::from(LEVELS);
        let (radius, fill) = match hole.tool_mm > 0.0 {
            true => (radius.max(LEAST_HOLE), ink::pale_depth(share)),
            false => (PLAIN_HOLE, "white".to_owned()),
        };
        mark(at, hundredths(radius))
            .set("fill", fill)
            .set("stroke", self.colour(level))
            .set("stroke-width", HAIR.min(radius / 2.0))
    }

    /// The marks of the job's start and end, if the picture contains them.
    pub(super) fn ends(&self) -> Group {
        let [start, end] = self.seen_ends();
        let mut group = Group::new();
        if let Some(start) = start {
            group = group.add(start_mark(start));
        }
        if let Some(end) = end {
            group = group.add(end_mark(end));
        }
        group
    }

    /// The places of start and end, in pixels; `None` for one that is outside the picture.
    pub(super) fn seen_ends(&self) -> [Option<(f64, f64)>; 2] {
        let across = LEFT..=LEFT + PLOT_WIDTH;
        let up = self.frame.top..=self.frame.bottom();
        let places = self.path.ends().map(|at| self.at(at));
        places.map(|[x, y]| (across.contains(&x) && up.contains(&y)).then_some((x, y)))
    }

    /// The box of the travel, if the picture contains an edge of it.
    pub(super) fn travel_box(&self) -> Option<Rectangle> {
        let travel = self.travel.filter(|_| self.shows_travel())?;
        let [[left, bottom], [right, top]] = self.corners(travel);
        let frame = rectangle(left, top, right - left, bottom - top, "none");
        let edged = frame.set("stroke", ink::travel_box());
        Some(edged.set("stroke-width", 2))
    }

    /// The places of the lowest and the highest corner of the travel, in pixels.
    fn corners(&self, travel: [[f32; 2]; 2]) -> [[f64; 2]; 2] {
        let [low, high] = [0, 1].map(|end| travel.map(|ends| ends[end]));
        [self.at(low), self.at(high)]
    }

    /// Returns true if the picture contains an edge of the box of the travel.
    pub(super) fn shows_travel(&self) -> bool {
        let Some(travel) = self.travel else {
            return false;
        };
        let [[left, bottom], [right, top]] = self.corners(travel);
        let across = [LEFT, LEFT + PLOT_WIDTH];
        let up = [self.frame.top, self.frame.bottom()];
        let meets = |low: f64, high: f64, [from, to]: [f64; 2]| low <= to && high >= from;
        let inside = |edge: f64, [from, to]: [f64; 2]| from <= edge && edge <= to;
        let upright = [left, right].into_iter().any(|edge| inside(edge, across));
        let level = [top, bottom].into_iter().any(|edge| inside(edge, up));
        upright && meets(top, bottom, up) || level && meets(left, right, across)
    }

    /// Cuts off lines that go beyond the picture.
    pub(super) fn clipped(&self, drawn: Group) -> Group {
        if !self.leads_out && !self.shows_travel() {
            return drawn;
        }
        let Frame { top, height } = self.frame;
        let frame = rectangle(LEFT, top, PLOT_WIDTH, height, "none");
        let clip = ClipPath::new().set("id", "plot").add(frame);
        let drawn = Group::new().set("clip-path", "url(#plot)").add(drawn);
        Group::new().add(Definitions::new().add(clip)).add(drawn)
    }

    /// The diameters of the tools that cut sideways, mm, the widest first.
    pub(super) fn tools(&self) -> Vec<f32> {
        let cuts = self.path.moves().windows(2);
        let cuts = cuts.filter(|pair| is_aside(pair) && pair[1].tool_mm > 0.0);
        let mut tools: Vec<f32> = Vec::new();
        for pair in cuts {
            if !tools.contains(&pair[1].tool_mm) {
                tools.push(pair[1].tool_mm);
            }
        }
        tools.sort_by(|a, b| b.total_cmp(a));
        tools
    }

    /// Returns true if there are cuts that are not straight up or down.
    pub(super) fn has_cuts(&self) -> bool {
        self.path.moves().windows(2).any(is_aside)
    }

    /// The pixels of a length in mm.
    pub(super) fn pixels(&self, mm: f32) -> f64 {
        f64::from(mm) * self.per_mm
    }
}

fn widest(path: &Toolpath) -> f64 {
    let cuts = path.moves().iter().filter(|one| one.way == Way::Cut);
    cuts.map(|one| f64::from(one.tool_mm)).fold(0.0, f64::max)
}

/// Adds an arrow in the middle of a move; `along` is half the arrow's length.
fn arrow(data: &mut String, middle: [f64; 2], along: [f64; 2]) {
    let [tip, back] =
        [1.0, -1.0].map(|way| [middle[0] + along[0] * way, middle[1] + along[1] * way]);
    let aside = along.map(|part| part * 0.8);
    let _ = write!(
        data,
        "M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}Z",
        tip[0],
        tip[1],
        back[0] - aside[1],
        back[1] + aside[0],
        back[0] + aside[1],
        back[1] - aside[0]
    );
}

/// The mark of the job's start.
pub(super) fn start_mark(at: (f64, f64)) -> Circle {
    mark(at, 6.0)
        .set("fill", "none")
        .set("stroke", START)
        .set("stroke-width", 2)
}

/// The mark of the job's end.
pub(super) fn end_mark(at: (f64, f64)) -> Circle {
    mark(at, 3.0).set("fill", INK)
}

fn mark(at: (f64, f64), radius: f64) -> Circle {
    Circle::new()
        .set("cx", at.0)
        .set("cy", at.1)
        .set("r", radius)
}

fn hundredths(pixels: f64) -> f64 {
    (pixels * 100.0).round() / 100.0
}
