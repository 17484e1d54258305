//! `leadscrew import`, `align` and `calibrate`: the promises of `docs/import.md`.

use crate::program::{leadscrew, stderr, stdout, unusable, Folder};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A folder with the files that the commands of `docs/import.md` name.
fn folder() -> Folder {
    let folder = Folder::new();
    let copy = |from: &str, to: &str| fs::copy(root().join(from), folder.path(to)).unwrap();
    copy("crates/import/tests/drl/kicad_mm_lz.drl", "board.drl");
    copy(
        "crates/import/tests/drl/kicad_decimal_mm.drl",
        "holes-npth.drl",
    );
    copy("crates/import/tests/drl/flatcam.drl", "slots.drl");
    copy("crates/import/tests/drl/headerless_rack.drl", "rack.drl");
    copy(
        "examples/sources/001_testbar_50mm_5layers_made_up.rp",
        "part.rp",
    );
    copy("examples/sources/003_heart_as_printed.csv", "heart.csv");
    copy("examples/settings/drill002.txt", "drill002.txt");
    copy("examples/pocket.nc", "pocket.nc");
    let grid = [(-10, -200), (300, -200), (-10, 200), (300, 200)];
    let rows = grid.map(|(x, y)| format!("{x},{y},0.1\n")).concat();
    folder.file("heights.csv", rows);
    let reports = grid.map(|(x, y)| format!("[PRB:{}.000,{}.000,-12.400:1]\n", x - 200, y - 150));
    folder.file("probed.txt", reports.concat());
    copy("examples/settings/router.txt", "router.txt");
    folder.file(
        "part.gcode",
        "G28\nM104 S210\nG1 X10 E1.5 F1800 ; first\nM204 P500\nG4 P500\n",
    );
    folder
}

/// Runs the program in a folder.
fn call(folder: &Folder, args: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_leadscrew");
    Command::new(program)
        .args(args)
        .current_dir(folder.path("."))
        .output()
        .unwrap()
}

/// Splits a command as a shell does, as far as these commands need it: at blanks, with single
/// quotes.
fn words(command: &str) -> Vec<String> {
    let parts = command.split('\'').enumerate();
    let words = parts.flat_map(|(index, part)| match index % 2 {
        0 => part.split_whitespace().map(str::to_owned).collect(),
        _ => vec![part.to_owned()],
    });
    words.collect()
}

#[test]
fn every_command_of_the_page_runs() {
    let page = fs::read_to_string(root().join("docs/import.md")).unwrap();
    let folder = folder();
    let blocks = page
        .split("```sh\n")
        .skip(1)
        .map(|rest| rest.split("```").next().unwrap());
    let commands: Vec<&str> = blocks.flat_map(str::lines).collect();
    assert!(commands.len() >= 15, "{commands:?}");
    for command in commands {
        let words = words(command);
        assert_eq!(words[0], "leadscrew", "{command}");
        let args: Vec<&str> = words[1..].iter().map(String::as_str).collect();
        let output = call(&folder, &args);
        assert!(output.status.success(), "{command}: {}", stderr(&output));
        if let Some(place) = args.iter().position(|arg| *arg == "-o") {
            let written = folder.path(args[place + 1]);
            assert!(fs::metadata(&written).unwrap().len() > 20, "{command}");
        }
    }
    assert!(folder.path("board-T1.nc").exists());
}

#[test]
fn what_is_not_understood_is_shown_with_file_line_and_caret_and_nothing_is_written() {
    let folder = folder();
    folder.file(
        "bad.drl",
        "M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y1.0\nX2.0Q1\nG82\nM30\n",
    );
    let args = [
        "import",
        "drill",
        "board.drl",
        "bad.drl",
        "--depth",
        "-1",
        "--feed",
        "9",
        "-o",
        "x.nc",
    ];
    let output = call(&folder, &args);
    assert_eq!(output.status.code(), Some(1));
    let said = stderr(&output);
    assert!(said.contains("bad.drl:7:5: Q1: not understood"), "{said}");
    assert!(said.contains("     7 | X2.0Q1\n       |     ^"), "{said}");
    assert!(said.contains("bad.drl:8:1: G82: not understood"), "{said}");
    assert!(!folder.path("x.nc").exists());
}

