//! `check --time`, `--as grbl`, folders on all cores, and files of other machines that are taken as
//! they are.

use super::program::{leadscrew, report, stderr, stdout, Folder};
use serde_json::Value;

fn example(name: &str) -> String {
    format!("{}/../../examples/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn json(args: &[&str]) -> Value {
    let output = leadscrew(args);
    let text = stdout(&output);
    serde_json::from_str(&text).unwrap_or_else(|_| panic!("{text}{}", stderr(&output)))
}

#[test]
fn a_check_times_a_job_as_a_run_does_to_the_tick() {
    let folder = Folder::new();
    let stops = "G91\nG1 X5 F900\nG4 P0.1\nM3 S500\nG1 Y5\nM0\nG2 X2 Y2 I2\nG0 Z1\nG4 P0\nM2\n";
    let stops = folder.file("stops.nc", stops.repeat(20));
    let laser = example("settings/laser.txt");
    let router = example("settings/router.txt");
    let jobs = [
        (example("heart.nc"), None),
        (example("raster.nc"), Some(&laser)),
        (example("spiral.nc"), Some(&router)),
        (stops, None),
    ];
    for (job, settings) in &jobs {
        let more = settings.map(|file| vec!["--settings", file]);
        let more = more.unwrap_or_default();
        let timed = json(&[&["check", "--time", "--json", job], &more[..]].concat());
        let run = report(&[&[job.as_str()], &more[..]].concat());
        for field in ["motion_seconds", "job_seconds"] {
            assert_eq!(timed["time"][field], run[field], "{job} {field}");
        }
        assert!(run["motion_seconds"].as_f64().unwrap() > 1.0);
    }
}

#[test]
fn a_job_with_errors_is_not_timed_and_says_so_by_its_errors() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G1 X5 F600\nG77\n");
    let found = json(&["check", "--time", "--json", &job]);
    assert_eq!(found["errors"][0]["line"], 2);
    assert!(found.get("time").is_none(), "{found}");
}

#[test]
fn the_time_of_grbl_stands_beside_ours() {
    let folder = Folder::new();
    // Short moves at speed: 15 of them are too few to brake in.
    let moves: String = (1..400)
        .map(|k| format!("X{:.2}\n", f64::from(k) * 0.05))
        .collect();
    let job = folder.file("job.nc", format!("G1 F6000\n{moves}"));
    let fast = ["--set", "$110=6000", "--set", "$120=200"];
    let both = json(
        &[
            &["check", "--time", "--as", "grbl", "--json", &job],
            &fast[..],
        ]
        .concat(),
    );
    let of = |who: &str| both[who]["job_seconds"].as_f64().unwrap();
    // All moves end at rest within the last 15: v² = 2·200·15·0.05, and 20 mm in all.
    let bound = (2.0f64 * 200.0 * 15.0 * 0.05).sqrt();
    assert!(
        of("grbl") > 20.0 / bound && of("grbl") > 1.1 * of("time"),
        "{both}"
    );
    let run = json(&[&["run", "--as", "grbl", "--json", &job], &fast[..]].concat());
    assert_eq!(run["grbl"], both["grbl"]);
    let told = stdout(&leadscrew(
        &[&["run", "--as", "grbl", &job], &fast[..]].concat(),
    ));
    let line = told.lines().find(|line| line.contains("compared")).unwrap();
    assert!(
        line.contains("your Grbl ") && line.contains(", here "),
        "{told}"
    );
}

#[test]
fn a_folder_is_told_in_the_order_of_its_names_whoever_is_done_first() {
    let folder = Folder::new();
    for number in 0..24 {
        // The first ones take longest.
        let more = "G1 X1 F500\nX0\n".repeat(40 * (24 - number));
        folder.file(&format!("{number:02}.nc"), format!("{more}G77\n"));
    }
    let place = folder.path("").to_string_lossy().into_owned();
    let output = leadscrew(&["check", &place]);
    let numbers = |text: &str, mark: &str| -> Vec<usize> {
        let lines = text.lines().filter(|line| line.contains(mark));
        let number = |line: &str| {
            line.split(".nc:")
                .next()?
                .get(line.find(".nc")? - 2..)?
                .parse()
                .ok()
        };
        lines.filter_map(number).collect()
    };
    let all: Vec<usize> = (0..24).collect();
    assert_eq!(numbers(&stdout(&output), " lines, "), all);
    assert_eq!(numbers(&stderr(&output), ": error:20"), all);
    assert_eq!(output.status.code(), Some(1));
}

