//! The page that pictures are drawn on: its sizes, its title, and plots with a grid and labelled
//! axes.

use super::scale::{label, Scale};
use leadscrew_files::plain;
use svg::node::element::{Group, Line, Rectangle, Text};
use svg::Document;

// The page, in pixels.
const WIDTH: f64 = 960.0;
pub(super) const LEFT: f64 = 80.0;
const RIGHT: f64 = 24.0;
/// The top of the first plot, under the title.
pub(super) const TOP: f64 = 66.0;
pub(super) const PLOT_WIDTH: f64 = WIDTH - LEFT - RIGHT;
pub(super) const MOST_HEIGHT: f64 = 640.0;
/// Room for tick labels and an axis title under a plot.
pub(super) const AXIS_HEIGHT: f64 = 46.0;
/// Approximate distances between ticks, pixels: horizontally, and vertically in a plot of some
/// height.
const TICK_SPACING: f64 = 80.0;
const TICK_RISE: f64 = 50.0;
/// The approximate number of vertical ticks in a low plot.
const LEAST_TICKS: f64 = 4.0;

pub(super) const INK: &str = "#333333";
const GRID: &str = "#e4e4e4";

/// A plot's rectangle on the page.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    pub(super) top: f64,
    pub(super) height: f64,
}

impl Frame {
    pub(super) fn bottom(&self) -> f64 {
        self.top + self.height
    }
}

/// A white page with a title and a line of figures.
pub(super) fn page(height: f64, title: &str, summary: &str) -> Document {
    let heading = text(LEFT, 28.0, title)
        .set("font-size", 18)
        .set("font-weight", "bold");
    Document::new()
        .set("viewBox", (0, 0, WIDTH, height))
        .set("width", WIDTH)
        .set("height", height)
        .set("font-family", "Helvetica, Arial, sans-serif")
        .set("font-size", 12)
        .add(rectangle(0.0, 0.0, WIDTH, height, "white"))
        .add(Group::new().add(heading).add(text(LEFT, 50.0, summary)))
}

/// Grid, frame, tick labels and titles of a plot.
pub(super) fn axes(frame: Frame, x: &Scale, y: &Scale, x_title: &str, y_title: &str) -> Group {
    let mut group = Group::new();
    for value in x.ticks(TICK_SPACING) {
        let at = x.pixel(value);
        group = group
            .add(line([at, frame.top], [at, frame.bottom()], GRID))
            .add(text(at, frame.bottom() + 16.0, &label(value)).set("text-anchor", "middle"));
    }
    for value in y.ticks(TICK_RISE.min(frame.height / LEAST_TICKS)) {
        let at = y.pixel(value);
        group = group
            .add(line([LEFT, at], [LEFT + PLOT_WIDTH, at], GRID))
            .add(text(LEFT - 6.0, at + 4.0, &label(value)).set("text-anchor", "end"));
    }
    let outline = rectangle(LEFT, frame.top, PLOT_WIDTH, frame.height, "none").set("stroke", INK);
    let middle = (LEFT + PLOT_WIDTH / 2.0, frame.top + frame.height / 2.0);
    group
        .add(outline)
        .add(text(middle.0, frame.bottom() + 36.0, x_title).set("text-anchor", "middle"))
        .add(text(0.0, 0.0, y_title).set("text-anchor", "middle").set(
            "transform",
            format!("translate(22 {}) rotate(-90)", middle.1),
        ))
}

/// Pixels rounded to two decimals. Finer differences are not visible, and would change with each
/// tick of a job's time.
fn hundredths(pixels: f64) -> f64 {
    (pixels * 100.0).round() / 100.0
}

pub(super) fn text(x: f64, y: f64, content: &str) -> Text {
    // A name may have characters that XML has not.
    Text::new(plain(content))
        .set("x", hundredths(x))
        .set("y", hundredths(y))
        .set("fill", INK)
}

pub(super) fn line(from: [f64; 2], to: [f64; 2], colour: &str) -> Line {
    Line::new()
        .set("x1", hundredths(from[0]))
        .set("y1", hundredths(from[1]))
        .set("x2", hundredths(to[0]))
        .set("y2", hundredths(to[1]))
        .set("stroke", colour)
}

pub(super) fn rectangle(x: f64, y: f64, width: f64, height: f64, fill: &str) -> Rectangle {
    Rectangle::new()
        .set("x", hundredths(x))
        .set("y", hundredths(y))
        .set("width", hundredths(width))
        .set("height", hundredths(height))
        .set("fill", fill)
}
