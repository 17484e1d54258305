//! Tests of `leadscrew profile`: it prints the same times as `run`, to the tick, and names the limits
//! that really bind.

use proptest::prelude::*;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs `leadscrew`, which must succeed; returns its output.
fn leadscrew(args: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_leadscrew"))
        .args(args)
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// A job in a folder of its own.
struct Job {
    folder: tempfile::TempDir,
    options: Vec<String>,
}

impl Job {
    fn new(program: &str, options: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("job.nc"), program).unwrap();
        let options = options.iter().map(|option| (*option).to_owned()).collect();
        Self { folder, options }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    fn leadscrew(&self, command: &str, more: &[&str]) -> String {
        let file = self.path("job.nc");
        let options = self.options.iter().map(String::as_str);
        let args: Vec<&str> = [command, &file].into_iter().chain(options).collect();
        leadscrew(&[&args, more].concat())
    }

    /// The rows of the CSV, without its header.
    fn rows(&self) -> Vec<Row> {
        let csv = self.path("job.csv");
        self.leadscrew("profile", &["--no-trials", "--csv", &csv]);
        let text = fs::read_to_string(csv).unwrap();
        text.lines().skip(1).map(Row::new).collect()
    }

    /// The limits that bind, in order; each ramp with the slow place that it leads to or from.
    fn limits(&self) -> Vec<String> {
        let rows = self.rows();
        let mut limits: Vec<String> = rows.iter().map(Row::limit).collect();
        limits.dedup();
        limits
    }

    /// A number of the JSON report of `run`.
    fn seconds(&self) -> f64 {
        let json: serde_json::Value =
            serde_json::from_str(&self.leadscrew("run", &["--json"])).unwrap();
        json["job_seconds"].as_f64().unwrap()
    }
}

struct Row(Vec<String>);

impl Row {
    fn new(text: &str) -> Self {
        Self(text.split(',').map(str::to_owned).collect())
    }

    fn number(&self, column: usize) -> f64 {
        self.0[column].parse().unwrap()
    }

    fn limit(&self) -> String {
        let because = &self.0[11];
        let separator = if because.is_empty() { "" } else { ", " };
        format!("{}{separator}{because}", self.0[10])
    }
}

/// Accelerations so high that the look-ahead does not limit the speed.
const QUICK: [&str; 4] = ["--set", "$120=100", "--set", "$121=100"];

#[test]
fn a_small_job_has_the_list_that_was_agreed_on() {
    let program =
        "G21 G90\nG0 X5\nG1 Y4 F300\nG2 X9 Y4 I2 F400\nG4 P0.5\nM3 S500\nG1 X0 F200\nM30\n";
    let job = Job::new(program, &[&QUICK[..], &["--set", "$32=1"]].concat());
    let csv = job.path("job.csv");
    job.leadscrew("profile", &["--no-trials", "--csv", &csv]);
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/profile.csv");
    let found = fs::read_to_string(csv).unwrap();
    if std::env::var_os("BLESS").is_some() {
        fs::write(&golden, &found).unwrap();
    }
    assert_eq!(found, fs::read_to_string(golden).unwrap());
}

#[test]
fn feed_and_rate_bind_where_they_are_reached() {
    let feed = Job::new("G1 X10 F300\n", &QUICK).limits();
    let stop = "acceleration X, stop";
    assert_eq!(feed, ["rest", stop, "feed", stop]);
    let rate = Job::new("G1 X10 F3000\n", &QUICK).limits();
    assert_eq!(rate, ["rest", stop, "rate X", stop]);
    let rapid = Job::new("G0 X10\n", &QUICK).limits();
    assert_eq!(rapid, rate);
}

#[test]
fn the_step_rate_of_the_board_binds_where_it_is_below_the_axis_s_rate() {
    // With pulses of 20 µs the board makes up to 47 619 steps/s, which are 19 mm/s.
    let steep = ["--set", "$0=20", "--set", "$100=2500", "--set", "$110=3000"];
    let limits = Job::new("G0 X20\n", &[&QUICK[..], &steep].concat()).limits();
    let stop = "acceleration X, stop";
    assert_eq!(limits, ["rest", stop, "step rate", stop]);
}

#[test]
fn a_circle_of_short_lines_is_slow_by_its_curvature() {
    let point = |k: u32| (f64::from(k) * 0.02).sin_cos();
    let program: String = (1..=300)
        .map(point)
        .map(|(sin, cos)| format!("G1 X{:.3} Y{:.3} F4000\n", 5.0 * sin, 5.0 * (1.0 - cos)))
        .collect();
    let options = [&QUICK[..], &["--set", "$110=5000", "--set", "$111=5000"]].concat();
    let limits = Job::new(&program, &options).limits();
    assert!(limits.contains(&"curve".to_owned()), "{limits:?}");
}

#[test]
fn a_corner_costs_the_ramps_to_and_from_it() {
    let limits = Job::new("G1 X10 F300\nY10\n", &QUICK).limits();
    let [x, y] = ["X", "Y"].map(|axis| format!("acceleration {axis}, "));
    let expected = [
        "rest",
        &format!("{x}stop"),
        "feed",
        &format!("{x}corner"),
        &format!("{y}corner"),
        "feed",
        &format!("{y}stop"),
    ];
    assert_eq!(limits, expected);
}

#[test]
fn an_arc_is_slow_by_its_curvature_and_so_are_the_ramps_to_it() {
    let options = [&QUICK[..], &["--set", "$110=5000", "--set", "$111=5000"]].concat();
    let limits = Job::new("G1 X40 F4000\nG3 X40 Y10 J5\nG1 X0\n", &options).limits();
    let slower = "acceleration X, slower move: arc";
    assert!(limits.contains(&"arc".to_owned()), "{limits:?}");
    assert!(limits.contains(&slower.to_owned()), "{limits:?}");
}

#[test]
fn a_slower_move_is_braked_for_and_left_again() {
    let limits = Job::new("G1 X10 F400\nX20 F100\nX30 F400\n", &QUICK).limits();
    let [stop, slower] = ["stop", "slower move: feed"].map(|at| format!("acceleration X, {at}"));
    let expected = [
        "rest", &stop, "feed", &slower, "feed", &slower, "feed", &stop,
    ];
    assert_eq!(limits, expected);
}

#[test]
fn a_path_that_is_longer_than_the_look_ahead_is_slowed_down_by_it() {
    let point = |k: u32| (f64::from(k) * 0.5 / 2000.0).sin_cos();
    let program: String = (1..3000)
        .map(point)
        .map(|(sin, cos)| {
            format!(
                "G1 X{:.3} Y{:.3} F12000\n",
                2000.0 * sin,
                2000.0 * (1.0 - cos)
            )
        })
        .collect();
    let fine = ["--set", "$0=1", "--set", "$100=1000", "--set", "$101=1000"];
    let fast = ["--set", "$110=12000", "--set", "$111=12000"];
    let limits = Job::new(&program, &[&fine[..], &fast[..]].concat()).limits();
    let found = limits.iter().any(|limit| limit.contains("look-ahead"));
    assert!(found, "{limits:?}");
}

#[test]
fn lines_that_come_too_late_are_named() {
    let program: String = (1..60)
        .map(|k| format!("G1 X{:.3} F500\n", f64::from(k) * 0.3))
        .collect();
    let options = [&QUICK[..], &["--baud", "1200"]].concat();
    let limits = Job::new(&program, &options).limits();
    let found = limits.iter().any(|limit| limit.contains("no line"));
    assert!(found, "{limits:?}");
    let soon = Job::new(&program, &QUICK).limits();
    assert!(
        !soon.iter().any(|limit| limit.contains("no line")),
        "{soon:?}"
    );
}

#[test]
fn the_changes_that_are_named_save_what_they_say() {
    let program = "G1 X10 F1000\nY10\nX0\nY0\n";
    let job = Job::new(program, &QUICK);
    let json: serde_json::Value =
        serde_json::from_str(&job.leadscrew("profile", &["--json"])).unwrap();
    let trial = json["trials"]
        .as_array()
        .unwrap()
        .iter()
        .find(|trial| trial["change"] == "$111=1000 (now 500)")
        .unwrap();
    let saved = trial["seconds_saved"].as_f64().unwrap();
    let changed = Job::new(program, &[&QUICK[..], &["--set", "$111=1000"]].concat());
    assert!((job.seconds() - changed.seconds() - saved).abs() < 1e-8);
    assert!(saved > 0.5);
}

#[test]
fn the_picture_is_a_picture_and_what_cannot_be_written_is_said() {
    let job = Job::new("G1 X10 F300\n", &[]);
    let svg = job.path("job.svg");
    job.leadscrew("profile", &["--no-trials", "--svg", &svg]);
    assert!(fs::read_to_string(&svg)
        .unwrap()
        .contains("programmed feed"));
    let bad = job.path("no/such/folder.csv");
    let output = Command::new(env!("CARGO_BIN_EXE_leadscrew"))
        .args(["profile", &job.path("job.nc"), "--csv", &bad])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        message.contains("folder.csv: cannot be written"),
        "{message}"
    );
}