/// All words of a command.
fn with<'a>(words: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    [words, more].concat()
}

#[test]
fn files_of_other_machines_are_taken_as_their_import_takes_them() {
    let folder = Folder::new();
    let drill = example("machines/002/machine.toml");
    let none = Vec::new();
    let machine = vec!["--machine", drill.as_str()];
    for (kind, name, options) in [
        ("rows", "003_heart_as_printed.csv", &none),
        ("rp", "001_testbar_50mm_5layers_made_up.rp", &none),
        ("drill", "002_table8_1_dip14_made_up.drl", &machine),
    ] {
        let source = example(&format!("sources/{name}"));
        let job = folder
            .path(&format!("{kind}.nc"))
            .to_string_lossy()
            .into_owned();
        let only: &[&str] = if kind == "drill" { options } else { &[] };
        let made = leadscrew(&with(&["import", kind, &source, "-o", &job], only));
        assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
        for command in ["check", "run", "profile"] {
            let direct = json(&with(&[command, "--json", &source], options));
            let indirect = json(&with(&[command, "--json", &job], options));
            for field in ["lines", "error_count", "extents", "job_seconds"] {
                assert_eq!(
                    direct.get(field),
                    indirect.get(field),
                    "{command} {name} {field}"
                );
            }
            let taken = format!("taken as `leadscrew import {kind}` takes it");
            let notes = direct["notes"].to_string();
            assert!(notes.contains(&taken), "{notes}");
            assert_eq!(indirect["notes"], Value::from(Vec::<Value>::new()));
        }
        let said = stderr(&leadscrew(&with(&["check", &source], options)));
        assert!(said.contains("note: "), "{said}");
    }
}

#[test]
fn a_slicer_s_file_on_a_new_printer_stays_on_its_bed() {
    let folder = Folder::new();
    let [machine, part] = ["printer.toml", "part.gcode"].map(|name| folder.path(name));
    let machine = machine.to_string_lossy().into_owned();
    let made = leadscrew(&["machine", "new", "--like", "printer", "-o", &machine]);
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    let text =
        "; generated by PrusaSlicer 2.6.0\nG21\nG90\nM82\nG28\nM109 S200\nG92 E0\nG1 Z0.2 F600\n\
                G1 X20 Y20 F3000\nG1 X60 E4 F1200\nG1 X200 Y210 E20\n";
    std::fs::write(&part, text).unwrap();
    let part = part.to_string_lossy().into_owned();
    let checked = json(&["check", "--json", "--machine", &machine, &part]);
    assert_eq!(checked["warnings"], Value::from(Vec::<Value>::new()));
    // The zero of the file is at the switches, 2 mm beside the place at which homing ends.
    let notes = checked["notes"].to_string();
    assert!(notes.contains("import print --home 2,2,2"), "{notes}");
    let ran = json(&["run", "--json", "--machine", &machine, &part]);
    let x = &ran["extents"]["x"];
    assert_eq!(
        [x["min"].as_f64(), x["max"].as_f64()],
        [Some(20.0 - 220.0), Some(200.0 - 220.0)],
        "the travel is -220 to 0"
    );
}

#[test]
fn a_profile_has_the_same_limits_whether_its_stretches_are_kept_or_not() {
    let folder = Folder::new();
    let table = folder.path("table.csv").to_string_lossy().into_owned();
    let heart = example("heart.nc");
    let words = ["profile", "--json", "--no-trials", &heart];
    let kept = json(&[&words[..], &["--csv", &table]].concat());
    let summed = json(&words);
    assert_eq!(kept["limits"], summed["limits"]);
    assert_eq!(kept["job_seconds"], summed["job_seconds"]);
    let shares = summed["limits"].as_array().unwrap().iter();
    let sum: f64 = shares.map(|one| one["share"].as_f64().unwrap()).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{sum}");
}