#[test]
fn files_of_other_systems_are_read_as_those_of_this_one() {
    let folder = folder();
    let commands: [(&str, &[&str]); 5] = [
        (
            "board.drl",
            &["import", "drill", "--depth", "-1", "--feed", "9"],
        ),
        ("part.rp", &["import", "rp"]),
        ("heart.csv", &["import", "rows"]),
        ("part.gcode", &["import", "print"]),
        (
            "job.nc",
            &[
                "align",
                "--ref",
                "0,0",
                "--ref",
                "9,0",
                "--measured",
                "1,1",
                "--measured",
                "10,1",
            ],
        ),
    ];
    folder.file("job.nc", "G21\nG90\nG0 X1 Y1\n");
    for (name, args) in commands {
        let made = |name: &str| {
            let output = call(&folder, &[args, &[name]].concat());
            assert!(output.status.success(), "{name}: {}", stderr(&output));
            // Comments name the file.
            let text = stdout(&output);
            let lines = text.lines().filter(|line| !line.starts_with('('));
            lines.map(str::to_owned).collect::<Vec<_>>()
        };
        let text = fs::read_to_string(folder.path(name)).unwrap();
        let unix = text.replace("\r\n", "\n");
        folder.file("unix", &unix);
        folder.file("marked", format!("\u{FEFF}{unix}"));
        folder.file("dos", unix.replace('\n', "\r\n"));
        folder.file("mac", unix.replace('\n', "\r"));
        for other in ["marked", "dos", "mac"] {
            assert_eq!(made(other), made("unix"), "{name} as {other}");
        }
    }
}

