//! The habits of people and scripts with programs that work on files: pipes, folders, several
//! files, odd names, Ctrl-C.

use crate::program::{interrupt, leadscrew, report, stderr, stdout, Folder, SQUARE};
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

const PATIENCE: Duration = Duration::from_secs(60);

/// Waits for a program that might not end.
fn output(mut child: Child) -> Output {
    let until = Instant::now() + PATIENCE;
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > until {
            child.kill().unwrap();
            panic!("it does not end");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    child.wait_with_output().unwrap()
}

fn start(args: &[&str], stdin: Stdio) -> Child {
    let mut program = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
    let program = program.args(args).stdin(stdin);
    program
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

#[cfg(unix)]
#[test]
fn a_named_pipe_is_read_once() {
    let folder = Folder::new();
    let pipe = folder.path("pipe.nc");
    assert!(Command::new("mkfifo")
        .arg(&pipe)
        .status()
        .unwrap()
        .success());
    for command in ["run", "check", "profile"] {
        let running = start(&[command, pipe.to_str().unwrap()], Stdio::null());
        fs::write(&pipe, SQUARE).unwrap();
        let done = output(running);
        assert_eq!(done.status.code(), Some(0), "{command}: {}", stderr(&done));
        assert!(stdout(&done).contains("pipe.nc: 6 lines"), "{command}");
    }
}

#[test]
fn a_picture_for_standard_output_goes_there_and_nothing_else_does() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    for command in ["run", "check", "profile"] {
        let mut program = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
        program
            .args([command, &job, "--svg", "-"])
            .current_dir(folder.path(""));
        let done = program.output().unwrap();
        assert_eq!(done.status.code(), Some(0), "{command}");
        let picture = stdout(&done);
        assert!(picture.trim_start().starts_with("<svg") && picture.trim_end().ends_with("</svg>"));
        assert!(stderr(&done).contains("job.nc: 6 lines"), "{command}");
        assert!(!folder.path("-").exists(), "{command}");
        let both = leadscrew(&[command, &job, "--svg", "-", "--json"]);
        assert_eq!(both.status.code(), Some(2), "{command}");
    }
    let both = leadscrew(&["check", &job, "--svg", "-", "--github"]);
    assert_eq!(both.status.code(), Some(2));
}

#[test]
fn check_draws_the_toolpath() {
    let folder = Folder::new();
    let job = folder.file("job.nc", SQUARE);
    let picture = folder.path("job.svg");
    let done = leadscrew(&["check", &job, "--svg", picture.to_str().unwrap()]);
    assert_eq!(done.status.code(), Some(0), "{}", stderr(&done));
    let picture = fs::read_to_string(picture).unwrap();
    assert!(picture.contains("16.0 mm cut") && picture.contains("X mm"));
}

#[cfg(unix)]
#[test]
fn who_stops_a_run_finds_no_half_files() {
    let folder = Folder::new();
    let name = |name: &str| folder.path(name).to_str().unwrap().to_owned();
    let [svg, steps, vcd] = ["a.svg", "a.csv", "a.vcd"].map(name);
    fs::write(&svg, "the one before").unwrap();
    let args = ["run", "-", "--svg", &svg, "--steps", &steps, "--vcd", &vcd];
    let mut running = start(&args, Stdio::piped());
    let mut job = running.stdin.take().unwrap();
    // This is more than the program reads before the run begins; the end of the job is still to
    // come.
    job.write_all(SQUARE.repeat(2000).as_bytes()).unwrap();
    std::thread::sleep(Duration::from_secs(1));
    assert!(
        running.try_wait().unwrap().is_none(),
        "it does not wait for the rest"
    );
    interrupt(running.id());
    output(running);
    assert_eq!(fs::read_to_string(&svg).unwrap(), "the one before");
    let files = fs::read_dir(folder.path("")).unwrap();
    let files: Vec<_> = files.map(|file| file.unwrap().file_name()).collect();
    assert_eq!(files, ["a.svg"]);
}

#[test]
fn pauses_of_the_program_are_told() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G1X1F600\nM0\nG1X2\nM0 (tool)\nT7\nG1X3\n");
    let json = report(&[&job]);
    assert_eq!(json["pauses"], Value::from(vec![2, 4]));
    assert_eq!(json["tools"], Value::from(vec![7]));
    for command in ["run", "check", "profile"] {
        let text = stdout(&leadscrew(&[command, &job]));
        let told = text.contains("  pauses       2 (M0, M6, !)") && text.contains("line 2, 4\n");
        assert!(told, "{text}");
        let why = "line 4: the program pauses, tool: Resume goes on";
        assert_eq!(text.contains(why), command != "check", "{text}");
        let json = stdout(&leadscrew(&[command, "--json", &job]));
        let json: Value = serde_json::from_str(&json).unwrap();
        assert_eq!(json["pauses"], Value::from(vec![2, 4]), "{command}");
    }
}

