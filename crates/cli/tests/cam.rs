//! Files of CAM programs as they come (`docs/senders.md` lists the programs): each runs without an
//! error, and what it cuts has the size of the drawing that the program was given.
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// A vector drawing of 60 mm by 42.1 mm: a frame of two curves and two lines, and figures in it.
/// Its lower left corner is at 10, 10.
const DRAWING: [[f64; 2]; 2] = [[10.0, 10.0], [70.0, 52.1]];
/// Lengths of its parts, mm, as the Python package svgelements measures them.
const FRAME: f64 = 206.12;
const CIRCLE: f64 = 50.27;
const ROUNDED: f64 = 36.57;
const TRIANGLE: f64 = 32.36;
const ALL: f64 = FRAME + CIRCLE + ROUNDED + TRIANGLE;

fn leadscrew(arguments: &[&str]) -> Vec<u8> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
    let output = command.args(arguments).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    output.stdout
}

fn file(folder: &str, name: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    root.join(folder).join(name).display().to_string()
}

/// Runs a job on a machine of `examples/machines`; its report.
fn run(job: &str, machine: &str) -> Value {
    let machine = file("../../examples/machines", machine);
    let report = leadscrew(&["run", job, "--machine", &machine, "--json"]);
    serde_json::from_slice(&report).unwrap()
}

#[track_caller]
fn assert_cuts(report: &Value, expected: [[f64; 2]; 2]) {
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        for (end, place) in ["min", "max"].into_iter().zip(expected) {
            let found = report["extents"][name][end].as_f64().unwrap();
            assert!((found - place[axis]).abs() < 0.02, "{name} {end}: {found}");
        }
    }
}

#[track_caller]
fn assert_length(report: &Value, expected: f64) {
    let found = report["cut_mm"].as_f64().unwrap();
    assert!((found / expected - 1.0).abs() < 0.01, "{found} mm are cut");
}

#[test]
fn lasers_cut_the_drawing_and_travel_dark() {
    for name in ["vpype.nc", "svg2gcode.nc", "meerk40t.nc", "svg-to-gcode.nc"] {
        let report = run(&file("tests/cam", name), "laser.toml");
        // MeerK40t puts it on its bed, 1 m by 0.3 m, and ends its lines with a carriage return
        // only.
        let up = if name == "meerk40t.nc" { 175.0 } else { 0.0 };
        assert_cuts(&report, DRAWING.map(|[x, y]| [x, y + up]));
        // svg-to-gcode knows no circle and no rectangle, and travels with G1; svg2gcode makes 6 mm
        // by 10 mm of the rounded rectangle.
        let length = match name {
            "svg-to-gcode.nc" => FRAME + TRIANGLE,
            "svg2gcode.nc" => ALL - ROUNDED + 32.0,
            _ => ALL,
        };
        assert_length(&report, length);
    }
}

#[test]
fn routers_go_round_the_part_by_half_a_tool() {
    // A board of 80 mm by 60 mm, a tool of 5 mm.
    let report = run(&file("tests/cam", "freecad.nc"), "router.toml");
    assert_cuts(&report, [[-2.5, -2.5], [82.5, 62.5]]);
    // A frame of 60 mm by 40 mm, a tool of 3 mm.
    let report = run(&file("tests/cam", "bcnc.nc"), "router.toml");
    assert_cuts(&report, [[-1.5, -1.5], [61.5, 41.5]]);
}

#[test]
fn a_slicer_s_print_is_as_large_as_its_part() {
    let folder = tempfile::tempdir().unwrap();
    let job = folder.path().join("print.nc").display().to_string();
    let sliced = file("tests/cam", "prusaslicer.gcode");
    leadscrew(&["import", "print", &sliced, "--home", "2,2,2", "-o", &job]);
    let report = run(&job, "004/machine.toml");
    let width = |axis: &str| {
        let ends = ["max", "min"].map(|end| report["extents"][axis][end].as_f64().unwrap());
        ends[0] - ends[1]
    };
    // A part of 12 mm by 8 mm, within its walls' middles: they are 0.45 mm wide.
    for (axis, part) in [("x", 12.0), ("y", 8.0)] {
        let found = width(axis);
        assert!((found - (part - 0.45)).abs() < 0.05, "{axis}: {found}");
    }
}
