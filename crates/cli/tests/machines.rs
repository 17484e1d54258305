//! The five machines that the project started from: runs every command of their READMEs in their
//! folders.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const PROGRAM: &str = env!("CARGO_BIN_EXE_leadscrew");

/// A copy of the examples, into which commands may write.
struct Examples(tempfile::TempDir);

impl Examples {
    fn new() -> Self {
        let copy = tempfile::tempdir().unwrap();
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
        for folder in [
            "sources",
            "machines/000",
            "machines/001",
            "machines/002",
            "machines/003",
            "machines/004",
        ] {
            let to = copy.path().join(folder);
            fs::create_dir_all(&to).unwrap();
            for entry in fs::read_dir(from.join(folder)).unwrap() {
                let file = entry.unwrap().path();
                fs::copy(&file, to.join(file.file_name().unwrap())).unwrap();
            }
        }
        Self(copy)
    }

    fn machine(&self, number: &str) -> PathBuf {
        self.0.path().join("machines").join(number)
    }
}

/// The commands of a README.
fn commands(folder: &Path) -> Vec<Vec<String>> {
    let page = fs::read_to_string(folder.join("README.md")).unwrap();
    let blocks = page
        .split("```sh\n")
        .skip(1)
        .map(|rest| rest.split("```").next().unwrap());
    blocks.flat_map(str::lines).map(words).collect()
}

/// The words of a command; a text in quotes is one word.
fn words(line: &str) -> Vec<String> {
    let parts = line.split('\'').enumerate();
    let words = parts.flat_map(|(index, part)| match index % 2 {
        0 => part.split_whitespace().collect(),
        _ => vec![part],
    });
    words.map(str::to_owned).collect()
}

