//! The legend of a job's picture. It names only things that the picture shows.

use super::ink;
use super::page::{line, rectangle, text, LEFT, PLOT_WIDTH};
use super::plot::{end_mark, start_mark, Plot, HAIR, LEVELS, PLAIN_HOLE};
use super::scale::label;
use leadscrew_sim::scene::Hole;
use svg::node::element::Group;
use svg::Node;

const ROW: f64 = 26.0;
/// The approximate width of a letter, pixels.
const LETTER: f64 = 6.3;
const GAP: f64 = 18.0;
/// Width of a colour's rectangle, and of one step of a scale, pixels.
const SWATCH: f64 = 22.0;
const STEP: f64 = 6.0;
/// The largest radius of a hole's mark, pixels.
const LARGEST: f64 = 10.0;

/// Draws the legend from `top` on; returns its bottom edge.
pub(super) fn draw(plot: &Plot<'_>, top: f64) -> (Group, f64) {
    let mut rows = Rows {
        group: Group::new(),
        x: LEFT,
        y: top + ROW / 2.0,
    };
    let travel = match plot.leads_out {
        true => "travel, beyond the picture as well",
        false => "travel",
    };
    rows.add(34.0, travel, |[x, y]| {
        line([x, y], [x + 34.0, y], &ink::travel()).set("stroke-dasharray", "4 3")
    });
    if plot.shows_travel() {
        rows.add(34.0, "travel of the axes", |[x, y]| {
            line([x, y], [x + 34.0, y], ink::travel_box()).set("stroke-width", 2)
        });
    }
    let [start, end] = plot.seen_ends();
    if start.is_some() {
        rows.add(12.0, "start", |[x, y]| start_mark((x + 6.0, y)));
    }
    if end.is_some() {
        rows.add(6.0, "end", |[x, y]| end_mark((x + 3.0, y)));
    }
    match plot.full_power_s {
        Some(full) => scale(&mut rows, plot, "laser power S", ["0".into(), label(full)]),
        None => depths(&mut rows, plot),
    }
    for tool in plot.tools() {
        let wide = plot.pixels(tool).clamp(HAIR, 2.0 * LARGEST);
        rows.add(
            SWATCH + wide,
            &format!("tool {} mm", millimetres(tool)),
            |[x, y]| {
                let ends = [[x + wide / 2.0, y], [x + wide / 2.0 + SWATCH, y]];
                let swept = line(ends[0], ends[1], &ink::pale_depth(1.0))
                    .set("stroke-width", wide)
                    .set("stroke-linecap", "round");
                Group::new()
                    .add(swept)
                    .add(line(ends[0], ends[1], &ink::depth(1.0)))
            },
        );
    }
    for (hole, count) in drills(&plot.holes) {
        holes(&mut rows, plot, hole, count);
    }
    let bottom = rows.y + ROW / 2.0;
    (rows.group, bottom)
}

/// Places the legend's entries from left to right and row by row.
struct Rows {
    group: Group,
    x: f64,
    y: f64,
}

impl Rows {
    /// Adds a mark of this width and the words after it.
    fn add<N: Node>(&mut self, width: f64, words: &str, mark: impl FnOnce([f64; 2]) -> N) {
        let whole = width + 8.0 + words.chars().count() as f64 * LETTER + GAP;
        if self.x > LEFT && self.x + whole - GAP > LEFT + PLOT_WIDTH {
            (self.x, self.y) = (LEFT, self.y + ROW);
        }
        let drawn = mark([self.x, self.y]);
        let words = text(self.x + width + 8.0, self.y + 4.0, words);
        self.group = std::mem::take(&mut self.group).add(drawn).add(words);
        self.x += whole;
    }
}

/// The heights of cuts: each one if they are few, else as a scale.
fn depths(rows: &mut Rows, plot: &Plot<'_>) {
    let [top, bottom] = plot.depth;
    if plot.passes.is_empty() && plot.has_cuts() {
        let ends = [top, bottom].map(millimetres);
        let name = match plot.builds_up() {
            true => "layers at Z".to_owned(),
            false => format!("{} at Z", plot.work),
        };
        return scale(rows, plot, &name, ends);
    }
    for (number, z) in plot.passes.iter().enumerate() {
        let colour = plot.colour(plot.level_of(*z));
        let before = match (number, plot.builds_up()) {
            (0, true) => "layer at Z ".to_owned(),
            (0, false) => format!("{} at Z ", plot.work),
            (_, _) => "Z ".to_owned(),
        };
        rows.add(SWATCH, &format!("{before}{}", millimetres(*z)), |[x, y]| {
            rectangle(x, y - 6.0, SWATCH, 12.0, &colour)
        });
    }
}

/// A scale of colours between two values.
fn scale(rows: &mut Rows, plot: &Plot<'_>, name: &str, [from, to]: [String; 2]) {
    let before = name.chars().count() + 1 + from.chars().count();
    let before = before as f64 * LETTER + 8.0;
    let width = before + f64::from(LEVELS + 1) * STEP;
    rows.add(width, &to, |[x, y]| {
        let mut group = Group::new().add(text(x, y + 4.0, &format!("{name} {from}")));
        for level in 0..=LEVELS {
            let at = x + before + f64::from(level) * STEP;
            let step = rectangle(at, y - 6.0, STEP + 0.2, 12.0, &plot.colour(level));
            group = group.add(step);
        }
        group
    });
}

fn holes(rows: &mut Rows, plot: &Plot<'_>, hole: Hole, count: usize) {
    let plural = if count == 1 { "hole" } else { "holes" };
    let size = match hole.tool_mm > 0.0 {
        true => format!(" of {} mm", millimetres(hole.tool_mm)),
        false => String::new(),
    };
    let words = format!(
        "{count} {plural}{size} down to Z {}",
        millimetres(hole.bottom)
    );
    let radius = match hole.tool_mm > 0.0 {
        true => (plot.pixels(hole.tool_mm) / 2.0).clamp(PLAIN_HOLE, LARGEST),
        false => PLAIN_HOLE,
    };
    rows.add(2.0 * radius, &words, |[x, y]| {
        plot.hole(&hole, (x + radius, y)).set("r", radius)
    });
}

/// The drills, in the order in which they are used. For each: its deepest hole, and the number of
/// its holes.
fn drills(holes: &[Hole]) -> Vec<(Hole, usize)> {
    let mut drills: Vec<(Hole, usize)> = Vec::new();
    for hole in holes {
        match drills
            .iter_mut()
            .find(|(other, _)| other.tool_mm == hole.tool_mm)
        {
            Some((deepest, count)) => {
                deepest.bottom = deepest.bottom.min(hole.bottom);
                *count += 1;
            }
            None => drills.push((*hole, 1)),
        }
    }
    drills
}

/// A length rounded to a thousandth of a millimetre.
fn millimetres(mm: f32) -> String {
    label((f64::from(mm) * 1000.0).round() / 1000.0)
}
