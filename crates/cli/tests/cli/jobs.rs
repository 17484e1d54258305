//! Jobs good and bad, and the machine's answers to them.

use crate::program::{leadscrew, report, stderr, stdout, Folder, SQUARE};

#[test]
fn settings_come_from_a_file_and_single_ones_win() {
    let folder = Folder::new();
    let settings = folder.file(
        "machine.txt",
        "$100=80.000\r\n$101=80.000 (y, step/mm)\n\nok\n",
    );
    let job = folder.file("job.nc", "G0X1Y1\n");
    let json = report(&[&job, "--settings", &settings, "--set", "$101=160"]);
    assert_eq!(json["axes"]["x"]["net_steps"], 80);
    assert_eq!(json["axes"]["y"]["net_steps"], 160);
}

#[test]
fn an_error_is_shown_with_its_line_a_caret_and_what_to_do() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G21\n(note) G0 X-- Y2\n");
    let output = leadscrew(&["run", &job]);
    assert_eq!(output.status.code(), Some(1));
    let message = stderr(&output);
    let lines: Vec<&str> = message.lines().collect();
    assert!(
        lines[0].ends_with("job.nc:2:12: error:2: A number is missing or badly written"),
        "{message}"
    );
    assert_eq!(lines[2].find('^'), lines[1].find("--"), "{message}");
    assert!(lines[3].contains("must be followed by a number"));
}

#[test]
fn a_job_stops_at_its_first_error_unless_told_to_go_on() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G0X1\nG77\nG0X2\nG78\nG0X3\n");
    for (option, errors, net_steps) in [("--quiet", 1, 250), ("--keep-going", 2, 750)] {
        let output = leadscrew(&["run", &job, "--json", option]);
        assert_eq!(output.status.code(), Some(1), "{option}");
        let json: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
        assert_eq!(json["errors"].as_array().unwrap().len(), errors, "{option}");
        assert_eq!(json["axes"]["x"]["net_steps"], net_steps, "{option}");
    }
}

#[test]
fn check_finds_all_errors_at_once_and_soft_limits_too() {
    let folder = Folder::new();
    let job = folder.file(
        "job.nc",
        "G21\nG1X1\nG77\nG0X-3\nG0X5\n$J=G91Y1F100\nG2X0Y0I0J0R\n",
    );
    let limits = ["--set", "$22=1", "--set", "$20=1"];
    let output = leadscrew(&[&["check", &job, "--json"], &limits[..]].concat());
    assert_eq!(output.status.code(), Some(1));
    let json: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let found: Vec<_> = json["errors"]
        .as_array()
        .unwrap()
        .iter()
        .map(|e| (e["line"].as_u64().unwrap(), e["code"].as_u64().unwrap()))
        .collect();
    assert_eq!(found, [(2, 22), (3, 20), (5, 2), (6, 15), (7, 2)]);
    let words = "X would be at 5.000 mm, its travel is -200.000 to 0";
    assert!(stderr(&output).contains(words));
    let message = json["errors"][2]["message"].as_str().unwrap();
    assert!(message.ends_with(&format!(": {words}")), "{message}");
    assert_eq!(
        leadscrew(&["check", &folder.file("good.nc", SQUARE)])
            .status
            .code(),
        Some(0)
    );
}

#[test]
fn check_follows_an_arc_along_its_way() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "F100\nG0X-10Y-5\nG2X-10Y-5I5\nG2X-10Y-5I0J10\n");
    let limits = ["--set", "$22=1", "--set", "$20=1"];
    let output = leadscrew(&[&["check", &job], &limits[..]].concat());
    assert_eq!(output.status.code(), Some(1));
    let message = stderr(&output);
    assert!(
        message.contains("job.nc:4: ALARM:2") && message.contains("Y would be at"),
        "{message}"
    );
    assert_eq!(message.matches("ALARM:2").count(), 1, "{message}");
}