/// Runs a command; returns its output.
fn run(folder: &Path, args: &[String]) -> String {
    let output = Command::new(PROGRAM)
        .args(args)
        .current_dir(folder)
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{args:?}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// Runs a command that ends with an alarm; returns the alarm's message.
fn fail(folder: &Path, args: &[String]) -> String {
    let output = Command::new(PROGRAM)
        .args(args)
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(!output.status.success(), "{args:?}");
    String::from_utf8(output.stderr).unwrap()
}

/// Starts a server on a free port, and ends it when it is ready.
fn serve(folder: &Path, args: &[String]) {
    let free = args.iter().map(|arg| if arg == "2323" { "0" } else { arg });
    let mut server = Command::new(PROGRAM)
        .args(free)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let said = BufReader::new(server.stdout.take().unwrap());
    let ready = said
        .lines()
        .map_while(Result::ok)
        .find(|line| line.contains("ready at"));
    let ended = Command::new("kill")
        .args(["-INT", &server.id().to_string()])
        .status();
    assert!(ready.is_some(), "{args:?}");
    assert!(ended.unwrap().success() && server.wait().unwrap().success());
}

/// Runs every command of a machine's README in order; returns the output of each.
fn follow(number: &str, least: usize) -> (Examples, Vec<String>) {
    let examples = Examples::new();
    let folder = examples.machine(number);
    let commands = commands(&folder);
    assert!(commands.len() >= least, "{commands:?}");
    let mut said = Vec::new();
    for command in commands {
        assert_eq!(command[0], "leadscrew", "{command:?}");
        if command[1] == "serve" {
            serve(&folder, &command[1..]);
        } else if command.iter().any(|word| word == "--heat-fault") {
            said.push(fail(&folder, &command[1..]));
        } else {
            said.push(run(&folder, &command[1..]));
        }
    }
    (examples, said)
}

/// The report of running a job on a machine.
fn report(examples: &Examples, number: &str, job: &str) -> serde_json::Value {
    let args = ["run", job, "--machine", "machine.toml", "--json"].map(str::to_owned);
    serde_json::from_str(&run(&examples.machine(number), &args)).unwrap()
}

fn place(report: &serde_json::Value, axis: &str) -> f64 {
    report["axes"][axis]["position_mm"].as_f64().unwrap()
}

#[test]
fn machine_000_cuts_its_square_and_goes_back_to_its_zero() {
    let (examples, said) = follow("000", 6);
    assert_eq!(said[0].trim(), "$100=80.241");
    let square = report(&examples, "000", "square.nc");
    assert_eq!((place(&square, "x"), place(&square, "y")), (0.0, 0.0));
    assert!((square["cut_mm"].as_f64().unwrap() - 200.0).abs() < 1e-6);
}

#[test]
fn machine_001_makes_its_bar_and_its_square() {
    let (examples, said) = follow("001", 7);
    let named = "ALARM:220: Temperature sensor is open";
    assert!(said.iter().any(|text| text.contains(named)), "{said:?}");
    assert!(said.last().unwrap().contains("PB5   heater 0"), "{said:?}");
    let bar = report(&examples, "001", "bar.nc");
    let length = &bar["extents"]["x"];
    let width = length["max"].as_f64().unwrap() - length["min"].as_f64().unwrap();
    assert!((width - 50.0).abs() < 0.01, "{width}");
    // The bed alone takes more than two minutes: it warms with 1.5 K/s and a time constant of 300
    // s.
    let seconds = bar["job_seconds"].as_f64().unwrap() - bar["motion_seconds"].as_f64().unwrap();
    assert!((120.0..240.0).contains(&seconds), "{seconds}");
}

#[test]
fn machine_001_does_not_feed_while_it_is_cold() {
    let examples = Examples::new();
    let folder = examples.machine("001");
    fs::write(folder.join("cold.nc"), "M62 P0\nG1 X1 F600\n").unwrap();
    let args = ["run", "cold.nc", "--machine", "machine.toml"].map(str::to_owned);
    let said = fail(&folder, &args);
    assert!(said.contains("error:220: Too cold to extrude"), "{said}");
}

#[test]
fn machine_002_drills_a_hole_in_four_seconds() {
    let (examples, _) = follow("002", 11);
    let board = report(&examples, "002", "board.nc");
    assert_eq!(
        board["pauses"].as_array().map(Vec::len),
        board["tools"].as_array().map(Vec::len)
    );
    let holes = report(&examples, "002", "holes.nc");
    assert!(holes["job_seconds"].as_f64().unwrap() <= 28.0 * 4.0);
    let dip14 = fs::read_to_string(examples.machine("002").join("dip14.nc")).unwrap();
    assert_eq!(dip14.matches("G81").count(), 1);
    let numbered = dip14.lines().filter(|line| line.starts_with('N'));
    assert_eq!(numbered.count(), 14);
}

#[test]
fn machine_003_engraves_a_heart_that_closes() {
    let (examples, _) = follow("003", 6);
    let heart = report(&examples, "003", "heart.nc");
    assert_eq!((place(&heart, "x"), place(&heart, "y")), (0.0, 0.0));
    let z = place(&heart, "z");
    assert!((3.0..3.3).contains(&z), "the tool is up: {z}");
    let job = fs::read_to_string(examples.machine("003").join("heart.nc")).unwrap();
    assert!(!job.contains('Z') && job.contains("\nM3\n"), "{job}");
    let printed = report(&examples, "003", "printed.nc");
    assert_eq!((place(&printed, "x"), place(&printed, "y")), (-4.0, 4.0));
}

#[test]
fn machine_004_moves_four_axes_and_ramps_as_its_document_computes() {
    let (examples, _) = follow("004", 10);
    let four = report(&examples, "004", "four.nc");
    assert_eq!((place(&four, "e"), place(&four, "z")), (6.0, 5.0));
    // The speed rises to 100 mm/s in 0.1 s, stays for 0.1 s, and falls in 0.1 s. The time before
    // the first step does not count.
    let ramp = report(&examples, "004", "ramp.nc");
    assert!((ramp["motion_seconds"].as_f64().unwrap() - 0.3).abs() < 0.006);
    // 20 mm are 1600 steps, half a turn; 100 mm/s are 150 turns a minute.
    let x = &ramp["axes"]["x"];
    assert_eq!(
        (x["net_steps"].as_i64(), x["position_rev"].as_f64()),
        (Some(1600), Some(0.5))
    );
    assert!(
        (x["peak_rev_min"].as_f64().unwrap() - 150.0).abs() < 0.1,
        "{x}"
    );
}

/// The lengths by which E moves in a printer's file with M82, mm, one for each line that moves it.
fn ways_of_e(file: &str) -> Vec<f64> {
    let (mut at, mut ways) = (0.0, Vec::new());
    for line in file.lines() {
        let code = line.split(';').next().unwrap();
        let word = code
            .split_whitespace()
            .find_map(|word| word.strip_prefix('E'));
        let Some(place) = word.map(|number| number.parse::<f64>().unwrap()) else {
            continue;
        };
        if !code.starts_with("G92") {
            ways.push(place - at);
        }
        at = place;
    }
    ways
}

#[test]
fn machine_004_prints_a_slicers_file_to_the_step() {
    let (examples, _) = follow("004", 10);
    let folder = examples.machine("004");
    let ways = ways_of_e(&fs::read_to_string(folder.join("part.gcode")).unwrap());
    assert_eq!(ways.iter().filter(|way| **way < 0.0).count(), 3, "{ways:?}");
    let csv = fs::read_to_string(folder.join("part.csv")).unwrap();
    let (mut forward, mut back) = (0, 0);
    for row in csv.lines().skip(1) {
        let mut cells = row
            .split(',')
            .skip(1)
            .map(|cell| cell.parse::<u8>().unwrap_or(0));
        let (step, negative) = (cells.next().unwrap(), cells.next().unwrap());
        if step & 0b1000 != 0 {
            *(if negative & 0b1000 != 0 {
                &mut back
            } else {
                &mut forward
            }) += 1;
        }
    }
    let steps = |forward: bool| -> f64 {
        let ways = ways.iter().filter(|way| (**way > 0.0) == forward);
        ways.map(|way| way.abs() * 95.0).sum()
    };
    // Each place is rounded to a step, which gives an error of up to half a step when E turns
    // back.
    assert!((f64::from(forward) - steps(true)).abs() <= 3.0, "{forward}");
    assert!((f64::from(back) - steps(false)).abs() <= 3.0, "{back}");
    let part = report(&examples, "004", "part.nc");
    let net = part["axes"]["e"]["net_steps"].as_i64().unwrap();
    assert_eq!(net, (ways.iter().sum::<f64>() * 95.0).round() as i64);
    // The file's zero is at the end stops, X- and Y-, which were 20 mm from the carriage at
    // power-up.
    assert!((place(&part, "x") - 0.0).abs() < 0.013, "{part}");
}

/// The times at which each motor steps, s, from a step list.
fn edges(examples: &Examples, list: &str) -> [Vec<f64>; 4] {
    const CPU_HZ: f64 = 168e6;
    let csv = fs::read_to_string(examples.machine("004").join(list)).unwrap();
    let mut edges: [Vec<f64>; 4] = std::array::from_fn(|_| Vec::new());
    for row in csv.lines().skip(1) {
        let mut cells = row.split(',');
        let cycle: f64 = cells.next().unwrap().parse().unwrap();
        let motors: u8 = cells.next().unwrap().parse().unwrap();
        for (motor, edges) in edges.iter_mut().enumerate() {
            if motors >> motor & 1 == 1 {
                edges.push(cycle / CPU_HZ);
            }
        }
    }
    edges
}

/// The time at which a motion from rest to rest over a way of length 1 is at `place`. Its speed is
/// at most `speed`; it speeds up and slows down with `acceleration`.
fn exact(place: f64, speed: f64, acceleration: f64) -> f64 {
    let ramp = speed * speed / 2.0 / acceleration;
    let whole = 2.0 * speed / acceleration + (1.0 - 2.0 * ramp) / speed;
    if place < ramp {
        (2.0 * place / acceleration).sqrt()
    } else if place > 1.0 - ramp {
        whole - (2.0 * (1.0 - place).max(0.0) / acceleration).sqrt()
    } else {
        speed / acceleration + (place - ramp) / speed
    }
}

/// The standard deviation of times about their mean, and the largest distance from 0.
fn spread(times: &[f64]) -> [f64; 2] {
    let count = times.len() as f64;
    let mean = times.iter().sum::<f64>() / count;
    let squares = times.iter().map(|time| (time - mean).powi(2));
    let farthest = times
        .iter()
        .fold(0.0, |most: f64, time| most.max(time.abs()));
    [(squares.sum::<f64>() / count).sqrt(), farthest]
}

/// The edges by the recurrence of the machine's document, s: 1600 steps, 80 000 steps/s², 8000
/// steps/s.
fn recurrence() -> Vec<f64> {
    let (a, first, fastest): (f64, f64, f64) = (80_000e-12, 2500.0, 125.0);
    let (mut now, mut period): (f64, f64) = (0.0, first);
    let steps = (1..=1600).map(|step| {
        now += period;
        let change = a * period * period;
        period = match 1600 - step <= 400 {
            true => (period * (1.0 + change)).min(first),
            false => (period * (1.0 - change)).max(fastest),
        };
        now * 1e-6
    });
    steps.collect()
}

/// The time from the first edge to the last one, the number of edges up to the first interval at
/// the highest speed, and the last interval.
fn figures(edges: &[f64]) -> (f64, usize, f64) {
    let intervals: Vec<f64> = edges.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let fast = intervals.iter().position(|interval| *interval < 125.1e-6);
    let whole = edges[edges.len() - 1] - edges[0];
    (whole, fast.unwrap() + 1, intervals[intervals.len() - 1])
}

#[test]
fn machine_004_ramps_as_its_table_says_beside_the_recurrence() {
    let (examples, _) = follow("004", 10);
    let [x, ..] = edges(&examples, "ramp.csv");
    assert_eq!(x.len(), 1600);
    let exact: Vec<f64> = (1..=1600)
        .map(|step| exact(f64::from(step) / 1600.0, 5.0, 50.0))
        .collect();
    let beside = |edges: &[f64]| -> Vec<f64> {
        let pairs = edges.iter().zip(&exact);
        pairs.map(|(edge, exact)| edge - exact).collect()
    };
    let (whole, fast, last) = figures(&x);
    assert!((whole - 0.295).abs() < 1e-5, "{whole}");
    assert!((398..=402).contains(&fast), "{fast}");
    assert!((last - 5e-3).abs() < 1e-5, "{last}");
    let [deviation, _] = spread(&beside(&x));
    assert!(deviation < 0.15e-6, "{deviation}");
    let old = recurrence();
    assert!(
        (old[1599] - 0.285_178).abs() < 1e-6,
        "as the document's figures"
    );
    let (whole, fast, last) = figures(&old);
    assert!((whole - 0.2827).abs() < 5e-5, "{whole}");
    assert!((393..=395).contains(&fast), "{fast}");
    assert!((last - 1.34e-3).abs() < 1e-5, "{last}");
    let [deviation, _] = spread(&beside(&old));
    assert!((deviation - 482e-6).abs() < 1e-6, "{deviation}");
}

#[test]
fn machine_004_s_four_axes_keep_the_times_of_their_edges() {
    let (examples, _) = follow("004", 10);
    let edges = edges(&examples, "line.csv");
    // Speed and acceleration in lines a second: 25 mm/s on the 7 mm of E, 1000 mm/s² on the 20 mm
    // of X. The planner leaves 1/2¹⁹ of its limits unused.
    let margin = 1.0 - 1.0 / f64::from(1 << 19);
    let time = |place: f64| exact(place, 25.0 / 7.0 * margin, 50.0 * margin);
    let of_x = edges[0].iter().enumerate();
    let began = of_x.map(|(step, edge)| edge - time((step as f64 + 1.0) / 1600.0));
    let began = began.sum::<f64>() / 1600.0;
    // X makes a step when the step is complete; the other motors step when they are nearest to
    // the line.
    let bounds = [
        (1600, 1.0, 0.02, 0.05),
        (1040, 0.5, 6.5, 18.5),
        (400, 0.5, 0.7, 12.5),
        (665, 0.5, 6.5, 12.5),
    ];
    for (axis, (of_axis, (steps, part, deviation, most))) in edges.iter().zip(bounds).enumerate() {
        assert_eq!(of_axis.len(), steps);
        let places = of_axis.iter().enumerate();
        let beside: Vec<f64> = places
            .map(|(step, edge)| edge - began - time((step as f64 + part) / steps as f64))
            .collect();
        let [found, farthest] = spread(&beside).map(|time| time * 1e6);
        assert!(found < deviation, "axis {axis}: {found} us");
        assert!(farthest < most, "axis {axis}: {farthest} us");
    }
}