#[test]
fn a_machine_with_heaters_pauses_and_stops_as_others_do() {
    let folder = Folder::new();
    let words = "[bounds]\nhard = true\n[axes.x]\nlimits = { low = -5 }\n[heaters.nozzle]\nsensor = \"ad595\"\n";
    let machine = folder.file("hot.toml", words);
    let run = |job: &str| {
        let job = folder.file("job.nc", job);
        output(start(&["run", &job, "--machine", &machine], Stdio::null()))
    };
    let done = run("M0\nG0 X1\n");
    assert_eq!(done.status.code(), Some(0), "{}", stderr(&done));
    assert!(stdout(&done).contains("line 1"), "{}", stdout(&done));
    let stopped = run("G0 X-9\nG4 P0\n");
    assert!(stderr(&stopped).contains("ALARM:1"), "{}", stderr(&stopped));
}

#[test]
fn one_cause_is_told_once() {
    let folder = Folder::new();
    let lines: String = (0..300).map(|k| format!("G0X{}\n", 1 + k % 7)).collect();
    let job = folder.file("job.nc", format!("{lines}G0X-1\nG0Y1\nG77\nG77\n"));
    let limits = ["--set", "$22=1", "--set", "$20=1"];
    let done = leadscrew(&[&["check", &job], &limits[..]].concat());
    assert_eq!(done.status.code(), Some(1));
    let message = stderr(&done);
    assert_eq!(message.matches("soft limit").count(), 0, "{message}");
    assert_eq!(message.matches("would be at").count(), 2, "{message}");
    let rest = "ALARM:2 (X too high): 299 more, as in line 1, the last in line 300";
    assert!(message.contains(rest), "{message}");
    assert!(message.contains("error:20 (G77): 1 more"), "{message}");
    assert!(stdout(&done).contains("304 lines, 303 errors"));
}

#[test]
fn a_move_that_is_too_long_is_called_that() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G1X900000F1000\n");
    for command in ["run", "check"] {
        let done = leadscrew(&[command, &job, "--set", "$130=1000000"]);
        assert_eq!(done.status.code(), Some(1), "{command}");
        let message = stderr(&done);
        assert!(
            message.contains("error:33: the move has more steps"),
            "{message}"
        );
        assert!(!message.contains("radi"), "{message}");
    }
}

/// The job makes ten steps at 700 mm/min and then rests.
#[test]
fn rests_do_not_make_short_moves_slow() {
    let folder = Folder::new();
    let job = folder.file(
        "job.nc",
        "G91\n".to_owned() + &"G1X.04F700\nG4P.3\n".repeat(40),
    );
    let json = report(&[&job, "--set", "$110=2000", "--set", "$120=20000"]);
    let peak = json["axes"]["x"]["peak_mm_min"].as_f64().unwrap();
    assert!((600.0..720.0).contains(&peak), "{peak}");
}

