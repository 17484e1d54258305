//! Arcs as chords.

use std::f64::consts::TAU;

/// The ends of the chords of an arc or helix, by its centre or radius.
pub(super) fn chords(
    from: [f64; 3],
    to: [f64; 3],
    centre: [Option<f64>; 2],
    radius: Option<f64>,
    clockwise: bool,
    tolerance: f64,
) -> Result<Vec<[f64; 3]>, &'static str> {
    let way = match radius {
        Some(radius) => centre_of(from, to, radius, clockwise)?,
        None if centre == [None; 2] => return Err("an arc needs I and J, or R"),
        None => centre.map(|part| part.unwrap_or(0.0)),
    };
    let middle = [from[0] + way[0], from[1] + way[1]];
    let radius = way[0].hypot(way[1]);
    let end = [to[0] - middle[0], to[1] - middle[1]];
    let begin = (-way[1]).atan2(-way[0]);
    let turn = end[1].atan2(end[0]) - begin;
    let is_round = (to[0] - from[0]).hypot(to[1] - from[1]) < 1e-6;
    let turn = match (clockwise, is_round) {
        (true, true) => -TAU,
        (false, true) => TAU,
        (true, false) => -(-turn).rem_euclid(TAU),
        (false, false) => turn.rem_euclid(TAU),
    };
    // A chord of the angle a is r (1 - cos(a / 2)) from its arc.
    let most = 2.0 * (1.0 - (tolerance / radius.max(tolerance)).min(1.0)).acos();
    let chords = (turn.abs() / most.max(0.01)).ceil().max(1.0) as u32;
    let corner = |chord: u32| {
        let part = f64::from(chord) / f64::from(chords);
        let (sin, cos) = (begin + turn * part).sin_cos();
        [
            middle[0] + radius * cos,
            middle[1] + radius * sin,
            from[2] + part * (to[2] - from[2]),
        ]
    };
    Ok((1..chords).map(corner).chain([to]).collect())
}

/// The way from the start of an arc to its centre, from its radius: negative for the longer arc.
fn centre_of(
    from: [f64; 3],
    to: [f64; 3],
    radius: f64,
    clockwise: bool,
) -> Result<[f64; 2], &'static str> {
    let half = [(to[0] - from[0]) / 2.0, (to[1] - from[1]) / 2.0];
    let length = half[0].hypot(half[1]);
    if length < 1e-6 {
        return Err("an arc by R ends elsewhere than it begins");
    }
    let height = radius * radius - length * length;
    if height < -1e-3 {
        return Err("R is too short for this arc");
    }
    let side = if clockwise == (radius > 0.0) {
        1.0
    } else {
        -1.0
    };
    let height = side * height.max(0.0).sqrt() / length;
    Ok([half[0] + half[1] * height, half[1] - half[0] * height])
}