fn line() -> impl Strategy<Value = String> {
    let axis = -20.0f64..20.0;
    prop_oneof![
        6 => (0u8..2, axis.clone(), axis.clone(), 50u32..1500)
            .prop_map(|(g, x, y, f)| format!("G{g} X{x:.3} Y{y:.3} F{f}")),
        2 => (-3.0f64..3.0).prop_map(|z| format!("G1 Z{z:.2}")),
        1 => (1.0f64..9.0, 0.2f64..4.0).prop_map(|(f, i)| format!("G91 G2 X{:.3} I{i:.3} F{}00\nG90", 2.0 * i, f as u32)),
        1 => (0u32..300).prop_map(|ms| format!("G4 P{:.3}", f64::from(ms) / 1000.0)),
        1 => (0u32..1000).prop_map(|s| format!("M3 S{s}")),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases / 10))]

    /// Nine decimals are finer than a CPU cycle, and a tick of the step timer has two cycles.
    #[test]
    fn the_stretches_add_up_to_the_time_of_the_run_to_the_tick(
        lines in prop::collection::vec(line(), 1..40), laser in 0u8..2, baud in prop::option::of(9600u32..200_000),
    ) {
        let laser = format!("$32={laser}");
        let baud = baud.map(|baud| baud.to_string());
        let mut options = vec!["--set", "$120=200", "--set", &laser];
        options.extend(baud.iter().flat_map(|baud| ["--baud", baud]));
        let job = Job::new(&format!("F500\n{}\n", lines.join("\n")), &options);
        let rows = job.rows();
        for pair in rows.windows(2) {
            prop_assert_eq!(&pair[0].0[2], &pair[1].0[1]);
        }
        prop_assert_eq!(&rows[0].0[1], "0.000000000");
        prop_assert_eq!(&rows.last().unwrap().0[2], &format!("{:.9}", job.seconds()));
        for row in &rows {
            prop_assert!(row.number(2) > row.number(1));
        }
    }
}

/// Compares the motion's time on a line that never waits with the times over serial lines of two
/// speeds. They are equal to the tick, because the queue never runs low. (Each move takes longer
/// than sending its line.)
#[test]
fn the_desk_s_time_is_that_of_the_streamed_job_to_the_tick() {
    let program: String = (0..300)
        .map(|k| f64::from(k) * 0.7)
        .map(|angle| {
            format!(
                "G1 X{:.3} Y{:.3} F{}\n",
                9.0 * angle.sin(),
                7.0 * (angle * 0.3).cos(),
                300.0 + 50.0 * angle.floor() % 900.0
            )
        })
        .collect();
    let motion = |more: &[&str]| {
        let job = Job::new(&program, &[&QUICK[..], more].concat());
        let json: serde_json::Value =
            serde_json::from_str(&job.leadscrew("run", &["--json"])).unwrap();
        (json["motion_seconds"].as_f64().unwrap() * 84e6).round()
    };
    let estimate = motion(&[]);
    assert!(estimate > 60.0 * 84e6, "{estimate} ticks");
    for baud in ["57600", "115200"] {
        assert_eq!(motion(&["--baud", baud]), estimate, "{baud} baud");
    }
}
