//! Draws the toolpath and the speed along time as one SVG document.

use super::ink;
use super::page::{axes, line, page, rectangle, text, Frame};
use super::page::{AXIS_HEIGHT, INK, LEFT, PLOT_WIDTH, TOP};
use super::raster::Raster;
use super::scale::{label, Scale};
use super::{speed, Toolpath};
use leadscrew_sim::scene::{Drawn, Way};
use leadscrew_sim::speed_profile::Stretch;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use svg::node::element::{Circle, Group, Image, Path};
use svg::Document;

/// The words around the picture.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Caption {
    /// The job's name.
    pub(crate) title: String,
    /// One line of figures: time, distance, lines.
    pub(crate) summary: String,
    /// The S value of a laser's full power (`$30`), at the dark end of the scale; `None` where S is a spindle's speed.
    pub(crate) full_power_s: Option<f64>,
}

// The page, in pixels.
const MOST_PLOT_HEIGHT: f64 = 640.0;
const LEAST_PLOT_HEIGHT: f64 = 160.0;
const SPEED_HEIGHT: f64 = 150.0;
const LEGEND_HEIGHT: f64 = 26.0;

/// Width of a cut that has none of its own: a hair that is seen.
const HAIR: f64 = 1.4;
/// A laser's spot, mm.
const SPOT: f64 = 0.1;
/// Colours of a scale: more cannot be told apart.
const LEVELS: u8 = 24;
/// Pixels of cut between two arrows, and arrows at most.
const ARROW_EVERY: f64 = 90.0;
const ARROWS: usize = 150;

const START: &str = "#2a7f62";

/// The parts of the picture's coordinate system.
struct Plot<'a> {
    path: &'a Toolpath,
    frame: Frame,
    x: Scale,
    y: Scale,
    per_mm: f64,
    is_laser: bool,
    /// The highest and the lowest Z of cuts, mm.
    depth: [f64; 2],
    raster: Option<Raster>,
}

/// Draws the picture of a job: where the tool went, and how fast, where that is known.
pub(crate) fn draw(path: &Toolpath, stretches: &[Stretch], caption: &Caption) -> Document {
    let plot = Plot::new(path, caption);
    let legend_top = plot.frame.bottom() + AXIS_HEIGHT;
    let legend_bottom = legend_top + LEGEND_HEIGHT + 14.0;
    let chart = (!stretches.is_empty()).then_some(Frame {
        top: legend_bottom,
        height: SPEED_HEIGHT,
    });
    let bottom = chart.map_or(legend_bottom, |chart| chart.bottom() + AXIS_HEIGHT + 6.0);
    let mut document = page(bottom, &caption.title, &caption.summary);
    if let Some(raster) = &plot.raster {
        document = document.add(plot.image(raster));
    }
    let document = document
        .add(axes(plot.frame, &plot.x, &plot.y, "X mm", "Y mm"))
        .add(plot.strokes())
        .add(plot.arrows())
        .add(plot.holes())
        .add(plot.ends())
        .add(plot.legend(caption, legend_top));
    match chart {
        Some(frame) => document.add(speed::chart(stretches, frame)),
        None => document,
    }
}