#[test]
fn a_job_that_keeps_the_line_busy_is_no_full_load() {
    let folder = Folder::new();
    let json = report(&[&folder.file("job.nc", SQUARE.repeat(50))]);
    let peak = json["cpu"]["peak"].as_f64().unwrap();
    assert!(peak > 0.0 && peak < 0.5, "{peak}");
}

/// If each line cost 8 bytes, these lines would take 8 MB.
#[cfg(target_os = "linux")]
#[test]
fn a_million_lines_take_no_more_memory_than_a_hundred() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G4P0\n".to_owned() + &"\n".repeat(1_000_000));
    let mut shell = Command::new("sh");
    let limited = "ulimit -d 4000 && exec \"$@\"";
    shell.args([
        "-c",
        limited,
        "sh",
        env!("CARGO_BIN_EXE_leadscrew"),
        "run",
        &job,
    ]);
    let done = output(
        shell
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap(),
    );
    assert_eq!(done.status.code(), Some(0), "{}", stderr(&done));
    assert!(stdout(&done).contains("1000001 lines, done"));
}

#[test]
fn folders_and_several_files_are_done_one_after_the_other() {
    let folder = Folder::new();
    fs::create_dir(folder.path("jobs")).unwrap();
    fs::create_dir(folder.path("jobs/more")).unwrap();
    fs::create_dir(folder.path("empty")).unwrap();
    for name in [
        "jobs/b.nc",
        "jobs/a.GCODE",
        "jobs/more/c.tap",
        "jobs/notes.txt",
    ] {
        folder.file(name, SQUARE);
    }
    let bad = folder.file("bad.nc", "G77\n");
    let jobs = folder.path("jobs").to_str().unwrap().to_owned();
    for command in ["run", "check"] {
        let done = leadscrew(&[command, "--json", &jobs, &bad]);
        assert_eq!(done.status.code(), Some(1), "{command}");
        let json: Value = serde_json::from_str(&stdout(&done)).unwrap();
        let all = json.as_array().unwrap().iter();
        let names: Vec<&str> = all.map(|one| one["file"].as_str().unwrap()).collect();
        let names: Vec<&str> = names
            .iter()
            .map(|name| name.rsplit('/').next().unwrap())
            .collect();
        assert_eq!(names, ["a.GCODE", "b.nc", "c.tap", "bad.nc"], "{command}");
        let empty = folder.path("empty").to_str().unwrap().to_owned();
        let none = leadscrew(&[command, &empty]);
        assert_eq!(none.status.code(), Some(2), "{command}");
        assert!(stderr(&none).contains("no file in it is a *.nc, *.gcode"));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_name_need_not_be_utf_8() {
    use std::os::unix::ffi::OsStrExt;
    let folder = Folder::new();
    let name = folder
        .path("")
        .join(std::ffi::OsStr::from_bytes(b"T\xE4sse.nc"));
    fs::write(&name, SQUARE).unwrap();
    for command in ["run", "check", "profile"] {
        let mut program = Command::new(env!("CARGO_BIN_EXE_leadscrew"));
        let done = program.arg(command).arg(&name).output().unwrap();
        assert_eq!(done.status.code(), Some(0), "{command}: {}", stderr(&done));
    }
}

#[test]
fn check_warns_of_what_nobody_can_have_meant() {
    let folder = Folder::new();
    let text = "G21 (mm\n$110=500\nG0 X\u{2212}1\nG0X50\nM30\nG0X2\n";
    let job = folder.file("job.nc", text);
    let done = leadscrew(&["check", "--json", &job, "--origin", "-20,-150,-40"]);
    let json: Value = serde_json::from_str(&stdout(&done)).unwrap();
    let warnings = json["warnings"].as_array().unwrap().iter();
    let warnings: Vec<_> = warnings
        .map(|w| (w["line"].as_u64(), w["kind"].as_str()))
        .collect();
    let expected = [
        (1, "unclosed_comment"),
        (2, "setting"),
        (3, "odd_byte"),
        (4, "outside_travel"),
        (6, "after_end"),
    ];
    assert_eq!(
        warnings,
        expected.map(|(line, kind)| (Some(line), Some(kind)))
    );
    let message = json["warnings"][3]["message"].as_str().unwrap();
    assert!(message.contains("its travel is"), "{message}");
    assert_eq!(json["version"], 1);
    // Warnings alone do not make the check fail.
    let fine = folder.file("fine.nc", "G21 (mm\n");
    assert_eq!(leadscrew(&["check", &fine]).status.code(), Some(0));
}

#[test]
fn check_says_what_becomes_of_a_setting_in_motion() {
    let folder = Folder::new();
    let moves: String = (1..40).map(|x| format!("G1X{x}F500\n")).collect();
    let job = folder.file("job.nc", moves + "$110=600\n");
    let run = stderr(&leadscrew(&["run", &job]));
    assert!(run.contains("job.nc:40:1: error:8"), "{run}");
    let check = stderr(&leadscrew(&["check", &job]));
    assert!(
        check.contains("In motion the machine refuses it: error:8"),
        "{check}"
    );
}

#[test]
fn annotations_are_those_of_a_workflow() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G0X1\nG77\nG21 (mm\n");
    let done = leadscrew(&["check", "--github", &job]);
    let text = stdout(&done);
    let lines: Vec<&str> = text.lines().collect();
    let begin = format!("::error file={job},line=2,col=1,title=error%3A20%3A ");
    assert!(lines[0].starts_with(&begin), "{text}");
    assert!(
        lines[1].starts_with(&format!("::warning file={job},line=3,col=5,title=")),
        "{text}"
    );
}

#[test]
fn the_report_tells_extents_and_lengths() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G0X5\nG1X10Y-2F600\nG2X12Y0I2\nG0Z3\n");
    for command in ["run", "check"] {
        let done = leadscrew(&[command, "--json", &job]);
        let json: Value = serde_json::from_str(&stdout(&done)).unwrap();
        let near = |value: &Value, expected: f64| {
            let value = value.as_f64().unwrap();
            assert!(
                (value - expected).abs() < 0.01,
                "{command}: {value} is not {expected}"
            );
        };
        let extents = &json["extents"];
        near(&extents["x"]["min"], 5.0);
        near(&extents["x"]["max"], 12.0);
        near(&extents["y"]["min"], -2.0);
        near(&extents["y"]["max"], 0.0);
        near(&extents["z"]["max"], 0.0);
        near(&json["cut_mm"], 29f64.sqrt() + std::f64::consts::PI);
        near(&json["travel_mm"], 8.0);
    }
}

/// A laser is dark in a canned cycle, as in G0, and a probe cuts nothing.
#[test]
fn drilling_with_a_laser_and_probing_are_travel() {
    let folder = Folder::new();
    let job = "M3S500\nG1X5F600\nG81X10Z-2R1\nG80\nG38.3Z-4F300\nG0Z0\n";
    let job = folder.file("job.nc", job);
    for command in ["run", "check"] {
        let done = leadscrew(&[command, "--json", "--set", "$32=1", &job]);
        let json: Value = serde_json::from_str(&stdout(&done)).unwrap();
        assert_eq!(json["cut_mm"], 5.0, "{command}: {json}");
        assert_eq!(json["extents"]["z"]["min"], 0.0, "{command}: {json}");
        // Up to R, over to the hole, down and up; down to Z-4 and up to Z0.
        let travel = 1.0 + 5.0 + 3.0 + 3.0 + 5.0 + 4.0;
        assert_eq!(json["travel_mm"], travel, "{command}: {json}");
        let mill = leadscrew(&[command, "--json", &job]);
        let json: Value = serde_json::from_str(&stdout(&mill)).unwrap();
        assert_eq!(json["cut_mm"], 5.0 + 3.0, "{command}: {json}");
    }
}

#[test]
fn the_times_of_lines_add_up_to_that_of_the_motion() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "F600\nG1X10\nG1X12\n(rest)\nG1X2\n");
    let args = ["profile", "--json", "--no-trials", "--line-times", &job];
    let json: Value = serde_json::from_str(&stdout(&leadscrew(&args))).unwrap();
    let times = json["line_times"].as_array().unwrap().iter();
    let times: Vec<(u64, f64)> = times
        .map(|time| {
            (
                time["line"].as_u64().unwrap(),
                time["seconds"].as_f64().unwrap(),
            )
        })
        .collect();
    let lines: Vec<u64> = times.iter().map(|(line, _)| *line).collect();
    assert_eq!(lines, [2, 3, 5]);
    let whole: f64 = times.iter().map(|(_, seconds)| seconds).sum();
    let job = json["job_seconds"].as_f64().unwrap();
    assert!(
        whole > 2.2 && whole <= job && job - whole < 0.1,
        "{whole} of {job}"
    );
}

