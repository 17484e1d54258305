//! The centres of arcs. An arc that cannot exist is a mistake of the file: a machine would refuse
//! it in mid-board.

use super::shape::Centre;
use crate::{Mm, Point};

/// The greatest difference between the distances of an arc's two ends from the centre, mm, since a
/// file's numbers are rounded. GRBL allows as much.
const ROUNDING: f64 = 0.005;
/// On a large arc the difference may also be this share of the radius, but at most `MOST` mm.
const SHARE: f64 = 0.001;
const MOST: f64 = 0.5;

/// The centre of an arc of this radius that leads along `way`.
///
/// Rounding may make the radius of half a circle too short. The centre is then in the middle of the
/// way.
pub(super) fn by_radius(radius: Mm, way: Point) -> Result<Centre, &'static str> {
    if radius <= Mm::ZERO {
        return Err("a radius is more than 0");
    }
    if way == Point::ORIGIN {
        return Err("the arc ends where it begins: a whole circle needs I and J");
    }
    if square(way.x) + square(way.y) <= 4 * square(radius) {
        return Ok(Centre::Radius(radius));
    }
    if length(way) / 2.0 - radius.to_f64() > ROUNDING {
        return Err("the arc ends farther away than two radii");
    }
    let half = |length: Mm| Mm::from_nanos(length.nanos() / 2);
    Ok(Centre::Offset(Point {
        x: half(way.x),
        y: half(way.y),
    }))
}

/// The centre of an arc that leads along `way`; `centre` is the way from the start to the centre.
pub(super) fn by_centre(centre: Point, way: Point) -> Result<Centre, &'static str> {
    let radius = length(centre);
    let miss = (length(way - centre) - radius).abs();
    if miss > ROUNDING.max(MOST.min(radius * SHARE)) {
        return Err("the centre is not as far from the arc's end as from its start");
    }
    Ok(Centre::Offset(centre))
}

fn length(way: Point) -> f64 {
    way.x.to_f64().hypot(way.y.to_f64())
}

fn square(length: Mm) -> i128 {
    i128::from(length.nanos()).pow(2)
}