impl<'a> Plot<'a> {
    /// The same number of pixels to a millimetre both ways.
    fn new(path: &'a Toolpath, caption: &Caption) -> Self {
        let [low, high] = path.bounds().map(|p| p.map(f64::from));
        let span = [high[0] - low[0], high[1] - low[1]].map(|s| s.max(1e-3) * 1.08);
        let per_mm = (PLOT_WIDTH / span[0]).min(MOST_PLOT_HEIGHT / span[1]);
        let height = (span[1] * per_mm).max(LEAST_PLOT_HEIGHT);
        let frame = Frame { top: TOP, height };
        let half = [PLOT_WIDTH / per_mm / 2.0, height / per_mm / 2.0];
        let middle = [(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0];
        let ends = |axis: usize| [middle[axis] - half[axis], middle[axis] + half[axis]];
        let ([left, right], [below, above]) = (ends(0), ends(1));
        let cut = path.cut_bounds().unwrap_or_default();
        let is_laser = caption.full_power_s.is_some();
        Self {
            path,
            frame,
            x: Scale::new(left, right, LEFT, LEFT + PLOT_WIDTH),
            y: Scale::new(below, above, frame.bottom(), frame.top),
            per_mm,
            is_laser,
            depth: [cut[1][2], cut[0][2]],
            raster: is_laser.then(|| Raster::of(path.moves())).flatten(),
        }
    }

    fn at(&self, one: &Drawn) -> [f64; 2] {
        [
            self.x.pixel(one.to[0].into()),
            self.y.pixel(one.to[1].into()),
        ]
    }

    /// A move's place on the scale of power or depth, from 0 to [`LEVELS`].
    fn level(&self, pair: &[Drawn]) -> u8 {
        let share = match self.is_laser {
            true => f64::from(pair[1].power),
            false => {
                let middle = f64::from(pair[0].to[2] + pair[1].to[2]) / 2.0;
                let [top, bottom] = self.depth;
                (top - middle) / (top - bottom).max(1e-9)
            }
        };
        (share.clamp(0.0, 1.0) * f64::from(LEVELS)).round() as u8
    }

    fn colour(&self, level: u8) -> String {
        let share = f64::from(level) / f64::from(LEVELS);
        match self.is_laser {
            true => ink::power(share),
            false => ink::depth(share),
        }
    }

    /// The rows of an engraving.
    fn image(&self, raster: &Raster) -> Image {
        let [left, bottom] = [self.x.pixel(raster.low[0]), self.y.pixel(raster.low[1])];
        let [right, top] = [self.x.pixel(raster.high[0]), self.y.pixel(raster.high[1])];
        Image::new()
            .set("x", left)
            .set("y", top)
            .set("width", right - left)
            .set("height", bottom - top)
            .set("preserveAspectRatio", "none")
            .set("href", raster.address(self.per_mm))
    }

    /// All moves: one path a colour, the dark and the deep ones on top.
    fn strokes(&self) -> Group {
        let mut travels = Line::default();
        let mut cuts: BTreeMap<u8, Line> = BTreeMap::new();
        for (index, pair) in self.path.moves().windows(2).enumerate() {
            if self.raster.as_ref().is_some_and(|raster| raster.has(pair)) {
                continue;
            }
            let ends = [self.at(&pair[0]), self.at(&pair[1])];
            match pair[1].way {
                Way::Jump => {}
                Way::Travel => travels.go(index, ends),
                Way::Cut => cuts.entry(self.level(pair)).or_default().go(index, ends),
            }
        }
        let wide = if self.is_laser {
            SPOT * self.per_mm
        } else {
            0.0
        };
        let mut group = Group::new()
            .set("fill", "none")
            .set("stroke-linejoin", "round")
            .set("stroke-linecap", "round");
        if !travels.data.is_empty() {
            let path = Path::new()
                .set("d", travels.data)
                .set("stroke", ink::travel());
            group = group.add(path.set("stroke-width", 0.8).set("stroke-dasharray", "4 3"));
        }
        for (level, cut) in cuts {
            let path = Path::new()
                .set("d", cut.data)
                .set("stroke", self.colour(level));
            group = group.add(path.set("stroke-width", wide.max(HAIR)));
        }
        group
    }

    /// Which way the tool cuts.
    fn arrows(&self) -> Path {
        let mut data = String::new();
        let (mut since, mut count) = (ARROW_EVERY / 2.0, 0);
        for pair in self.path.moves().windows(2) {
            let is_row = self.raster.as_ref().is_some_and(|raster| raster.has(pair));
            if pair[1].way != Way::Cut || is_row || count == ARROWS {
                continue;
            }
            let (from, to) = (self.at(&pair[0]), self.at(&pair[1]));
            let way = [to[0] - from[0], to[1] - from[1]];
            let length = way[0].hypot(way[1]);
            since += length;
            if since < ARROW_EVERY || length < 1e-6 {
                continue;
            }
            (since, count) = (0.0, count + 1);
            let along = way.map(|part| part / length * 4.0);
            let tip = [
                (from[0] + to[0]) / 2.0 + along[0],
                (from[1] + to[1]) / 2.0 + along[1],
            ];
            let back = [tip[0] - 2.0 * along[0], tip[1] - 2.0 * along[1]];
            // Writing to a text cannot fail.
            let _ = write!(
                data,
                "M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}Z",
                tip[0],
                tip[1],
                back[0] - along[1] * 0.8,
                back[1] + along[0] * 0.8,
                back[0] + along[1] * 0.8,
                back[1] - along[0] * 0.8
            );
        }
        Path::new()
            .set("d", data)
            .set("fill", INK)
            .set("fill-opacity", 0.75)
    }

    fn holes(&self) -> Group {
        let mut group = Group::new();
        for [px, py] in self.path.holes() {
            let at = (self.x.pixel(f64::from(*px)), self.y.pixel(f64::from(*py)));
            group = group.add(self.hole(at));
        }
        group
    }

    fn hole(&self, at: (f64, f64)) -> Circle {
        mark(at, 3.0)
            .set("fill", "white")
            .set("stroke", self.colour(LEVELS))
            .set("stroke-width", HAIR)
    }

    fn ends(&self) -> Group {
        let [start, end] = self
            .path
            .ends()
            .map(|[px, py]| (self.x.pixel(f64::from(px)), self.y.pixel(f64::from(py))));
        Group::new()
            .add(start_mark(start))
            .add(mark(end, 3.0).set("fill", INK))
    }

    fn legend(&self, caption: &Caption, top: f64) -> Group {
        let y = top + LEGEND_HEIGHT / 2.0;
        let travel = line([LEFT, y], [LEFT + 34.0, y], &ink::travel());
        let mut group = Group::new()
            .add(travel.set("stroke-dasharray", "4 3"))
            .add(text(LEFT + 42.0, y + 4.0, "travel"))
            .add(start_mark((LEFT + 106.0, y)))
            .add(text(LEFT + 118.0, y + 4.0, "start"))
            .add(mark((LEFT + 166.0, y), 3.0).set("fill", INK))
            .add(text(LEFT + 176.0, y + 4.0, "end"));
        let mut after = LEFT + 226.0;
        if !self.path.holes().is_empty() {
            group = group
                .add(self.hole((after, y)))
                .add(text(after + 10.0, y + 4.0, "hole"));
            after += 60.0;
        }
        group.add(self.scale(after, y, caption))
    }

    /// The scale of power or depth.
    fn scale(&self, left: f64, y: f64, caption: &Caption) -> Group {
        let [top, bottom] = self.depth;
        let (name, ends) = match caption.full_power_s {
            Some(full) => ("laser power S", ["0".to_owned(), label(full)]),
            None if top - bottom < 1e-3 => ("cut at Z", [label(top), String::new()]),
            None => ("cut at Z", [label(top), label(bottom)]),
        };
        let mut group = Group::new().add(text(left, y + 4.0, &format!("{name} {}", ends[0])));
        let from = left + 118.0;
        let flat = ends[1].is_empty();
        for level in 0..=if flat { 0 } else { LEVELS } {
            let at = from + f64::from(level) * 6.0;
            let wide = if flat { 34.0 } else { 6.2 };
            group = group.add(rectangle(at, y - 6.0, wide, 12.0, &self.colour(level)));
        }
        let after = from + f64::from(LEVELS + 1) * 6.0;
        group.add(text(after + 6.0, y + 4.0, &ends[1]))
    }
}

/// Moves as the data of one SVG path.
#[derive(Default)]
struct Line {
    data: String,
    last: Option<usize>,
}

impl Line {
    /// Adds the move with number `index`: where it goes on from the one before, only its end.
    fn go(&mut self, index: usize, [from, to]: [[f64; 2]; 2]) {
        if index
            .checked_sub(1)
            .is_none_or(|before| self.last != Some(before))
        {
            let _ = write!(self.data, "M{:.1} {:.1}", from[0], from[1]);
        }
        let _ = write!(self.data, "L{:.1} {:.1}", to[0], to[1]);
        self.last = Some(index);
    }
}

fn start_mark(at: (f64, f64)) -> Circle {
    mark(at, 6.0)
        .set("fill", "none")
        .set("stroke", START)
        .set("stroke-width", 2)
}

fn mark(at: (f64, f64), radius: f64) -> Circle {
    Circle::new()
        .set("cx", at.0)
        .set("cy", at.1)
        .set("r", radius)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::StrokeKind;

    fn picture(path: &Toolpath, full_power_s: Option<f64>) -> String {
        let caption = Caption {
            title: "a < b & c".to_owned(),
            summary: "1 s".to_owned(),
            full_power_s,
        };
        draw(path, &[], &caption).to_string()
    }

    fn square(z: f64, power: f64) -> Toolpath {
        let mut path = Toolpath::new([0.0; 3], true);
        path.go([0.0, 0.0, z], StrokeKind::cut(power));
        for corner in [[20.0, 0.0], [20.0, 10.0], [0.0, 10.0], [0.0, 0.0]] {
            path.go([corner[0], corner[1], z], StrokeKind::cut(power));
        }
        path
    }

    #[test]
    fn axes_have_names_and_units_and_the_title_is_escaped() {
        let svg = picture(&square(-1.0, 1.0), None);
        for part in [
            "X mm",
            "Y mm",
            "a &lt; b &amp; c",
            ">\ntravel\n<",
            "cut at Z 0",
        ] {
            assert!(svg.contains(part), "{part}");
        }
    }

    #[test]
    fn rpm_is_not_power_and_depth_has_colours() {
        let router = picture(&square(-3.0, 0.5), None);
        assert!(!router.contains("power") && router.contains(&ink::depth(1.0)));
        let laser = picture(&square(0.0, 0.5), Some(1000.0));
        assert!(laser.contains("laser power S 0") && laser.contains(">\n1000\n<"));
        assert!(laser.contains(&ink::power(0.5)) && !laser.contains("cut at Z"));
    }

    #[test]
    fn an_engraving_of_200_000_pixels_is_one_image_and_less_than_a_megabyte() {
        let mut path = Toolpath::new([0.0; 3], true);
        for row in 0..400 {
            let y = f64::from(row) * 0.1;
            path.go([0.0, y, 0.0], StrokeKind::Travel);
            for k in 1..=500 {
                let shade = f64::from((k * 37 + row * 91) % 256) / 255.0;
                path.go([f64::from(k) * 0.1, y, 0.0], StrokeKind::cut(shade));
            }
        }
        let svg = picture(&path, Some(1000.0));
        assert_eq!(svg.matches("<image").count(), 1);
        assert!(svg.len() < 1_000_000, "{} bytes", svg.len());
    }

    #[test]
    fn a_job_that_goes_nowhere_still_has_a_picture() {
        let svg = picture(&Toolpath::new([1.0, 2.0, 3.0], true), None);
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }
}
