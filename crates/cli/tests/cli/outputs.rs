//! The program's output and files after a job that has run to its end.

use crate::program::{leadscrew, report, stderr, stdout, Folder, SQUARE};
use std::fs;
use std::path::Path;
use std::process::Command;

#[test]
fn the_summary_says_what_the_machine_did() {
    let folder = Folder::new();
    let output = leadscrew(&["run", &folder.file("job.nc", SQUARE)]);
    assert_eq!(output.status.code(), Some(0));
    let text = stdout(&output);
    for part in [
        "6 lines, done",
        "job time",
        "16.0 mm cut",
        "X axis",
        "2000 steps",
        "CPU load",
        "never waits",
        "late events  0",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
    assert_eq!(stderr(&output), "", "no progress bar where nobody watches");
}

/// All names of fields in `value`, except for the names of axes.
fn fields(value: &serde_json::Value, all: &mut Vec<String>) {
    match value {
        serde_json::Value::Object(object) => {
            for (name, value) in object {
                all.extend((name.len() > 1).then(|| name.clone()));
                fields(value, all);
            }
        }
        serde_json::Value::Array(values) => values.iter().for_each(|value| fields(value, all)),
        _ => {}
    }
}

#[test]
fn docs_json_md_tells_of_every_field() {
    let docs = include_str!("../../../../docs/json.md");
    let folder = Folder::new();
    let file = folder.file("job.nc", format!("{SQUARE}G64\n"));
    for command in ["run", "check", "profile"] {
        let mut sections = docs.split("\n## ");
        let section = sections.find(|text| text.starts_with(&format!("`leadscrew {command}")));
        let section = section.unwrap();
        let output = leadscrew(&[command, "--json", &file]);
        let json = serde_json::from_str(&stdout(&output)).unwrap();
        let mut names = Vec::new();
        fields(&json, &mut names);
        assert!(names.len() >= 7, "{command}: {names:?}");
        let above = [
            "line", "column", "code", "message", "remedy", "text", "at", "by", "words", "why",
        ];
        for name in names.iter().filter(|name| !above.contains(&&***name)) {
            let told = section.contains(&format!("`{name}`"));
            assert!(told, "{command}: {name}");
        }
        for name in above {
            assert!(docs.contains(&format!("`{name}`")), "{name}");
        }
    }
}

#[test]
fn the_json_report_tells_what_the_machine_did() {
    let folder = Folder::new();
    let json = report(&[&folder.file("job.nc", SQUARE)]);
    let x = &json["axes"]["x"];
    assert_eq!((&x["pulses"], &x["net_steps"]), (&2000.into(), &0.into()));
    assert!(json["min_pulse_us"].as_f64().unwrap() >= 10.0);
    assert!(json["cpu"]["peak"].as_f64().unwrap() <= 1.0);
}

#[test]
fn every_step_is_in_the_list_and_the_list_ends_where_the_machine_does() {
    let folder = Folder::new();
    let (job, list) = (folder.file("job.nc", SQUARE), folder.path("steps.csv"));
    let json = report(&[&job, "--steps", list.to_str().unwrap()]);
    let text = fs::read_to_string(list).unwrap();
    let mut rows = text.lines();
    assert_eq!(rows.next(), Some("cycle,step,dir,power"));
    let (mut position, mut last, mut count) = ([0i64; 3], 0, 0u64);
    for row in rows {
        let fields: Vec<&str> = row.split(',').collect();
        let (cycle, step, dir): (u64, u8, u8) = (
            fields[0].parse().unwrap(),
            fields[1].parse().unwrap(),
            fields[2].parse().unwrap(),
        );
        assert!(cycle > last && step != 0 && fields[3] == "0.000", "{row}");
        for (axis, steps) in position.iter_mut().enumerate() {
            *steps += i64::from(step >> axis & 1) * (1 - 2 * i64::from(dir >> axis & 1));
        }
        (last, count) = (cycle, count + 1);
    }
    assert_eq!(position, [0, 0, 0]);
    assert_eq!(json["step_events"], count);
}

#[test]
fn a_real_baud_rate_takes_longer_than_a_link_that_never_waits() {
    let folder = Folder::new();
    let job: String = (0..200)
        .map(|k| format!("G0X{}.{:03}\n", k % 2, k))
        .collect();
    let job = folder.file("job.nc", job);
    let fast = report(&[&job, "--set", "$110=5000", "--set", "$120=5000"]);
    let slow = report(&[
        &job,
        "--set",
        "$110=5000",
        "--set",
        "$120=5000",
        "--baud",
        "1200",
    ]);
    let seconds = |json: &serde_json::Value| json["job_seconds"].as_f64().unwrap();
    assert!(seconds(&slow) > seconds(&fast) * 1.2);
    assert_eq!(slow["axes"]["x"]["pulses"], fast["axes"]["x"]["pulses"]);
}

#[test]
fn a_picture_shows_the_travel_if_the_place_in_it_is_known() {
    let folder = Folder::new();
    let machine = |homes: bool| {
        let axis = |letter: &str| {
            format!(
                "[axes.{letter}]\nsteps_per_mm = 80\ntravel = 100\nrate_mm_min = 12000\n\
                 acceleration_mm_s2 = 1500\nhome = \"low\"\nstart = 5\nlimits = {{ low = 0 }}\n"
            )
        };
        let text = format!(
            "name = \"box\"\n[homing]\non = {homes}\norder = [\"xy\"]\n{}{}",
            axis("x"),
            axis("y")
        );
        folder.file(&format!("{homes}.toml"), text)
    };
    let cut = "G10 L20 P1 X0 Y0\nG0 X5 Y5\nM3 S500\nG1 X60 F3000\nG1 Y50\nM5\nM2\n";
    let homed = folder.file("homed.nc", format!("$H\n{cut}"));
    let unknown = folder.file("unknown.nc", cut);
    for (job, homes, shows) in [
        (&homed, true, true),
        (&unknown, true, false),
        (&unknown, false, false),
    ] {
        for command in ["run", "check"] {
            let output = leadscrew(&[command, job, "--machine", &machine(homes), "--svg", "-"]);
            let svg = stdout(&output);
            assert_eq!(svg.contains("travel of the axes"), shows, "{command} {svg}");
            // Homing ends 1 mm from the switch at -100, and work zero is there.
            let title = match shows {
                true => "machine X mm (cut from -94 to -39)",
                false => ">\nX mm (cut from 5 to 60)",
            };
            assert!(svg.contains(title), "{command}: {title} in {svg}");
        }
    }
}

#[test]
fn picture_and_waveform_are_written() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    let (svg, vcd) = (folder.path("a.svg"), folder.path("a.vcd"));
    report(&[
        &job,
        "--svg",
        svg.to_str().unwrap(),
        "--vcd",
        vcd.to_str().unwrap(),
    ]);
    let svg = fs::read_to_string(svg).unwrap();
    assert!(svg.contains("job.nc") && svg.contains("X mm") && svg.contains("speed mm/min"));
    let vcd = fs::read_to_string(vcd).unwrap();
    for wire in ["x_step", "y_direction", "enable", "spindle_pwm"] {
        assert!(vcd.contains(wire), "{wire}");
    }
    let mut times = vcd
        .lines()
        .filter_map(|line| line.strip_prefix('#')?.parse::<u64>().ok());
    assert!(times.by_ref().is_sorted(), "time runs forward");
}

