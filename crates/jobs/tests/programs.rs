//! Programs with parameters, expressions and O words as jobs: what a check and a run say of them.

use leadscrew_jobs::{follow, read_through, time, Machine, Stream};
use leadscrew_sim::link::Rate;
use leadscrew_sim::profile::Profile;
use serde_json::{json, Value};
use std::path::Path;

/// A machine with a probe plate 4 mm below the tool.
const PROBE: &str = "[axes.z]\nrate_mm_min = 2000\n[probe]\nplate_height = -4\n";

fn machine(file: &str) -> Machine {
    Machine::new(Profile::parse(Path::new("test.toml"), file).unwrap(), &[]).unwrap()
}

/// Returns what a check says, as JSON and as text.
fn check(text: &str) -> (Value, String) {
    let mut checker = follow("job.ngc", &machine(""));
    let report = read_through(&mut *checker, "job.ngc", text.as_bytes(), |_| {}).unwrap();
    (
        serde_json::to_value(report.json()).unwrap(),
        report.to_string(),
    )
}

/// Runs a job: the lines of its errors with their texts, its length in mm along the axes' steps,
/// and the machine's place at the end.
fn run(file: &str, text: &str) -> (Vec<(u64, String)>, f64, Vec<i64>) {
    let machine = machine(file);
    let stream = Stream {
        machine: &machine,
        rate: Rate::NeverWaits,
        keep_going: false,
        feed_percent: 100,
        keep_answers: false,
        warn: false,
        only_times: false,
        knows_place: false,
        tell: |_| {},
    };
    let done = stream.run("job.ngc", text.as_bytes(), ()).unwrap();
    let errors = done
        .errors
        .iter()
        .map(|error| (error.line, error.to_string()))
        .collect();
    let place = done
        .outcome
        .motors
        .iter()
        .map(|motor| motor.net_steps)
        .collect();
    (errors, done.outcome.job_seconds, place)
}

const ROW: &str =
    "G21 G90\nF600\n#<pitch> = [20/4]\no1 while [#1 LT 4]\n  G1 X[#1*#<pitch>] (hole)\n  \
                   #1 = [#1+1]\no1 endwhile\nM2\n";
const PLAIN: &str = "G21 G90\nF600\nG1 X0\nG1 X5\nG1 X10\nG1 X15\nM2\n";

#[test]
fn a_program_is_checked_as_its_plain_lines_are() {
    let ((program, _), (plain, _)) = (check(ROW), check(PLAIN));
    assert_eq!(program["error_count"], 0, "{program}");
    for key in ["extents", "cut_mm", "travel_mm"] {
        assert_eq!(program[key], plain[key]);
    }
    assert_eq!(program["lines"], 8);
    assert_eq!(plain.get("branches"), None);
}

#[test]
fn a_program_runs_as_long_as_its_plain_lines_do() {
    let (program, plain) = (run("", ROW), run("", PLAIN));
    // Only the blanks and comments of the plain lines take bytes of their own.
    assert_eq!((&program.0, &program.2), (&plain.0, &plain.2));
    assert!((program.1 - plain.1).abs() < 1e-3, "{program:?} {plain:?}");
    assert!(program.0.is_empty() && program.1 > 1.5, "{program:?}");
    let machine = machine("");
    let timed = time(&machine, Rate::NeverWaits, "job.ngc", ROW.as_bytes()).unwrap();
    assert!((timed.job_seconds - program.1).abs() < 1e-6);
}

#[test]
fn a_check_says_which_branches_it_took() {
    let text = "#1=1\no1 repeat [3]\no2 if [#1 EQ 2]\nG4 P0\no2 else\n#5=1\no2 endif\n#1=[#1+1]\n\
                o1 endrepeat\no3 if [0]\no3 endif\n";
    let (json, shown) = check(text);
    let branches = json!([
        {"line": 3, "taken": 1, "passed": 2},
        {"line": 10, "taken": 0, "passed": 1},
    ]);
    assert_eq!(json["branches"], branches);
    assert!(
        shown.contains("\n  condition    line 3: true 1 times, false 2 times\n"),
        "{shown}"
    );
    assert!(
        shown.ends_with("\n  condition    line 10: false, 1 times"),
        "{shown}"
    );
}

