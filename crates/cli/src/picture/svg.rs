//! Draws the toolpath and the speed chart as one SVG document.

use super::page::{axes, line, page, rectangle, text, Frame};
use super::page::{AXIS_HEIGHT, INK, LEFT, PLOT_WIDTH, TOP};
use super::scale::{label, Scale};
use super::{SpeedChart, Stroke, StrokeKind, Toolpath};
use svg::node::element::{Circle, Group, Path};
use svg::Document;

/// The words around the picture.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Caption {
    /// The job's name.
    pub(crate) title: String,
    /// One line of figures: time, distance, lines.
    pub(crate) summary: String,
    /// The S value of full power (`$30`), at the dark end of the shade bar.
    pub(crate) full_power_s: f64,
}

// The page, in pixels.
const MOST_PLOT_HEIGHT: f64 = 640.0;
const LEAST_PLOT_HEIGHT: f64 = 160.0;
const SPEED_HEIGHT: f64 = 150.0;
const LEGEND_HEIGHT: f64 = 26.0;
/// Columns of the speed chart: one every other pixel.
const SPEED_COLUMNS: usize = (PLOT_WIDTH / 2.0) as usize;

const RAPID: &str = "#4a90d9";
const SPEED: &str = "#2a7f62";

/// Draws the picture of a job: where the tool went, and how fast, where that is known.
pub(crate) fn draw(path: &Toolpath, speed: Option<&SpeedChart>, caption: &Caption) -> Document {
    let (frame, x, y) = plot_area(path);
    let legend_top = frame.bottom() + AXIS_HEIGHT;
    let legend_bottom = legend_top + LEGEND_HEIGHT + 14.0;
    let chart = speed.map(|speed| {
        let (top, height) = (legend_bottom, SPEED_HEIGHT);
        (speed, Frame { top, height })
    });
    let bottom = chart.map_or(legend_bottom, |(_, chart)| {
        chart.bottom() + AXIS_HEIGHT + 6.0
    });
    let document = page(bottom, &caption.title, &caption.summary)
        .add(axes(frame, &x, &y, "X mm", "Y mm"))
        .add(strokes(path, &x, &y))
        .add(holes(path, &x, &y))
        .add(ends(path, &x, &y))
        .add(legend(path, caption, legend_top));
    match chart {
        Some((speed, frame)) => document.add(speed_chart(speed, frame)),
        None => document,
    }
}