#[test]
fn run_warns_of_what_check_warns_of() {
    let folder = Folder::new();
    let job = "G21 (open!\nG1\u{2212}X1 F600\n%\n$110=600\nG1 X2 (\u{b5})\nM2\nG1 X3\n";
    let job = folder.file("job.nc", job);
    let warnings = |args: &[&str]| {
        let output = leadscrew(&[args, &["--json", &job]].concat());
        serde_json::from_str::<serde_json::Value>(&stdout(&output)).unwrap()["warnings"].clone()
    };
    let expected = warnings(&["check"]);
    let kinds: Vec<&str> = expected
        .as_array()
        .unwrap()
        .iter()
        .map(|one| one["kind"].as_str().unwrap())
        .collect();
    assert_eq!(
        kinds,
        [
            "unclosed_comment",
            "realtime_byte",
            "odd_byte",
            "setting",
            "after_end"
        ]
    );
    assert_eq!(warnings(&["run", "--keep-going"]), expected);
    // The second line is refused, and no line after it is read.
    let read = warnings(&["run"]);
    assert_eq!(
        read.as_array().unwrap()[..],
        expected.as_array().unwrap()[..3]
    );
}

#[test]
fn a_refused_line_is_shown_as_it_stands_in_the_file() {
    let folder = Folder::new();
    let lines = ["G0 X\u{2212}5", "G77 (gr\u{fc}n!)"];
    let job = folder.file("job.nc", lines.join("\n"));
    let done = leadscrew(&["run", "--keep-going", "--json", &job]);
    let json: serde_json::Value = serde_json::from_str(&stdout(&done)).unwrap();
    let errors: Vec<_> = json["errors"].as_array().unwrap().iter().collect();
    let told = |at: usize| (&errors[at]["text"], &errors[at]["column"]);
    assert_eq!(told(0), (&lines[0].into(), &5.into()));
    assert_eq!(told(1), (&lines[1].into(), &1.into()));
    assert!(stderr(&done).contains("     1 | G0 X\u{2212}5\n       |     ^"));
}