#[test]
fn errors_name_the_line_of_the_file_within_loops_too() {
    let text = "G21\n\no1 repeat [2]\nG1 X1 F100\nG1 X[1/#3] F100\no1 endrepeat\n";
    let (json, _) = check(text);
    let error = &json["errors"][0];
    assert_eq!((&error["line"], &error["column"]), (&json!(5), &json!(7)));
    assert_eq!(
        error["message"],
        "the program cannot go on: a division by 0"
    );
    assert_eq!(error["text"], "G1 X[1/#3] F100");
    let (errors, ..) = run("", text);
    assert_eq!(errors.len(), 1);
    assert_eq!(errors[0].0, 5);
    // What the machine refuses has the line of the file, and the text that it got.
    let refused = "G21\no1 repeat [2]\nG1 X[2/4]\no1 endrepeat\n";
    let (errors, ..) = run("", refused);
    assert_eq!(errors[0].0, 3);
    assert!(
        errors[0].1.contains("error:22") && errors[0].1.contains("G1 X0.5"),
        "{errors:?}"
    );
}

#[test]
fn a_program_without_an_end_is_told() {
    let (json, _) = check("o1 while [1]\no1 endwhile\n");
    let message = json["errors"][0]["message"].as_str().unwrap();
    assert!(message.contains("no end"), "{message}");
}

#[test]
fn a_program_knows_where_the_machine_is_and_in_which_unit() {
    let text =
        "G20 G90\nG10 L20 P1 X1\nG1 X2 F10\no1 if [#<_x> EQ 2 AND #5420 EQ 2 AND #<_feed> EQ 10]\n\
                G91\nG1 X[#<_abs_x>]\no1 else\nG1 X[1/0]\no1 endif\n";
    let (json, shown) = check(text);
    assert_eq!(json["error_count"], 0, "{shown}");
    let cut = json["cut_mm"].as_f64().unwrap();
    assert!(
        (cut - 50.8).abs() < 1e-9,
        "an inch, and an inch from there: {cut}"
    );
}

#[test]
fn a_run_knows_where_the_probe_has_touched_and_goes_on_from_there() {
    let text = "G21 G90\nG38.2 Z-20 F60\no1 if [#5070 AND #5063 GT -4.1 AND #5063 LT -3.9]\n\
                G0 Z[#<_z>+1]\no1 else\nG1 X[1/0]\no1 endif\nG0 X[-#5063]\n";
    let (errors, _, place) = run(PROBE, text);
    assert!(errors.is_empty(), "{errors:?}");
    // 250 steps/mm: Z stands 1 mm above the plate, X as far out as the plate was deep.
    assert!(
        (place[2] - -750).abs() <= 2 && (place[0] - 1000).abs() <= 2,
        "{place:?}"
    );
}

/// The places at which a program goes below the surface, with the depth, in order.
fn holes(text: &str) -> Vec<[f32; 3]> {
    let mut checker = follow("job.ngc", &machine(""));
    checker.draw();
    let report = read_through(&mut *checker, "job.ngc", text.as_bytes(), |_| {}).unwrap();
    assert_eq!(report.error_count, 0);
    let mut holes: Vec<[f32; 3]> = Vec::new();
    for one in checker.path().moves() {
        let [x, y, z] = one.to;
        match holes.last_mut().filter(|last| last[0] == x && last[1] == y) {
            Some(last) => last[2] = last[2].min(z),
            None => holes.push([x, y, z]),
        }
    }
    holes.retain(|hole| hole[2] < 0.0);
    holes
}

#[test]
fn the_example_of_a_bolt_circle_drills_six_holes_on_it() {
    let text = include_str!("../../../examples/programs/bolt_circle.ngc");
    let found = holes(text);
    assert_eq!(found.len(), 6);
    for (index, [x, y, z]) in found.iter().enumerate() {
        let angle = (15.0 + 60.0 * index as f32).to_radians();
        let (right, up) = (20.0 * angle.cos(), 20.0 * angle.sin());
        assert!(
            (x - right).hypot(y - up) < 1e-5 && *z == -3.0,
            "{index}: {x} {y} {z}"
        );
    }
    assert!(run("", text).0.is_empty());
}

#[test]
fn the_example_of_a_grid_drills_three_rows_of_four_holes() {
    let text = include_str!("../../../examples/programs/hole_grid.ngc");
    let expected: Vec<[f32; 3]> = (0..12_u8)
        .map(|hole| {
            let (column, row) = (f32::from(hole % 4), f32::from(hole / 4));
            [
                12.5 * column,
                10.0 * row,
                if row == 2.0 { -6.0 } else { -2.5 },
            ]
        })
        .collect();
    assert_eq!(holes(text), expected);
    let (errors, _, place) = run("", text);
    assert!(errors.is_empty(), "{errors:?}");
    assert_eq!(
        place[0], 9375,
        "X37.5 at 250 steps/mm: the value that the row returned"
    );
}
