//! A bent job is as deep below the surface as the job was below the plane, and keeps its path.

use leadscrew_import::level::{job, Map};
use std::f64::consts::TAU;

const TOLERANCE: f64 = 0.005;

/// A map with a place every 10 mm from 0 to 60, of a surface.
fn map(surface: impl Fn(f64, f64) -> f64) -> Map {
    let mut text = String::from("x,y,z\n");
    for x in (0..=60).step_by(10).map(f64::from) {
        for y in (0..=60).step_by(10).map(f64::from) {
            text += &format!("{x},{y},{:.6}\n", surface(x, y));
        }
    }
    Map::read(&text, [0.0; 3]).unwrap()
}

/// The places of a bent job, read by their letters alone.
fn places(lines: &[String]) -> Vec<[f64; 3]> {
    let mut at = [0.0; 3];
    let mut all = Vec::new();
    for line in lines.iter().filter(|line| line.contains(['X', 'Y', 'Z'])) {
        for word in line.split(' ') {
            let axis = "XYZ".find(word.chars().next().unwrap_or(' '));
            if let Some(axis) = axis {
                at[axis] = word[1..].parse().unwrap();
            }
        }
        all.push(at);
    }
    all
}

/// Each piece, in steps of a hundredth.
fn along(places: &[[f64; 3]]) -> impl Iterator<Item = [f64; 3]> + '_ {
    places.windows(2).flat_map(|pair| {
        (0..=100).map(|part| {
            let part = f64::from(part) / 100.0;
            [0, 1, 2].map(|axis| pair[0][axis] + part * (pair[1][axis] - pair[0][axis]))
        })
    })
}

/// A tilted plate that is twisted as well: its map is exact.
fn twisted(x: f64, y: f64) -> f64 {
    0.02 * x - 0.01 * y + 0.0007 * x * y
}

#[test]
fn a_line_stays_at_its_depth_below_a_twisted_plate() {
    let text = "G0 X5 Y5 Z0\nG1 Z-0.2 F100\nX55 Y50\nX10 Y48\nG91\nX3 Y-20\nG90 G20\nX2 Y0.5\n";
    let bent = job(text, &map(twisted), TOLERANCE).unwrap();
    let places = places(&bent.lines);
    for [x, y, z] in along(&places[1..]) {
        let depth = z - twisted(x, y);
        assert!((depth + 0.2).abs() <= TOLERANCE + 1e-4, "{x} {y} {depth}");
    }
    let last = places.last().unwrap();
    assert!(
        (last[0] - 50.8).abs() < 1e-4 && (last[1] - 12.7).abs() < 1e-4,
        "{last:?}"
    );
}

#[test]
fn the_depth_over_a_bowed_plate_is_off_by_what_the_map_does_not_know() {
    let bowed = |x: f64, y: f64| 0.0004 * ((x - 30.0).powi(2) + (y - 20.0).powi(2));
    // The second derivative of the surface is 0.0008 /mm in each direction; a parabola is
    // d^2 / 8 times that from its chord, in each of two directions.
    let unknown = 2.0 * 0.0008 * 10.0f64.powi(2) / 8.0;
    let bent = job(
        "G0 X1 Y1 Z0\nG1 Z-1 F100\nX59 Y43\nX7 Y58\n",
        &map(bowed),
        TOLERANCE,
    )
    .unwrap();
    let places = places(&bent.lines);
    let worst = along(&places[1..]).map(|[x, y, z]| (z - bowed(x, y) + 1.0).abs());
    let worst = worst.fold(0.0, f64::max);
    assert!(worst <= unknown + TOLERANCE + 1e-4, "{worst} {unknown}");
}