#[test]
fn each_refused_line_has_its_own_fault() {
    let folder = Folder::new();
    let machine = folder.file(
        "hot.toml",
        "[axes.e]\n[heaters.nozzle]\nsensor = \"ad595\"\n",
    );
    let job = folder.file(
        "job.nc",
        "F600\nG99 G83 X8 Z-5 R2 Q1\nG0 E8\nG3 I-3 J0 F0\n",
    );
    let args = ["run", "--json", "--keep-going", &job, "--machine", &machine];
    let json: serde_json::Value = serde_json::from_str(&stdout(&leadscrew(&args))).unwrap();
    let errors = json["errors"].as_array().unwrap().iter();
    let codes: Vec<_> = errors
        .map(|error| [&error["line"], &error["code"]])
        .collect();
    assert_eq!(codes, [[3, 220], [4, 22]], "{json}");
}

#[test]
fn a_page_of_the_job_is_written_and_tells_its_time() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    let html = folder.path("a.html");
    let json = report(&[&job, "--html", html.to_str().unwrap()]);
    let html = fs::read_to_string(html).unwrap();
    let data = |id: &str| {
        let text = html.split(&format!("id=\"{id}\">")).nth(1).unwrap();
        let text = text.split("</script>").next().unwrap();
        data_encoding::BASE64.decode(text.as_bytes()).unwrap()
    };
    let course = data("course");
    let numbers = course
        .chunks(4)
        .map(|four| f32::from_le_bytes(four.try_into().unwrap()));
    let numbers: Vec<f64> = numbers.map(f64::from).collect();
    let sum = |which: usize| numbers.iter().skip(which).step_by(3).sum::<f64>();
    assert!((sum(0) - json["job_seconds"].as_f64().unwrap()).abs() < 1e-3);
    let way = json["cut_mm"].as_f64().unwrap() + json["travel_mm"].as_f64().unwrap();
    assert!((sum(1) - way).abs() < 0.05, "{} {way}", sum(1));
    assert_eq!(data("moves").len(), data("lengths").len() * 5);
}

/// The block of text in the README that begins with `begin`, without the rows that it leaves out.
fn shown_in_the_readme(begin: &str) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let readme = fs::read_to_string(root.join("README.md")).unwrap();
    let block = readme.split("```").find(|block| block.starts_with(begin));
    let lines = block.expect("the block").lines().skip(1);
    lines
        .filter(|line| line.trim() != "...")
        .map(str::to_owned)
        .collect()
}

#[test]
fn the_readme_shows_what_run_and_profile_print() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (command, begin) in [
        ("run", "text\nexamples/heart.nc"),
        ("profile", "text\n  what binds"),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_leadscrew"))
            .args([command, "examples/heart.nc"])
            .current_dir(&root)
            .output()
            .unwrap();
        let printed = stdout(&output);
        for line in shown_in_the_readme(begin) {
            let row = printed.lines().any(|printed| printed == line);
            assert!(row, "README.md has {line:?}, but {command}:\n{printed}");
        }
    }
}

