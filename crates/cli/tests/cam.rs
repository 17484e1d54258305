//! Unchanged files of CAM programs (`docs/senders.md` lists the programs). Each runs without an
//! error, and its cuts have the size of the drawing that the program was given.
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// The corners of a vector drawing of 60 mm by 42.1 mm: a frame of two curves and two lines, and
/// figures in it. Its lower left corner is at 10, 10.
const DRAWING: [[f64; 2]; 2] = [[10.0, 10.0], [70.0, 52.1]];
/// Lengths of the drawing's parts, mm, as the Python package svgelements measures them.
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

/// Runs a job on a machine of `examples/machines`; returns its report.
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
        // MeerK40t places the drawing on its bed of 1 m by 0.3 m, and ends its lines with a
        // carriage return only.
        let up = if name == "meerk40t.nc" { 175.0 } else { 0.0 };
        assert_cuts(&report, DRAWING.map(|[x, y]| [x, y + up]));
        // svg-to-gcode writes neither circles nor rectangles, and travels with G1. svg2gcode turns
        // the rounded rectangle into one of 6 mm by 10 mm with sharp corners.
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
    // The board is 80 mm by 60 mm, the tool 5 mm wide.
    let report = run(&file("tests/cam", "freecad.nc"), "router.toml");
    assert_cuts(&report, [[-2.5, -2.5], [82.5, 62.5]]);
    // The frame is 60 mm by 40 mm, the tool 3 mm wide.
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
    // The part is 12 mm by 8 mm. The path follows the middle of its walls, which are 0.45 mm wide.
    for (axis, part) in [("x", 12.0), ("y", 8.0)] {
        let found = width(axis);
        assert!((found - (part - 0.45)).abs() < 0.05, "{axis}: {found}");
    }
}
