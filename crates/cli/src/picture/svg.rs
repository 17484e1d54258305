//! Draws the toolpath and the speed along time as one SVG document.

use super::caption::Caption;
use super::legend;
use super::page::{axes, page, Frame, AXIS_HEIGHT};
use super::plot::Plot;
use super::speed;
use leadscrew_sim::scene::Toolpath;
use leadscrew_sim::speed_profile::Stretch;
use svg::node::element::Group;
use svg::Document;

const SPEED_HEIGHT: f64 = 150.0;

/// Draws the picture of a job: the path of the tool, and its speed if that is known.
pub(crate) fn draw(path: &Toolpath, stretches: &[Stretch], caption: &Caption) -> Document {
    let plot = Plot::new(path, caption);
    let (legend, legend_bottom) = legend::draw(&plot, plot.frame.bottom() + AXIS_HEIGHT);
    let chart = (!stretches.is_empty()).then_some(Frame {
        top: legend_bottom + 14.0,
        height: SPEED_HEIGHT,
    });
    let bottom = chart.map_or(legend_bottom, |chart| chart.bottom() + AXIS_HEIGHT + 6.0);
    let [across, up] = plot.titles();
    let mut document = page(bottom, &caption.title, &caption.summary)
        .add(axes(plot.frame, &plot.x, &plot.y, &across, &up));
    if let Some(image) = plot.image() {
        document = document.add(image);
    }
    let mut moves = Group::new();
    if let Some(travel) = plot.travel_box() {
        moves = moves.add(travel);
    }
    let moves = moves.add(plot.strokes()).add(plot.arrows());
    let document = document
        .add(plot.clipped(moves))
        .add(plot.holes())
        .add(plot.ends())
        .add(legend);
    match chart {
        Some(frame) => document.add(speed::chart(stretches, frame)),
        None => document,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::ink;
    use leadscrew_sim::scene::StrokeKind;

    fn picture(path: &Toolpath, full_power_s: Option<f64>) -> String {
        let caption = Caption {
            title: "a < b & c".to_owned(),
            summary: "1 s".to_owned(),
            work: "cut",
            full_power_s,
            travel: None,
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
            "cut at Z -1",
            ">\nX mm (cut from 0 to 20)",
        ] {
            assert!(svg.contains(part), "{part}");
        }
    }

    #[test]
    fn the_travel_is_a_box_in_the_picture_unless_the_work_would_be_small() {
        let boxed = |[low, high]: [f32; 2]| {
            let place = f64::from(high);
            let mut path = Toolpath::new([place - 90.0, place - 80.0, 0.0], true);
            path.go([place - 30.0, place - 80.0, -1.0], StrokeKind::cut(0.0));
            path.go([place - 30.0, place - 40.0, -1.0], StrokeKind::cut(0.0));
            let caption = Caption {
                title: String::new(),
                summary: String::new(),
                work: "extruded",
                full_power_s: None,
                travel: Some([[low, high]; 2]),
            };
            draw(&path, &[], &caption).to_string()
        };
        // 100 mm and a margin of 4 % on each side are 640 pixels high.
        let side = (64_000.0_f64 / 1.08).round() / 100.0;
        for (ends, from, to) in [([-100.0, 0.0], -90, -30), ([0.0, 100.0], 10, 70)] {
            let near = boxed(ends);
            for part in [
                "travel of the axes",
                &format!("height=\"{side}\""),
                "extruded at Z -1",
                &format!("machine X mm (extruded from {from} to {to})"),
            ] {
                assert!(near.contains(part), "{part} in {near}");
            }
        }
        assert!(!boxed([-1000.0, 0.0]).contains("travel of the axes"));
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
    fn a_tool_is_as_wide_as_it_is_and_a_hole_as_its_drill() {
        let mut path = square(-2.0, 1.0);
        path.tool_mm = 3.0;
        path.go([5.0, 5.0, 1.0], StrokeKind::Travel);
        path.go([5.0, 5.0, -4.0], StrokeKind::cut(1.0));
        path.go([5.0, 5.0, 1.0], StrokeKind::Travel);
        path.tool_mm = 3.175;
        for x in [0.0, 20.0] {
            path.go([x, 5.0, -2.0], StrokeKind::cut(0.0));
        }
        let svg = picture(&path, None);
        // The path is 20 mm long, with half a tool of 3.175 mm added on each side. The plot is 856
        // pixels wide, with a margin of 4 % of the path on each side.
        let per_mm: f64 = 856.0 / (20.0 * 1.08 + 3.175);
        let wide = format!("stroke-width=\"{}\"", (317.5 * per_mm).round() / 100.0);
        assert!(svg.contains(&wide), "{wide} in {svg}");
        let radius = format!("r=\"{}\"", (150.0 * per_mm).round() / 100.0);
        assert!(svg.contains(&radius), "{radius} in {svg}");
        for words in ["tool 3.175 mm", "1 hole of 3 mm down to Z -4"] {
            assert!(svg.contains(words), "{words} in {svg}");
        }
        assert!(!svg.contains("tool 3 mm"));
    }

    #[test]
    fn the_last_layer_of_many_is_on_top() {
        let mut path = Toolpath::new([0.0; 3], true);
        for layer in 1..=50 {
            path.go([0.0, 0.0, f64::from(layer) * 0.2], StrokeKind::cut(0.0));
            path.go([9.0, 0.0, f64::from(layer) * 0.2], StrokeKind::cut(0.0));
        }
        let svg = picture(&path, None);
        let drawn = |share| {
            let stroke = format!("stroke=\"{}\"", ink::depth(share));
            svg.find(&stroke).unwrap()
        };
        assert!(drawn(1.0) < drawn(0.0));
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