/// The README's commands draw the README's pictures.
#[test]
fn the_pictures_of_the_readme_are_those_of_today() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (command, picture) in [("run", "docs/heart.svg"), ("profile", "docs/profile.svg")] {
        let output = Command::new(env!("CARGO_BIN_EXE_leadscrew"))
            .args([command, "examples/heart.nc", "--svg", "-"])
            .current_dir(&root)
            .output()
            .unwrap();
        let shown = fs::read_to_string(root.join(picture)).unwrap();
        assert!(
            stdout(&output) == shown,
            "make it anew: {command} --svg {picture}"
        );
    }
}

#[test]
fn outputs_of_a_job_stand_in_its_waveform_and_its_json() {
    let folder = Folder::new();
    let job = "G1X1F600\nM62P1\nX2\nM63P1\nX3\nM64P0\n";
    let (file, vcd) = (folder.file("job.nc", job), folder.path("job.vcd"));
    let args = [
        "run",
        &file,
        "--outputs",
        "2",
        "--json",
        "--vcd",
        vcd.to_str().unwrap(),
    ];
    let json: serde_json::Value = serde_json::from_str(&stdout(&leadscrew(&args))).unwrap();
    assert_eq!(json["errors"].as_array().unwrap().len(), 0, "{json}");
    assert_eq!(json["outputs"]["levels"], serde_json::json!([true, false]));
    assert_eq!(json["outputs"]["changes"], 3);
    let wave = fs::read_to_string(&vcd).unwrap();
    let id = wave.lines().find(|line| line.ends_with(" output_1 $end"));
    let id = id.unwrap().split(' ').nth(3).unwrap();
    // The levels are those at power-up, on, and off; M64 of the other output writes the level
    // again.
    let levels = ["0", "1"].map(|level| wave.matches(&format!("\n{level}{id}\n")).count());
    assert_eq!(levels, [3, 1], "{wave}");
    // On a machine without outputs these words are an error, as in Grbl.
    let plain: serde_json::Value =
        serde_json::from_str(&stdout(&leadscrew(&["run", &file, "--json"]))).unwrap();
    assert_eq!(plain["errors"][0]["code"], 20);
    assert_eq!(plain["outputs"], serde_json::Value::Null);
}

#[test]
fn the_path_goes_on_from_where_homing_has_led() {
    let folder = Folder::new();
    let mut machine = "[settings]\n\"$22\" = 1\n\"$24\" = 200\n\"$25\" = 2000\n".to_owned();
    for axis in ["x", "y", "z"] {
        machine += &format!("[axes.{axis}]\nstart = -5\nlimits = {{ high = 0 }}\n");
    }
    let machine = folder.file("machine.toml", machine);
    let job = "G21 G90\nG0 X-3\nG4 P0.01\n$H\nG0 X-20\nG1 Y-10 F1000\n";
    let job = folder.file("job.nc", job);
    let html = folder.path("a.html");
    let run = report(&[
        &job,
        "--machine",
        &machine,
        "--html",
        html.to_str().unwrap(),
    ]);
    let check = leadscrew(&["check", "--json", &job, "--machine", &machine]);
    let check: serde_json::Value = serde_json::from_str(&stdout(&check)).unwrap();
    // The switches are at 0, the pull-off ($27) is 1 mm.
    for report in [run, check] {
        assert_eq!(report["travel_mm"].as_f64(), Some(3.0 + 19.0), "{report}");
        assert_eq!(report["cut_mm"].as_f64(), Some(9.0), "{report}");
        assert_eq!(report["extents"]["y"]["max"].as_f64(), Some(-1.0));
    }
    let html = fs::read_to_string(html).unwrap();
    let size = |id: &str| {
        let text = html.split(&format!("id=\"{id}\">")).nth(1).unwrap();
        let text = text.split('<').next().unwrap();
        data_encoding::BASE64.decode(text.as_bytes()).unwrap().len()
    };
    // The moves are the start, three moves, and the jump of homing: 20 bytes each, and 4 bytes for
    // each length.
    assert_eq!((size("moves"), size("lengths")), (5 * 20, 5 * 4));
}