#[test]
fn an_alarm_ends_the_job_with_its_line() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G0X-1\nG0X5\nG0X-2\n");
    let output = leadscrew(&["run", &job, "--set", "$22=1", "--set", "$20=1"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("job.nc:2: ALARM:2"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn a_line_that_the_machine_leaves_unanswered_ends_the_job_with_an_error() {
    let folder = Folder::new();
    let asleep = folder.file("asleep.nc", "G1X1F600\nG4P0\n$SLP\nG1X2\nG1X3\n");
    let open = folder.file("open.toml", "[door]\nfitted = true\nopen = true\n");
    let job = folder.file("job.nc", "G0X5\n");
    for (args, place) in [
        (vec!["run", &asleep], "asleep.nc:4: error: "),
        (vec!["run", &asleep, "--keep-going"], "asleep.nc:4: error: "),
        (vec!["profile", &asleep], "asleep.nc:4: error: "),
        (vec!["run", &job, "--machine", &open], "job.nc:1: error: "),
    ] {
        let output = leadscrew(&args);
        let (said, result) = (stderr(&output), stdout(&output));
        assert_eq!(output.status.code(), Some(1), "{args:?}: {said}");
        assert!(
            said.contains(place) && said.contains("unanswered"),
            "{said}"
        );
        let ends = [
            "stopped by Sleep at line 3",
            "stopped by an open door at line 1",
        ];
        assert!(ends.iter().any(|end| result.contains(end)), "{result}");
    }
    let last = folder.file("last.nc", "G1X1F600\nG4P0\n$SLP\n");
    assert_eq!(leadscrew(&["run", &last]).status.code(), Some(0));
}

/// The machine of a test, its job, and how the job ends: the cause and the line.
type Ending = (&'static str, &'static str, Option<&'static str>, u64);

const TOOLS: &str = "[tool_change]\nshown = \"hold\"\n";
const SWITCHES: &str = "[bounds]\nhard = true\n[axes.x]\nlimits = { high = 3 }\n";
const SOFT: &str = "[homing]\non = true\n[bounds]\nsoft = true\n";
const PROBE: &str = "[probe]\nplate_height = -50\n";

const ENDINGS: [Ending; 14] = [
    ("", "G1 X1 F600\n", None, 1),
    ("", "G1 X1 F600\nM2\n", None, 2),
    ("", "G1 X1 F600\nM30\n\n", None, 3),
    ("", "G1 X1 F600\nM0 (turn it)\nX2\n", None, 3),
    ("", "G1 X1 F600\nG77\nX2\n", Some("error:20"), 2),
    ("", "G1 X1\n", Some("error:22"), 1),
    ("", "G1 X1 F600\nG4 P0\n\u{18}\nX2\n", Some("a reset"), 1),
    ("", "G1 X9 F100\nG4 P0\nX9 \u{18}\n", Some("a reset"), 1),
    ("", "G1 X1 F600\nG4 P0\n$SLP\nX2\n", Some("Sleep"), 3),
    ("", "G1 X1 F600\n\u{84}X2\nX3\n", Some("an open door"), 1),
    (TOOLS, "G1 X1 F600\nM6 T2\n\u{18}\nX2\n", Some("a reset"), 1),
    (SWITCHES, "G1 X1 F600\nX9\n", Some("ALARM:1"), 2),
    (SOFT, "$X\nG1 X1 F600\n", Some("ALARM:2"), 2),
    (PROBE, "G1 X1 F600\nG38.2 Z-1\n", Some("ALARM:5"), 2),
];

#[test]
fn a_job_has_one_account_of_its_end_however_it_ends() {
    let folder = Folder::new();
    for (file, job, by, line) in ENDINGS {
        let machine = folder.file("machine.toml", file);
        let name = folder.file("job.nc", job);
        let options = ["--machine", &machine, &name];
        for command in ["run", "profile"] {
            let output = leadscrew(&[&[command, "--json"], &options[..]].concat());
            let json: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
            let end = &json["end"];
            assert_eq!(
                (end["by"].as_str(), &end["line"]),
                (by, &line.into()),
                "{job} {json}"
            );
            let at = if by.is_some() { "stopped" } else { "done" };
            assert_eq!(end["at"], at, "{job}");
            let words = end["words"].as_str().unwrap();
            let expected = by.map_or("done".to_owned(), |by| format!("stopped by {by}"));
            assert!(words.starts_with(&expected), "{words}");
            let told = stdout(&leadscrew(&[&[command], &options[..]].concat()));
            assert!(told.lines().next().unwrap().ends_with(words), "{told}");
        }
    }
}

/// Line, code and column of each error that a command finds in a job.
fn errors(args: &[&str]) -> Vec<[Option<u64>; 3]> {
    let output = leadscrew(args);
    let json: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let errors = json["errors"].as_array().unwrap().iter();
    errors
        .map(|error| ["line", "code", "column"].map(|field| error[field].as_u64()))
        .collect()
}

/// Expects that `run` and `check` find the same errors in the job, in these lines.
fn same_errors(job: &str, machine: &[&str], lines: &[u64]) {
    let folder = Folder::new();
    let job = &folder.file("job.nc", job);
    let found = errors(&[&["check", "--json", job], machine].concat());
    let met = errors(&[&["run", "--json", "--keep-going", job], machine].concat());
    assert_eq!(found, met, "{job}");
    let places: Vec<_> = found.iter().filter_map(|[line, ..]| *line).collect();
    assert_eq!(places, lines, "{found:?}");
}

#[test]
fn check_and_run_refuse_the_same_bytes() {
    let job = "G0X\u{2212}1\nG1\u{a0}X1F600\nG0X1?\n~ G0X1\nG0X1\x7f\nG0X\x012 (\u{e9})\n\u{c4}\n";
    same_errors(job, &[], &[1, 5, 7]);
}

#[test]
fn check_follows_the_machine_into_check_mode_sleep_and_a_new_start() {
    // Leaving check mode, and `$RST=`, the machine starts anew: without a feed, in G54.
    same_errors("$C\nG1X1F600\n$H\n$110=5\n$C\nG1X2\n", &[], &[3, 4, 6]);
    same_errors("F600\n$RST=#\nG1X2\n", &[], &[3]);
    same_errors("$N0=G77\n$N1=G20\n$9999\n$SED=1\n", &[], &[1, 3]);
    same_errors("G1X1F600\nG4P0\n$SLP\n\nG1X2\n", &[], &[4]);
}

#[test]
fn check_knows_the_settings_and_the_tools_of_extensions() {
    let folder = Folder::new();
    let machine = folder.file("machine.toml", "[tool_change]\n");
    let job = "$860=5\n$861=-1\n$860\n$SED=862\nG10L1P1Z3\nG43H1\nG1Z5F600\nM6T1\nG77\n";
    same_errors(job, &["--machine", &machine], &[2, 9]);
    let job = folder.file("job.nc", job);
    let read = |command, fields: &[&str]| {
        let args = [command, "--json", "--machine", &machine, &job];
        let output = leadscrew(&[&args, fields].concat());
        serde_json::from_str::<serde_json::Value>(&stdout(&output)).unwrap()
    };
    let (found, met) = (read("check", &[]), read("run", &["--keep-going"]));
    assert_eq!(found["extents"]["z"]["max"], 8.0);
    assert_eq!(met["extents"]["z"]["max"], 8.0);
    assert_eq!(
        (&found["pauses"][0], &met["pauses"][0]),
        (&8.into(), &8.into())
    );
}

#[test]
fn check_goes_the_way_of_a_jog_and_knows_what_a_new_setting_changes() {
    let folder = Folder::new();
    for (job, travel, cut) in [
        ("$J=X5F100\n", 5.0, 0.0),
        // At X2 the motor has made 500 steps: X1 with 500 of them to a millimetre.
        ("G0X2\nG4P0\n$100=500\nG1X3F600\n", 2.0, 2.0),
        ("$100=500\nG0X2\nG4P0\n$RST=$\nG1X3F600\n", 2.0, 1.0),
        // A spindle's M3 is no order to a laser.
        ("M3S500\n$32=1\nG1X3F600\n", 3.0, 0.0),
    ] {
        let job = folder.file("job.nc", job);
        for command in ["run", "check"] {
            let done = leadscrew(&[command, "--json", &job]);
            let json: serde_json::Value = serde_json::from_str(&stdout(&done)).unwrap();
            let length = |field: &str| json[field].as_f64().unwrap();
            assert!(
                (length("travel_mm") - travel).abs() < 1e-6,
                "{command}: {json}"
            );
            assert!((length("cut_mm") - cut).abs() < 1e-6, "{command}: {json}");
        }
    }
}

#[test]
fn check_says_where_motion_may_still_go_on() {
    let folder = Folder::new();
    for (job, lines) in [
        ("G1X1F600\n$H\n", vec![2]),
        ("G1X1F600\n$#\n$G\n$J=X2F100\n", vec![2, 4]),
        ("G1X1F600\n$C\nG1X2\n", vec![2]),
        ("$J=X1F100\n$J=X2F100\nG1X5F100\n", vec![3]),
        ("G1X1F600\nG4P0\n$H\n", vec![]),
        (
            "G1X1F600\nM0\n$#\nG1X2\nM3S1\n$#\nG1X3\nM8\n$N0=\n$H\n$H\n",
            vec![],
        ),
    ] {
        let job = folder.file("job.nc", job);
        let output = leadscrew(&["check", "--json", "--set", "$22=1", &job]);
        let json: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
        let warnings = json["warnings"].as_array().unwrap().iter();
        let told = warnings.filter(|warning| warning["kind"] == "in_motion");
        let told: Vec<_> = told
            .filter_map(|warning| warning["line"].as_u64())
            .collect();
        assert_eq!(told, lines, "{json}");
        assert_eq!(output.status.code(), Some(0), "{json}");
    }
}

#[test]
fn a_program_pause_is_resumed_and_the_program_goes_on() {
    let folder = Folder::new();
    let json = report(&[&folder.file("job.nc", "G0X1\nM0\nG0X2\nM30\n")]);
    assert_eq!(json["axes"]["x"]["net_steps"], 500);
}

#[test]
fn a_machine_that_wants_homing_is_unlocked_and_that_is_said() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G0X5\n");
    let output = leadscrew(&["run", &job, "--set", "$22=1"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(stderr(&output).contains("unlocked by $X, not homed"));
    assert!(stdout(&output).contains("ends at 5.000 mm"));
    let quiet = leadscrew(&["run", &job, "--set", "$22=1", "--quiet"]);
    assert_eq!(stderr(&quiet), "");
    assert_eq!(stderr(&leadscrew(&["run", &job])), "");
}

#[test]
fn line_ends_marks_and_nuls_do_no_harm() {
    let folder = Folder::new();
    for (name, text) in [
        ("bom.nc", "\u{FEFF}G21\nG0X1\n"),
        ("crlf.nc", "G21\r\nG0X1\r\n"),
        ("cr.nc", "G21\rG0X1\r"),
        ("tape.nc", "%\nG21\nG0X1\n%\n"),
        ("nul.nc", "G21\0\nG0X1\0\n"),
        ("realtime.nc", "(what?! ~ é)\nG0X1\n"),
        ("open.nc", "G21\nG0X1"),
    ] {
        let json = report(&[&folder.file(name, text)]);
        assert_eq!(json["axes"]["x"]["net_steps"], 250, "{name}");
    }
}

/// The wire refuses the line, takes it, or acts on a byte of it: so do all who read the file.
#[test]
fn a_file_is_read_as_the_wire_reads_it() {
    let folder = Folder::new();
    for (text, refused) in [
        ("G0X1\nG0 X\u{2212}10\n", true),
        ("G0X1\nF1000\u{2212}1\n", true),
        (
            "G0X1 (Fr\u{e4}sen \u{c4} \u{d8} \u{2013})\nG0\u{a0}X2\n",
            false,
        ),
        ("G0X1 (\u{91})\nG0X2\n", false),
    ] {
        let job = folder.file("job.nc", text);
        for tool in ["check", "run", "profile"] {
            let output = leadscrew(&[tool, &job]);
            assert_eq!(
                output.status.code(),
                Some(i32::from(refused)),
                "{tool} {text}"
            );
            let told = stderr(&output).contains("job.nc:2:") && stderr(&output).contains("error:");
            assert_eq!(told, refused, "{tool} {text}: {}", stderr(&output));
        }
    }
}

#[test]
fn a_byte_that_acts_at_once_acts_in_a_run_and_is_warned_of_once() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G0X1 (wow!)\nG0X2 (no!)\nG0X3 (why?)\n");
    let json = report(&[&job]);
    assert_eq!(json["axes"]["x"]["net_steps"], 750);
    assert!(!json["pauses"].as_array().unwrap().is_empty(), "{json}");
    for tool in ["check", "run"] {
        let output = leadscrew(&[tool, "--json", &job]);
        let json: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
        let warnings = json["warnings"].as_array().unwrap().iter();
        let told: Vec<_> = warnings
            .map(|one| (one["line"].as_u64(), one["kind"].as_str()))
            .collect();
        let kind = Some("realtime_byte");
        assert_eq!(told, [(Some(1), kind), (Some(3), kind)], "{tool}");
    }
}

#[test]
fn a_line_of_a_megabyte_is_an_error_and_not_a_crash() {
    let folder = Folder::new();
    let job = folder.file("long.nc", format!("G0X{}\nG0X1\n", "1".repeat(1 << 20)));
    let output = leadscrew(&["run", &job, "--keep-going", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("long.nc:1:1: error:11"));
    let json: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(json["axes"]["x"]["net_steps"], 250);
}
