//! Draws the limits in force: speed, acceleration and power along time, and a band that shows which
//! limit binds when.
//!
//! ```text
//!  | mm/min  speed: mean in each column, and from the least to the highest |
//!  | mm/s2   acceleration: from the least to the highest                   |
//!  | %       power, if there is any                                     |
//!  | band    each column shared out among the limits that bind in it       |
//!  legend: colour, limit, share of the time
//! ```
//!
//! Time is cut into one column per pixel, so that a picture of a million moves is not larger than a
//! picture of ten moves.

use super::columns::{Column, Columns};
use super::page::{axes, page, rectangle, text, Frame};
use super::page::{AXIS_HEIGHT, LEFT, PLOT_WIDTH, TOP};
use super::scale::Scale;
use leadscrew_sim::speed_profile::{Limit, Slow, SpeedLimit, Stretch};
use svg::node::element::{Group, Path, Title};
use svg::Document;

/// Columns of the picture, one per pixel.
const COLUMNS: usize = PLOT_WIDTH as usize;

const SPEED_HEIGHT: f64 = 220.0;
const LOW_HEIGHT: f64 = 100.0;
const BAND_HEIGHT: f64 = 60.0;
/// Room between two plots, for the tick labels of the upper one.
const GAP: f64 = 26.0;
const LEGEND_ROW: f64 = 20.0;
const LEGEND_COLUMNS: usize = 3;

/// The least share of the time with which a limit is in the legend.
const LEAST_SHARE: f64 = 0.0005;

const SPEED: &str = "#2a7f62";
const ACCELERATION: &str = "#555555";
const POWER: &str = "#a03020";

/// Limits that share a colour and a line of the legend.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Family {
    Feed,
    Rate,
    Curve,
    StepRate,
    SlowerMove,
    Corner,
    Stop,
    LookAhead,
    NoLine,
    Rest,
    Cycle,
}

impl Family {
    const ALL: [Self; 11] = [
        Self::Feed,
        Self::Rate,
        Self::Curve,
        Self::StepRate,
        Self::SlowerMove,
        Self::Corner,
        Self::Stop,
        Self::LookAhead,
        Self::NoLine,
        Self::Rest,
        Self::Cycle,
    ];

    fn of(limit: Limit) -> Self {
        match limit {
            Limit::Speed(SpeedLimit::Feed) => Self::Feed,
            Limit::Speed(SpeedLimit::Rate(_)) => Self::Rate,
            Limit::Speed(SpeedLimit::Arc | SpeedLimit::Curve) => Self::Curve,
            Limit::Speed(SpeedLimit::StepRate) => Self::StepRate,
            Limit::Acceleration(_, slow) | Limit::Slow(slow) => match slow {
                Slow::Corner => Self::Corner,
                Slow::Stop => Self::Stop,
                Slow::LookAhead => Self::LookAhead,
                Slow::NoLine => Self::NoLine,
                Slow::Move(_) => Self::SlowerMove,
            },
            Limit::Rest => Self::Rest,
            Limit::Cycle => Self::Cycle,
        }
    }

    fn colour(self) -> &'static str {
        match self {
            Self::Feed => "#2a9d6f",
            Self::Rate => "#3f7fd0",
            Self::Curve => "#9460c0",
            Self::StepRate => "#7a5230",
            Self::SlowerMove => "#8fb03a",
            Self::Corner => "#ee9b2d",
            Self::Stop => "#c9a800",
            Self::LookAhead => "#d5362b",
            Self::NoLine => "#e26fb0",
            Self::Rest => "#b4b4b4",
            Self::Cycle => "#8d99a6",
        }
    }

    fn label(self) -> &'static str {
        match self {
            Self::Feed => "programmed feed (F)",
            Self::Rate => "axis rate ($110…)",
            Self::Curve => "curve ($120…)",
            Self::StepRate => "step rate of the board",
            Self::SlowerMove => "ramp at a slower move ($120…)",
            Self::Corner => "ramp at a corner ($120…, $11)",
            Self::Stop => "ramp at a stop ($120…)",
            Self::LookAhead => "end of the look-ahead",
            Self::NoLine => "no line in time",
            Self::Rest => "at rest",
            Self::Cycle => "homing",
        }
    }

    fn index(self) -> usize {
        Self::ALL
            .iter()
            .position(|other| *other == self)
            .unwrap_or(0)
    }
}