#[test]
fn shells_and_manuals_know_every_command() {
    let commands = ["run", "profile", "check", "serve", "replay"];
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let text = stdout(&leadscrew(&["completions", shell]));
        for command in commands {
            assert!(text.contains(command), "{shell}: {command}");
        }
        assert!(text.contains("keep-going"), "{shell}");
    }
    let page = stdout(&leadscrew(&["man"]));
    assert!(page.contains(".TH leadscrew 1"), "{page}");
    let folder = Folder::new();
    let at = folder.path("").to_str().unwrap().to_owned();
    assert_eq!(leadscrew(&["man", "--folder", &at]).status.code(), Some(0));
    for command in commands {
        let page = fs::read_to_string(folder.path(&format!("leadscrew-{command}.1"))).unwrap();
        assert!(page.contains("\\-\\-"), "{command}");
    }
    let none = folder.file("file", "") + "/none";
    assert_eq!(
        leadscrew(&["man", "--folder", &none]).status.code(),
        Some(2)
    );
}

#[test]
fn replay_judges() {
    let folder = Folder::new();
    let case = |recv: &str| format!(r#"{{"exchanges":[{{"op":"cmd $I","recv":["{recv}"]}}]}}"#);
    let wrong = folder.file("wrong.json", case("error:9"));
    let answered = stdout(&leadscrew(&["replay", &wrong]));
    let right = folder.file("right.json", answered);
    let judged = leadscrew(&["replay", "--judge", &right]);
    assert_eq!(judged.status.code(), Some(0), "{}", stdout(&judged));
    assert!(stdout(&judged).contains("right.json: agrees"));
    let both = leadscrew(&["replay", "--judge", folder.path("").to_str().unwrap()]);
    assert_eq!(both.status.code(), Some(1));
    let text = stdout(&both);
    assert!(
        text.contains("wrong.json: differs: exchange 0, `cmd $I`: expected"),
        "{text}"
    );
    assert!(text.contains("1 of 2 conversations agree"), "{text}");
    let none = folder.file("a.json", "[");
    let all = leadscrew(&["replay", "--judge", &none, &right, "no.json"]);
    assert_eq!(all.status.code(), Some(2));
    assert!(stdout(&all).contains("right.json: agrees"));
    assert!(stdout(&all).contains("1 of 1 conversations agree"));
    let said = stderr(&all);
    let named = said.contains("a.json: not a conv") && said.contains("no.json: cannot be read");
    assert!(named, "{said}");
    let piped = Stdio::from(fs::File::open(&right).unwrap());
    let piped = output(start(&["replay", "--judge", "-"], piped));
    assert_eq!(piped.status.code(), Some(0), "{}", stderr(&piped));
    assert_eq!(stdout(&piped), "standard input: agrees\n");
}
