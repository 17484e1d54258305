//! The `leadscrew` program as a user meets it: options, outputs, exit status, and every kind of bad input.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of its own for one test.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn file(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        let path = self.path(name);
        fs::write(&path, content).unwrap();
        path.to_str().unwrap().to_owned()
    }
}

fn leadscrew(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_leadscrew"))
        .args(args)
        .output()
        .unwrap()
}

fn stderr(output: &Output) -> String {
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    assert!(!text.contains("panicked"), "{text}");
    text
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Calls the program, expects exit status 2 and one message that contains all of `parts`.
fn unusable(args: &[&str], parts: &[&str]) {
    let output = leadscrew(args);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    for part in parts {
        assert!(
            message.contains(part),
            "{args:?}: no {part:?} in: {message}"
        );
    }
    let messages = message
        .lines()
        .filter(|line| line.starts_with("leadscrew: "));
    assert_eq!(messages.count(), 1, "{message}");
}

/// Runs a job that must be done without an error, and answers its JSON report.
fn report(args: &[&str]) -> serde_json::Value {
    let output = leadscrew(&[&["run", "--json"], args].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    serde_json::from_str(&stdout(&output)).unwrap()
}

const SQUARE: &str = "G21 G90\nG1 F400\nX4\nY4\nX0\nY0\n";

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

/// All names of fields in `value`, but for those of axes.
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
    let docs = include_str!("../../../docs/json.md");
    let folder = Folder::new();
    let file = folder.file("job.nc", format!("{SQUARE}G99\n"));
    for command in ["run", "check", "profile"] {
        let mut sections = docs.split("\n## ");
        let section = sections.find(|text| text.starts_with(&format!("`leadscrew {command}")));
        let section = section.unwrap();
        let output = leadscrew(&[command, "--json", &file]);
        let json = serde_json::from_str(&stdout(&output)).unwrap();
        let mut names = Vec::new();
        fields(&json, &mut names);
        assert!(names.len() >= 7, "{command}: {names:?}");
        let above = ["line", "column", "code", "message", "text"];
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
    assert!(stderr(&output).contains("X would be at 5.000 mm, its travel is -200.000 to 0"));
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
fn serve_says_what_is_wrong_with_its_options() {
    unusable_usage(&["serve"], "--pty <LINK>|--tcp <ADDRESS>|--ws <ADDRESS>");
    unusable_usage(&["serve", "--tcp", "99999"], "expected a port, 0 to 65535");
    let folder = Folder::new();
    let profile = folder.file("bad.toml", "[axes.x]\ntravel = -1\n");
    unusable(
        &["serve", "--tcp", "0", "--machine", &profile],
        &["bad.toml:2: axes.x.travel: expected a number above 0"],
    );
}

/// Calls the program, expects exit status 2 and this in what it says about its options.
fn unusable_usage(args: &[&str], part: &str) {
    let output = leadscrew(args);
    assert_eq!(output.status.code(), Some(2), "{args:?}");
    assert!(stderr(&output).contains(part), "{}", stderr(&output));
}

#[test]
fn unreadable_jobs_are_refused_with_one_message() {
    let folder = Folder::new();
    let file = |name: &str, content: &[u8]| folder.file(name, content);
    unusable(
        &["run", "no/such/file.nc"],
        &["no/such/file.nc", "cannot be read"],
    );
    unusable(&["run", &file("empty.nc", b"")], &["empty.nc", "is empty"]);
    unusable(
        &["check", &file("empty.nc", b"")],
        &["empty.nc", "is empty"],
    );
    unusable(&["run", env!("CARGO_BIN_EXE_leadscrew")], &["is not text"]);
    unusable(
        &["run", folder.0.path().to_str().unwrap()],
        &["is a directory"],
    );
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

#[test]
fn bad_settings_are_refused_with_their_place() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    let nonsense = folder.file("bad.txt", "$100=80\nhello\n");
    unusable(
        &["run", &job, "--settings", &nonsense],
        &["bad.txt:2", "hello", "expected a setting"],
    );
    unusable(
        &["run", &job, "--settings", "missing.txt"],
        &["missing.txt", "cannot be read"],
    );
    unusable(&["run", &job, "--set", "$999=1"], &["$999=1", "error:3"]);
    unusable(&["run", &job, "--set", "$0=0.9"], &["$0=0.9", "error:6"]);
    unusable(
        &["run", &job, "--set", "110"],
        &["--set '110'", "expected a setting"],
    );
    let binary = folder.file("bin.txt", [0xFF, 0xFE, 0x00]);
    unusable(
        &["run", &job, "--settings", &binary],
        &["bin.txt", "not a text file"],
    );
}

#[test]
fn outputs_that_cannot_be_written_are_named() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    for option in ["--svg", "--vcd", "--steps"] {
        unusable(
            &["run", &job, option, "no/such/folder/x"],
            &["no/such/folder/x", "cannot be written"],
        );
    }
    if Path::new("/dev/full").exists() {
        unusable(
            &["run", &job, "--steps", "/dev/full"],
            &["/dev/full", "cannot be written"],
        );
    }
}

#[test]
fn bad_usage_is_explained() {
    for args in [
        &["run"][..],
        &["fly", "x.nc"],
        &["run", "x.nc", "--baud", "5"],
        &[],
    ] {
        let output = leadscrew(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(stderr(&output).contains("Usage") || stderr(&output).contains("--help"));
    }
}

/// A program whose reader has gone, as `leadscrew run job.nc | head -1` does it.
fn unread(args: &[&str]) -> Output {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut program = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
    program.args(args).stdout(writer).output().unwrap()
}

#[test]
fn a_reader_that_has_seen_enough_is_no_failure() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G1 X1 F600\n");
    for args in [
        ["run", &job].as_slice(),
        &["run", "--json", &job],
        &["check", &job],
        &["profile", "--no-trials", &job],
    ] {
        let output = unread(args);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{args:?}: {}",
            stderr(&output)
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn an_output_that_cannot_be_written_is_said() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G1 X1 F600\n");
    let full = fs::File::options().write(true).open("/dev/full").unwrap();
    let mut program = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
    let output = program.args(["run", &job]).stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("standard output: "));
}

/// The readme's block of text that begins so, without the rows that it leaves out.
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
fn the_readme_shows_what_run_prints() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let output = Command::new(env!("CARGO_BIN_EXE_leadscrew"))
        .args(["run", "examples/heart.nc"])
        .current_dir(root)
        .output()
        .unwrap();
    let printed = stdout(&output);
    for line in shown_in_the_readme("text\nexamples/heart.nc") {
        let row = printed.lines().any(|printed| printed == line);
        assert!(row, "README.md has {line:?}, but:\n{printed}");
    }
}