/// The ends of half a circle have three decimals, and so has its radius: it is 0.0002 mm too short.
#[test]
fn half_a_circle_by_its_rounded_radius_is_milled() {
    let folder = folder();
    folder.file(
        "half.drl",
        "M48\nMETRIC\nT1C1.0\n%\nT1\nG00X0.0Y0.0\nM15\nG02X2.0Y2.0A1.414\nM16\nM30\n",
    );
    let drill = [
        "import", "drill", "half.drl", "--depth", "-1", "--feed", "9",
    ];
    let output = call(&folder, &[&drill[..], &["-o", "half.nc"]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let check = call(&folder, &["check", "half.nc"]);
    assert!(check.status.success(), "{}", stderr(&check));
    let job = fs::read_to_string(folder.path("half.nc")).unwrap();
    assert!(job.contains("G2 X2 Y2 I1 J1 F9"), "{job}");
}

#[test]
fn an_input_is_never_written_over() {
    let folder = folder();
    let before = fs::read(folder.path("board.drl")).unwrap();
    let args = [
        "import",
        "drill",
        "board.drl",
        "--depth",
        "-1",
        "--feed",
        "9",
        "-o",
        "./board.drl",
    ];
    let output = call(&folder, &args);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("the job needs another name"));
    assert_eq!(fs::read(folder.path("board.drl")).unwrap(), before);
}

/// Such a job would be refused by the machine, or drag the tool over the work.
#[test]
fn feeds_and_lifts_are_above_zero() {
    let folder = folder();
    for (kind, file, option) in [
        ("rp", "part.rp", "--feed"),
        ("rp", "part.rp", "--lift"),
        ("rows", "heart.csv", "--scale"),
        ("rows", "heart.csv", "--feed"),
        ("rows", "heart.csv", "--plunge"),
        ("rows", "heart.csv", "--lift"),
    ] {
        for value in ["=0", "=-2"] {
            let option = format!("{option}{value}");
            let output = call(&folder, &["import", kind, file, &option]);
            assert_eq!(output.status.code(), Some(2), "{kind} {option}");
            let said = stderr(&output);
            assert!(said.contains("expected a number above 0"), "{said}");
            assert!(stdout(&output).is_empty(), "{kind} {option}");
        }
    }
}

#[test]
fn options_that_make_no_sense_are_refused_with_one_message() {
    let folder = folder();
    let board = folder.path("board.drl");
    let board = board.to_str().unwrap();
    let drill = |more: &[&'static str]| [&["import", "drill", board, "--feed", "9"], more].concat();
    unusable(&drill(&["--depth", "1.8"]), &["is it -1.8?"]);
    unusable(&drill(&["--depth", "0"]), &["--depth 0 is not below Z0\n"]);
    unusable(
        &drill(&["--depth", "-1", "--peck", "0"]),
        &["--peck must be more than 0"],
    );
    unusable(
        &drill(&["--depth", "-1", "--tools", "files"]),
        &["needs -o"],
    );
    let align = [
        "align",
        board,
        "--ref",
        "0,0",
        "--ref",
        "-1,0",
        "--measured",
        "0,0",
    ];
    unusable(&align, &["2 --ref and 1 --measured"]);
    let align = ["align", board, "--ref", "1,1", "--measured", "0,0"];
    unusable(&align, &["two points"]);
    unusable(
        &["calibrate", "x", "--commanded", "0", "--measured", "1"],
        &["--commanded"],
    );
}

/// The own program of machine 002 makes a hole in 3.77 s at the highest speed. The time of a whole
/// job also contains the way to the board, the spindle's start and the way back, which do not count
/// for a hole.
#[test]
fn a_hole_of_the_supplied_board_takes_four_seconds_at_most_at_the_machines_speeds() {
    let folder = folder();
    let source = root().join("examples/sources/002_screenshot_holes_40_67.drl");
    let drill = [
        "import",
        "drill",
        source.to_str().unwrap(),
        "--settings",
        "drill002.txt",
    ];
    let heights = [
        "--clearance",
        "-17.5",
        "--depth",
        "-21.875",
        "--feed",
        "328",
    ];
    let output = call(&folder, &[&drill[..], &heights].concat());
    let job = stdout(&output);
    let holes: Vec<&str> = job.lines().filter(|line| line.starts_with('N')).collect();
    assert_eq!(holes.len(), 28 * 3);
    folder.file(
        "job.nc",
        "G21 G90 G94 G17\nG92 Z-17.5\n".to_owned() + &holes.join("\n"),
    );
    let run = call(
        &folder,
        &["run", "job.nc", "--settings", "drill002.txt", "--json"],
    );
    assert!(run.status.success(), "{}", stderr(&run));
    let report: serde_json::Value = serde_json::from_str(&stdout(&run)).unwrap();
    let seconds = report["job_seconds"].as_f64().unwrap() / 28.0;
    assert!((1.0..=4.0).contains(&seconds), "{seconds} s a hole");
}

#[test]
fn calibration_prints_a_line_for_the_machine() {
    let args = [
        "calibrate",
        "x",
        "--commanded",
        "100",
        "--measured",
        "99.2",
        "--set",
        "$100=80",
    ];
    let output = leadscrew(&args);
    assert_eq!(stdout(&output), "$100=80.645\n");
}

#[test]
fn every_axis_of_the_machine_is_calibrated_and_no_other() {
    let folder = Folder::new();
    let machine = folder.file("m.toml", "[axes.e]\nsteps_per_mm = 100\n");
    let by = |axis, more: &[&str]| {
        let args = ["calibrate", axis, "--commanded", "100", "--measured", "80"];
        leadscrew(&[&args, more].concat())
    };
    for axis in ["e", "E"] {
        let output = by(axis, &["--machine", &machine]);
        assert_eq!(stdout(&output), "$103=125\n", "{}", stderr(&output));
    }
    for (output, part) in [
        (by("e", &[]), "the machine has no axis E, but X, Y, Z"),
        (by("x", &["--set", "$100=370000"]), "$100=462500: error:12"),
        (by("xy", &[]), "'xy'"),
    ] {
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains(part), "{}", stderr(&output));
    }
}

#[test]
fn a_turned_job_is_checked_as_any_other() {
    let folder = folder();
    let board = [
        "import",
        "drill",
        "board.drl",
        "--depth",
        "-1",
        "--feed",
        "9",
        "-o",
        "job.nc",
    ];
    assert!(call(&folder, &board).status.success());
    let align = [
        "align",
        "job.nc",
        "--ref",
        "0,0",
        "--ref",
        "100,0",
        "--measured",
        "5,5",
        "--measured",
        "5,105.1",
        "-o",
        "turned.nc",
    ];
    let output = call(&folder, &align);
    let said = stderr(&output);
    assert!(
        said.contains("turned 90.0000 degrees, X0 Y0 to X5.0000 Y5.0500"),
        "{said}"
    );
    assert!(said.contains("scale 1.001000, not applied"), "{said}");
    assert!(call(&folder, &["check", "turned.nc"]).status.success());
    let turned = fs::read_to_string(folder.path("turned.nc")).unwrap();
    assert!(turned.contains("G0 X-0.08 Y17.75"), "{turned}");
}

/// `docs/machines.md` names tests as `` `file`: `test`, `test` ``.
#[test]
fn a_job_is_bent_by_a_map_and_checked_as_any_other_or_its_lines_are_told() {
    let folder = Folder::new();
    let rows = [0, 10, 20].map(|y| format!("0,{y},0\n10,{y},0.4\n20,{y},0\n"));
    folder.file("map.csv", rows.concat());
    folder.file(
        "job.nc",
        "G20 G91\nG90 G0 X0 Y0 Z0.1\nG1 Z0 F10\nG91 X0.5 Y0.5\n",
    );
    let level = |job: &str, map: &str| {
        let done = call(&folder, &["level", job, "--map", map, "-o", "bent.nc"]);
        (stderr(&done), done.status.code())
    };
    let (told, code) = level("job.nc", "map.csv");
    assert_eq!(code, Some(0), "{told}");
    assert!(told.contains("map from X0.000 Y0.000 to X20.000 Y20.000"));
    assert!(
        told.contains("the surface is within 0.125 mm of it"),
        "{told}"
    );
    let checked = call(&folder, &["check", "bent.nc"]);
    assert!(checked.status.success(), "{}", stdout(&checked));
    fs::remove_file(folder.path("bent.nc")).unwrap();
    folder.file("far.nc", "G0 X0 Y0 Z1\nG1 X30 F100\nG18\n");
    folder.file("empty.csv", "x,y,z\n");
    folder.file("line.csv", "0,0,0\n5,0,0\n");
    folder.file("gap.csv", "0,0,0\n5,0,0\n0,5,0\n");
    for (job, map, expected) in [
        (
            "far.nc",
            "map.csv",
            "far.nc:2:1: X30.000 Y0.000 lies outside the map",
        ),
        ("far.nc", "map.csv", "far.nc:3:1: G18 chooses a plane"),
        (
            "job.nc",
            "empty.csv",
            "empty.csv:1:1: no place stands in it",
        ),
        ("job.nc", "line.csv", "line.csv:1:1: expected a grid"),
        (
            "job.nc",
            "gap.csv",
            "gap.csv:1:1: the grid has no height at X5.000 Y5.000",
        ),
    ] {
        let (told, code) = level(job, map);
        assert_eq!(code, Some(1), "{told}");
        assert!(told.contains(expected), "{expected}: {told}");
        assert!(!folder.path("bent.nc").exists(), "nothing is written");
    }
}

#[test]
fn every_test_that_the_table_of_machines_names_is_there() {
    let page = fs::read_to_string(root().join("docs/machines.md")).unwrap();
    let quoted = page
        .split('`')
        .enumerate()
        .filter(|(index, _)| index % 2 == 1);
    let (mut source, mut named) = (String::new(), 0);
    for (_, name) in quoted {
        if name.ends_with(".rs") {
            source = fs::read_to_string(root().join(name)).expect(name);
        } else if name.matches('_').count() >= 3 {
            assert!(source.contains(&format!("fn {name}(")), "{name}");
            named += 1;
        }
    }
    assert!(named >= 25, "{named}");
}

#[test]
fn a_drill_job_takes_from_the_machine_file_what_its_options_do_not_say() {
    let folder = folder();
    let drill = |more: &[&str]| {
        let args = [&["import", "drill", "board.drl", "-q"], more].concat();
        let output = call(&folder, &args);
        (stdout(&output), stderr(&output), output.status.code())
    };
    let said = [
        "--depth",
        "-1.7",
        "--clearance",
        "1.25",
        "--feed",
        "90",
        "--peck",
        "0.5",
    ];
    let (by_options, _, code) = drill(&said);
    assert_eq!(code, Some(0));
    assert!(
        by_options.contains("down to Z-1.7, clearance Z1.25"),
        "{by_options}"
    );
    assert!(by_options.contains("F90"), "{by_options}");
    folder.file(
        "drill.toml",
        "[drill]\ndepth_mm = -1.7\nclearance_mm = 1.25\nfeed_mm_min = 90\npeck_mm = 0.5\n",
    );
    assert_eq!(drill(&["--machine", "drill.toml"]).0, by_options);
    let (deeper, _, _) = drill(&["--machine", "drill.toml", "--depth", "-2.1"]);
    assert!(
        deeper.contains("down to Z-2.1, clearance Z1.25"),
        "{deeper}"
    );
    let (_, error, code) = drill(&["--depth", "-1.7"]);
    assert_eq!(code, Some(2));
    assert!(
        error.contains("expected --feed, or `feed_mm_min` in [drill]"),
        "{error}"
    );
}

#[test]
fn a_job_is_begun_in_its_middle_or_the_line_to_begin_with_is_named() {
    let folder = Folder::new();
    folder.file("job.nc", "G0 X0 Y0\nG2 X4 I2 F300\nX8 I2\nG1 X9\n");
    let resume = |args: &[&str]| {
        let done = call(&folder, &[&["resume", "job.nc"], args].concat());
        (stdout(&done), stderr(&done), done.status.code())
    };
    let (rest, told, code) = resume(&["--line", "4"]);
    assert!(rest.ends_with("G17 G90 G80 F300 S0\nG1 X9\n"), "{rest}");
    assert!(told.contains("\n  G0 X8 Y0\n"), "{told}");
    assert_eq!(code, Some(0));
    let (rest, told, code) = resume(&["--line", "3"]);
    let expected = "job.nc:3: the line goes on with the motion of line 2: begin at line 2\n";
    assert_eq!(
        (rest.as_str(), told.as_str(), code),
        ("", expected, Some(1))
    );
    for wrong in [
        &["--line", "0"][..],
        &["--line", "4", "--spin-up", "-1"],
        &["--line", "4", "-o", "job.nc"],
    ] {
        assert_eq!(resume(wrong).2, Some(2), "{wrong:?}");
    }
}