/// Draws the profile of a job.
pub(crate) fn draw_limits(stretches: &[Stretch], title: &str, summary: &str) -> Document {
    let groups = Family::ALL.len();
    let columns = Columns::new(stretches, COLUMNS, groups, |limit| {
        Family::of(limit).index()
    });
    let time = Scale::new(0.0, columns.seconds.max(1e-3), LEFT, LEFT + PLOT_WIDTH);
    let mut top = TOP;
    let mut frame = |height: f64| {
        let frame = Frame { top, height };
        top += height + GAP;
        frame
    };
    let speed = speed_plot(&columns, frame(SPEED_HEIGHT), &time);
    let acceleration = acceleration_plot(&columns, frame(LOW_HEIGHT), &time);
    let power = columns
        .all
        .iter()
        .any(|column| column.power[1] > 0.0)
        .then(|| power_plot(&columns, frame(LOW_HEIGHT), &time));
    let band_frame = frame(BAND_HEIGHT);
    let band = band(&columns, band_frame, &time);
    let (legend, bottom) = legend(&columns, band_frame.bottom() + AXIS_HEIGHT + 8.0);
    let document = page(bottom + 10.0, title, summary)
        .add(speed)
        .add(acceleration);
    let document = power.into_iter().fold(document, Document::add);
    document.add(band).add(legend)
}

fn speed_plot(columns: &Columns, frame: Frame, time: &Scale) -> Group {
    let top = highest(columns, |c| c.speed[1]) * 60.0;
    let y = Scale::new(0.0, top.max(1e-3) * 1.08, frame.bottom(), frame.top);
    let range = outline(columns, time, |c| c.speed.map(|v| y.pixel(v * 60.0)));
    let mean = curve(columns, time, |c| y.pixel(c.mean_speed * 60.0));
    let below = outline(columns, time, |c| {
        [0.0, c.mean_speed * 60.0].map(|v| y.pixel(v))
    });
    axes(frame, time, &y, "", "speed mm/min")
        .add(area(range, SPEED, 0.3))
        .add(area(below, SPEED, 0.15))
        .add(mean.set("stroke", SPEED).set("stroke-width", 1.2))
}

fn acceleration_plot(columns: &Columns, frame: Frame, time: &Scale) -> Group {
    let top = highest(columns, |c| c.acceleration[1].max(-c.acceleration[0]));
    let top = top.max(1e-3) * 1.08;
    let y = Scale::new(-top, top, frame.bottom(), frame.top);
    let range = outline(columns, time, |c| {
        let [low, high] = c.acceleration;
        [low.min(0.0), high.max(0.0)].map(|a| y.pixel(a))
    });
    axes(frame, time, &y, "", "accel. mm/s²").add(area(range, ACCELERATION, 0.55))
}

fn power_plot(columns: &Columns, frame: Frame, time: &Scale) -> Group {
    let y = Scale::new(0.0, 105.0, frame.bottom(), frame.top);
    let range = outline(columns, time, |c| c.power.map(|p| y.pixel(p * 100.0)));
    let mean = curve(columns, time, |c| y.pixel(c.mean_power * 100.0));
    axes(frame, time, &y, "", "power %")
        .add(area(range, POWER, 0.3))
        .add(mean.set("stroke", POWER).set("stroke-width", 1.0))
}

/// A band in which each column is divided among the groups, from the bottom up.
fn band(columns: &Columns, frame: Frame, time: &Scale) -> Group {
    let y = Scale::new(0.0, 100.0, frame.bottom(), frame.top);
    let mut group = axes(frame, time, &y, "time s", "binds %");
    for (index, of) in Family::ALL.iter().enumerate() {
        let data = boxes(columns, time, |column| {
            let below: f64 = column.shares.iter().take(index).sum();
            let share = column.shares.get(index).copied().unwrap_or(0.0);
            (share > 0.0).then(|| [below, below + share].map(|s| y.pixel(s * 100.0)))
        });
        if !data.is_empty() {
            let path = Path::new().set("d", data).set("fill", of.colour());
            group = group.add(path.add(Title::new(of.label())));
        }
    }
    group.add(rectangle(LEFT, frame.top, PLOT_WIDTH, frame.height, "none").set("stroke", "#333333"))
}

/// Rectangles for runs of columns whose edges are the same.
fn boxes(columns: &Columns, time: &Scale, edges: impl Fn(&Column) -> Option<[f64; 2]>) -> String {
    let rounded = |column: &Column| edges(column).map(|e| e.map(|y| (y * 10.0).round() as i64));
    let mut data = String::new();
    let mut from = 0;
    for run in columns
        .all
        .chunk_by(|one, next| rounded(one) == rounded(next))
    {
        let to = from + run.len();
        if let Some([bottom, top]) = run.first().and_then(rounded) {
            let [x0, x1] = [from, to].map(|k| time.pixel(columns.time(k)));
            let [bottom, top] = [bottom, top].map(|y| y as f64 / 10.0);
            data.push_str(&format!("M{x0:.1} {bottom}H{x1:.1}V{top}H{x0:.1}Z"));
        }
        from = to;
    }
    data
}

