//! The speed along time: `profile --svg` draws the same curve.

use super::columns::Columns;
use super::page::{axes, Frame};
use super::page::{LEFT, PLOT_WIDTH};
use super::scale::Scale;
use leadscrew_sim::speed_profile::Stretch;
use std::fmt::Write as _;
use svg::node::element::{Group, Path};

/// Columns of the chart, one per two pixels.
const COLUMNS: usize = (PLOT_WIDTH / 2.0) as usize;

const SPEED: &str = "#2a7f62";

/// Draws the mean speed of each column of time.
pub(super) fn chart(stretches: &[Stretch], frame: Frame) -> Group {
    let columns = Columns::new(stretches, COLUMNS, 1, |_| 0);
    let speeds: Vec<f64> = columns
        .all
        .iter()
        .map(|one| one.mean_speed * 60.0)
        .collect();
    let top = speeds.iter().copied().fold(0.0, f64::max).max(1.0) * 1.1;
    let x = Scale::new(0.0, columns.seconds.max(1e-3), LEFT, LEFT + PLOT_WIDTH);
    let y = Scale::new(0.0, top, frame.bottom(), frame.top);
    let mut data = format!("M{LEFT} {:.1}", frame.bottom());
    for (index, speed) in speeds.iter().enumerate() {
        let at = x.pixel(columns.time(index) + columns.width / 2.0);
        // Writing to a string cannot fail.
        let _ = write!(data, "L{at:.1} {:.1}", y.pixel(*speed));
    }
    let _ = write!(data, "L{:.1} {:.1}Z", LEFT + PLOT_WIDTH, frame.bottom());
    axes(frame, &x, &y, "time s", "speed mm/min").add(
        Path::new()
            .set("d", data)
            .set("fill", SPEED)
            .set("fill-opacity", 0.25)
            .set("stroke", SPEED),
    )
}