/// The toolpath's frame and scales: the same number of pixels to a millimetre both ways.
fn plot_area(path: &Toolpath) -> (Frame, Scale, Scale) {
    let [low, high] = path.bounds().map(|p| p.map(f64::from));
    let span = [high[0] - low[0], high[1] - low[1]].map(|s| s.max(1e-3) * 1.08);
    let per_mm = (PLOT_WIDTH / span[0]).min(MOST_PLOT_HEIGHT / span[1]);
    let height = (span[1] * per_mm).max(LEAST_PLOT_HEIGHT);
    let frame = Frame { top: TOP, height };
    let half = [PLOT_WIDTH / per_mm / 2.0, height / per_mm / 2.0];
    let middle = [(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0];
    let x = Scale::new(
        middle[0] - half[0],
        middle[0] + half[0],
        LEFT,
        LEFT + PLOT_WIDTH,
    );
    let y = Scale::new(
        middle[1] - half[1],
        middle[1] + half[1],
        frame.bottom(),
        frame.top,
    );
    (frame, x, y)
}

fn strokes(path: &Toolpath, x: &Scale, y: &Scale) -> Group {
    let powered = has_power(path);
    let mut group = Group::new()
        .set("fill", "none")
        .set("stroke-linejoin", "round")
        .set("stroke-linecap", "round");
    for stroke in &path.strokes() {
        group = group.add(drawn(stroke, powered, x, y));
    }
    group
}

fn holes(path: &Toolpath, x: &Scale, y: &Scale) -> Group {
    let mut group = Group::new();
    for [px, py] in path.holes() {
        let at = (x.pixel(f64::from(*px)), y.pixel(f64::from(*py)));
        group = group.add(hole(at, has_power(path)));
    }
    group
}

fn hole(at: (f64, f64), powered: bool) -> Circle {
    mark(at, 3.0)
        .set("fill", "white")
        .set("stroke", colour(StrokeKind::SHADES, powered))
        .set("stroke-width", 1.4)
}

fn drawn(stroke: &Stroke, powered: bool, x: &Scale, y: &Scale) -> Path {
    let mut data = String::with_capacity(stroke.points.len() * 14);
    for (k, [px, py]) in stroke.points.iter().enumerate() {
        let command = if k == 0 { 'M' } else { 'L' };
        let (px, py) = (x.pixel(f64::from(*px)), y.pixel(f64::from(*py)));
        data.push_str(&format!("{command}{px:.2} {py:.2}"));
    }
    let path = Path::new().set("d", data);
    match stroke.kind {
        StrokeKind::Travel => path
            .set("stroke", RAPID)
            .set("stroke-width", 0.8)
            .set("stroke-dasharray", "4 3"),
        StrokeKind::Cut { shade } => path
            .set("stroke", colour(shade, powered))
            .set("stroke-width", 1.4),
    }
}

/// Whether any cut has power: a job without S words is drawn as if at full power.
fn has_power(path: &Toolpath) -> bool {
    path.strokes()
        .iter()
        .any(|s| matches!(s.kind, StrokeKind::Cut { shade } if shade > 0))
}

/// Pale for no power, dark for full power.
fn colour(shade: u8, powered: bool) -> String {
    const PALE: [f64; 3] = [247.0, 222.0, 200.0];
    const DARK: [f64; 3] = [92.0, 16.0, 16.0];
    let share = if powered {
        f64::from(shade) / f64::from(StrokeKind::SHADES)
    } else {
        1.0
    };
    let [r, g, b] = [0, 1, 2].map(|k: usize| (PALE[k] + (DARK[k] - PALE[k]) * share) as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn ends(path: &Toolpath, x: &Scale, y: &Scale) -> Group {
    let [start, end] = path
        .ends()
        .map(|[px, py]| (x.pixel(f64::from(px)), y.pixel(f64::from(py))));
    Group::new()
        .add(
            mark(start, 6.0)
                .set("fill", "none")
                .set("stroke", SPEED)
                .set("stroke-width", 2),
        )
        .add(mark(end, 3.0).set("fill", INK))
}

fn mark(at: (f64, f64), radius: f64) -> Circle {
    Circle::new()
        .set("cx", at.0)
        .set("cy", at.1)
        .set("r", radius)
}

fn legend(path: &Toolpath, caption: &Caption, top: f64) -> Group {
    let y = top + LEGEND_HEIGHT / 2.0;
    let powered = has_power(path);
    let sample =
        |from: f64| line([from, y], [from + 34.0, y], RAPID).set("stroke-dasharray", "4 3");
    let cut = line(
        [LEFT, y],
        [LEFT + 34.0, y],
        &colour(StrokeKind::SHADES, powered),
    );
    let mut group = Group::new()
        .add(cut.set("stroke-width", 2))
        .add(text(LEFT + 42.0, y + 4.0, "cut"))
        .add(sample(LEFT + 90.0))
        .add(text(LEFT + 132.0, y + 4.0, "rapid"))
        .add(
            mark((LEFT + 196.0, y), 6.0)
                .set("fill", "none")
                .set("stroke", SPEED)
                .set("stroke-width", 2),
        )
        .add(text(LEFT + 208.0, y + 4.0, "start"))
        .add(mark((LEFT + 264.0, y), 3.0).set("fill", INK))
        .add(text(LEFT + 274.0, y + 4.0, "end"));
    let mut after = LEFT + 340.0;
    if !path.holes().is_empty() {
        after += 40.0;
        group =
            group
                .add(hole((LEFT + 318.0, y), powered))
                .add(text(LEFT + 328.0, y + 4.0, "hole"));
    }
    if powered {
        group = group.add(shade_bar(after, y, caption.full_power_s));
    }
    group
}

fn shade_bar(left: f64, y: f64, full_power_s: f64) -> Group {
    let mut group = Group::new().add(text(left, y + 4.0, "power S 0"));
    let from = left + 62.0;
    for step in 0..=16u8 {
        let shade = (f64::from(step) / 16.0 * f64::from(StrokeKind::SHADES)) as u8;
        let at = from + f64::from(step) * 9.0;
        group = group.add(rectangle(at, y - 6.0, 9.0, 12.0, &colour(shade, true)));
    }
    let after = from + 17.0 * 9.0;
    group.add(text(after + 6.0, y + 4.0, &label(full_power_s)))
}

fn speed_chart(speed: &SpeedChart, frame: Frame) -> Group {
    let points = thinned(speed);
    let top = points.iter().map(|p| p[1]).fold(0.0, f64::max).max(1.0) * 1.1;
    let x = Scale::new(0.0, speed.end().max(1e-3), LEFT, LEFT + PLOT_WIDTH);
    let y = Scale::new(0.0, top, frame.bottom(), frame.top);
    let mut data = format!("M{LEFT} {}", frame.bottom());
    for [time, value] in &points {
        data.push_str(&format!("L{:.1} {:.1}", x.pixel(*time), y.pixel(*value)));
    }
    data.push_str(&format!("L{:.1} {}Z", x.pixel(speed.end()), frame.bottom()));
    axes(frame, &x, &y, "time s", "speed mm/min").add(
        Path::new()
            .set("d", data)
            .set("fill", SPEED)
            .set("fill-opacity", 0.25)
            .set("stroke", SPEED),
    )
}

/// The chart's points, neighbours averaged until there is at most one a column.
fn thinned(speed: &SpeedChart) -> Vec<[f64; 2]> {
    let points = speed.points();
    let joined = points.len().div_ceil(SPEED_COLUMNS).max(1);
    points
        .chunks(joined)
        .map(|group| {
            let n = group.len() as f64;
            let sum = group
                .iter()
                .fold([0.0, 0.0], |s, p| [s[0] + p[0], s[1] + p[1]]);
            [sum[0] / n, sum[1] / n]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn caption() -> Caption {
        Caption {
            title: "a < b & c".to_owned(),
            summary: "1 s".to_owned(),
            full_power_s: 1000.0,
        }
    }

    fn picture(path: &Toolpath) -> String {
        let mut speed = SpeedChart::default();
        speed.went(0.5, [1.0, 0.0, 0.0]);
        draw(path, Some(&speed), &caption()).to_string()
    }

    #[test]
    fn axes_have_names_and_units_and_the_title_is_escaped() {
        let mut path = Toolpath::new([0.0; 3], true);
        path.go([10.0, 5.0, 0.0], StrokeKind::cut(0.0));
        let svg = picture(&path);
        for part in [
            "X mm",
            "Y mm",
            "time s",
            "speed mm/min",
            "a &lt; b &amp; c",
            ">\nrapid\n<",
        ] {
            assert!(svg.contains(part), "{part}");
        }
        assert!(!svg.contains("power S"));
    }

    #[test]
    fn a_laser_job_has_a_shade_bar_up_to_full_power() {
        let mut path = Toolpath::new([0.0; 3], true);
        path.go([10.0, 0.0, 0.0], StrokeKind::cut(0.5));
        let svg = picture(&path);
        assert!(
            svg.contains("power S 0") && svg.contains(">\n1000\n<"),
            "{svg}"
        );
    }

    #[test]
    fn a_job_that_goes_nowhere_still_has_a_picture() {
        let svg = picture(&Toolpath::new([1.0, 2.0, 3.0], true));
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }
}