#[test]
fn arcs_stay_on_their_circle_and_at_their_depth() {
    // By centre and by radius, short and long, both ways, and a whole circle that goes down.
    let arcs = [
        ("G0 X40 Y30 Z-1\nG3 X30 Y40 I-10 J0 F100\n", TAU / 4.0),
        ("G0 X40 Y30 Z-1\nG2 X30 Y40 I-10 J0 F100\n", 3.0 * TAU / 4.0),
        ("G0 X40 Y30 Z-1\nG3 X30 Y40 R10 F100\n", TAU / 4.0),
        ("G0 X40 Y30 Z-1\nG2 X30 Y40 R-10 F100\n", 3.0 * TAU / 4.0),
        ("G0 X40 Y30 Z-1\nG2 X40 Y30 I-10 F100\n", TAU),
    ];
    for (text, angle) in arcs {
        let bent = job(text, &map(twisted), TOLERANCE).unwrap();
        let places = places(&bent.lines);
        let mut length = 0.0;
        for pair in places.windows(2) {
            length += (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
        }
        assert!(
            (length - 10.0 * angle).abs() < 0.02 * angle,
            "{text} {length}"
        );
        for [x, y, z] in along(&places) {
            let radius = (x - 30.0).hypot(y - 30.0);
            assert!((radius - 10.0).abs() <= TOLERANCE + 2e-4, "{text} {radius}");
            let depth = z - twisted(x, y);
            assert!((depth + 1.0).abs() <= TOLERANCE + 2e-4, "{text} {depth}");
        }
    }
}

#[test]
fn other_words_and_comments_stay_and_modes_are_absolute_mm() {
    let text = "(board)\nG20 G90 G54\nM3 S900\nG0 X0.5 Y0.5 Z0.1 ; over\nG1 Z0 F10 M8\nG91 G28 Z0\nM5\nM30\n";
    let bent = job(text, &map(|_, _| 0.0), TOLERANCE).unwrap();
    let expected = "G21 G90 G94 G17\n(board)\nG54\nM3 S900\nG0 X12.7 Y12.7 Z2.54 ; over\n\
                    M8 F254 G1 X12.7 Y12.7 Z0\nG91 G28 Z0\nG90\nM5\nM30";
    assert_eq!(bent.lines.join("\n"), expected);
}

#[test]
fn a_line_that_cannot_be_bent_is_named_with_its_reason() {
    let refused = |text: &str| {
        let faults = job(text, &map(twisted), TOLERANCE).unwrap_err();
        faults.0[0].to_string()
    };
    let begin = "G0 X1 Y1 Z0\n";
    for (line, expected) in [
        (
            "G1 X70 F100",
            "2:4: X70.000 Y1.000 lies outside the map, X0 to X60, Y0 to Y60: probe a larger grid",
        ),
        ("G18", "2:1: G18 chooses a plane whose arcs are not bent"),
        (
            "G81 X5 Y5 Z-1 R1 F100",
            "2:1: G81 is a canned cycle: write its strokes as G0 and G1",
        ),
        (
            "G92 X0",
            "2:1: G92 sets a zero within the job: heights would count from another one",
        ),
        (
            "G52 X5",
            "2:1: G52 sets a zero within the job: heights would count from another one",
        ),
        (
            "G92.3",
            "2:1: G92.3 sets a zero within the job: heights would count from another one",
        ),
        (
            "G38.2 Z-5 F50",
            "2:1: G38.2 probes: what it finds is not bent",
        ),
        (
            "G93 G1 X5 F2",
            "2:1: G93 gives each line a time, which a bent line does not keep",
        ),
        ("$J=X5 F100", "2:1: a jog within a job is not bent"),
        ("G2 X5 Y5 F100", "2:1: an arc needs I and J, or R"),
        ("G2 X5 Y5 R1 F100", "2:1: R is too short for this arc"),
    ] {
        let found = refused(&format!("{begin}{line}\n"));
        let (_, message) = found.split_once(": ").unwrap();
        let (_, wanted) = expected.split_once(": ").unwrap();
        assert_eq!(message, wanted, "{line}");
        assert!(found.starts_with("2:"), "{found}");
    }
    assert_eq!(
        refused("G1 X5 Y5 F100\n"),
        "1:1: where the tool is, the job has not said yet: give X, Y and Z first"
    );
    assert_eq!(
        refused("G91\nG0 X5\n"),
        "2:1: where X is, the job has not said yet: move it in G90 first"
    );
}

#[test]
fn a_map_is_read_from_probe_reports_too_and_its_gaps_are_named() {
    let text = "[PRB:-90.000,-50.000,-20.100:1]\n[PRB:-80.005,-50.000,-20.200:1]\n\
                [PRB:-90.000,-40.000,-20.300:1]\n[PRB:-80.000,-39.995,-20.400:1]\n";
    let map = Map::read(text, [-90.0, -50.0, -20.0]).unwrap();
    for (at, height) in [
        ([0.0, 0.0], -0.1),
        ([10.0, 10.0], -0.4),
        ([5.0, 5.0], -0.25),
    ] {
        assert!(
            (map.height(at) - height).abs() < 1e-3,
            "{at:?} {}",
            map.height(at)
        );
    }
    let refused = |text: &str| Map::read(text, [0.0; 3]).unwrap_err().0[0].to_string();
    assert_eq!(
        refused("0,0,1\n10,0,1\n0,10,1\n"),
        "1:1: the grid has no height at X10.000 Y10.000"
    );
    assert_eq!(
        refused("0,0,1\n1,0,1\n"),
        "1:1: expected a grid of at least two columns and two rows"
    );
    assert_eq!(
        refused("0,0,1\n1,zero,1\n"),
        "2:1: expected X,Y,Z in mm, or [PRB:X,Y,Z:1]"
    );
    assert_eq!(
        refused("0,0,1\n[PRB:1,2,3:0]\n"),
        "2:1: this probe touched nothing: probe the place again"
    );
    assert_eq!(
        refused(""),
        "1:1: no place stands in it: expected X,Y,Z in mm in each line"
    );
}