fn legend(columns: &Columns, top: f64) -> (Group, f64) {
    let mut group = Group::new();
    let width = PLOT_WIDTH / LEGEND_COLUMNS as f64;
    let bound = Family::ALL
        .into_iter()
        .filter(|of| columns.total.get(of.index()).copied().unwrap_or(0.0) >= LEAST_SHARE);
    let mut rows = 0;
    for (place, of) in bound.enumerate() {
        let x = LEFT + (place % LEGEND_COLUMNS) as f64 * width;
        let y = top + (place / LEGEND_COLUMNS) as f64 * LEGEND_ROW;
        let share = columns.total.get(of.index()).copied().unwrap_or(0.0) * 100.0;
        group = group
            .add(rectangle(x, y - 10.0, 14.0, 12.0, of.colour()))
            .add(text(x + 20.0, y, &format!("{share:.1} %  {}", of.label())));
        rows = place / LEGEND_COLUMNS + 1;
    }
    (group, top + rows as f64 * LEGEND_ROW)
}

fn highest(columns: &Columns, of: impl Fn(&Column) -> f64) -> f64 {
    columns.all.iter().map(of).fold(0.0, f64::max)
}

/// A path along the upper edges and back along the lower ones.
fn outline(columns: &Columns, time: &Scale, edges: impl Fn(&Column) -> [f64; 2]) -> String {
    let there = points(columns, time, |column| edges(column)[1]);
    let mut back = points(columns, time, |column| edges(column)[0]);
    back.reverse();
    format!("M{}Z", [there, back].concat().join("L"))
}

/// The points of a curve, as path data. Points in the middle of a level stretch are left out.
fn points(columns: &Columns, time: &Scale, y: impl Fn(&Column) -> f64) -> Vec<String> {
    let tenths = |column: &Column| (y(column) * 10.0).round() as i64;
    let heights: Vec<i64> = columns.all.iter().map(tenths).collect();
    let level = |k: usize| {
        k > 0
            && heights
                .get(k - 1..k + 2)
                .is_some_and(|h| h[0] == h[1] && h[1] == h[2])
    };
    let shown = heights
        .iter()
        .enumerate()
        .filter(|(index, _)| !level(*index));
    shown
        .map(|(index, height)| {
            let x = time.pixel(columns.time(index) + columns.width / 2.0);
            format!("{x:.1} {}", *height as f64 / 10.0)
        })
        .collect()
}

fn area(data: String, colour: &str, opacity: f64) -> Path {
    Path::new()
        .set("d", data)
        .set("fill", colour)
        .set("fill-opacity", opacity)
        .set("stroke", colour)
        .set("stroke-width", 0.4)
}

fn curve(columns: &Columns, time: &Scale, y: impl Fn(&Column) -> f64) -> Path {
    let data = format!("M{}", points(columns, time, y).join("L"));
    Path::new().set("d", data).set("fill", "none")
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_sim::clock::{Cycle, CPU_HZ};
    use leadscrew_sim::speed_profile::Phase;

    fn job(power: f64) -> Vec<Stretch> {
        let stretch = |from: u64, phase, limit| Stretch {
            begin: Cycle(from * CPU_HZ),
            end: Cycle((from + 1) * CPU_HZ),
            line: 1,
            phase,
            length: 5.0,
            speed: [0.0, 10.0],
            power: [0.0, power],
            limit,
        };
        vec![
            stretch(0, Phase::Accelerate, Limit::Acceleration(0, Slow::Stop)),
            stretch(1, Phase::Cruise, Limit::Speed(SpeedLimit::Feed)),
        ]
    }

    #[test]
    fn the_plots_have_units_and_the_legend_shares() {
        let svg = draw_limits(&job(0.0), "a < b", "2 s").to_string();
        for part in [
            "speed mm/min",
            "accel. mm/s²",
            "time s",
            "50.0 %  programmed feed (F)",
            "50.0 %  ramp at a stop ($120…)",
            "a &lt; b",
        ] {
            assert!(svg.contains(part), "{part} in {svg}");
        }
        assert!(!svg.contains("power %") && !svg.contains("NaN"));
    }

    #[test]
    fn power_has_a_plot_where_there_is_any() {
        assert!(draw_limits(&job(0.5), "", "")
            .to_string()
            .contains("power %"));
    }

    #[test]
    fn an_empty_job_still_has_a_picture() {
        let svg = draw_limits(&[], "", "").to_string();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn a_long_job_has_no_larger_a_picture_than_the_columns_allow() {
        let stretches: Vec<Stretch> = (0..100_000u64)
            .map(|k| Stretch {
                begin: Cycle(k * 1000),
                end: Cycle((k + 1) * 1000),
                ..job(0.5)[(k % 2) as usize]
            })
            .collect();
        let size = draw_limits(&stretches, "", "").to_string().len();
        assert!(size < 200_000, "{size}");
    }
}
