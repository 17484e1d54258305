//! The time by planning alone is the time of a run, to the cycle: over the examples, the golden and
//! the recorded programs, and random ones.

use leadscrew_jobs::{settings_file, time, Machine, Stream};
use leadscrew_sim::link::Rate;
use leadscrew_sim::profile::Profile;
use proptest::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};

/// Rates and accelerations of a router, so that an example is over soon.
const QUICK: &[&str] = &[
    "$110=4000",
    "$111=3000",
    "$112=1500",
    "$120=400",
    "$121=300",
    "$122=200",
];

/// The machines, each as its name and its further settings.
const MACHINES: &[(&str, &[&str])] = &[
    ("a router", &[]),
    ("a laser", &["$32=1"]),
    ("a laser that is late", &["$32=1", "$703=700"]),
    ("a jerk limit", &["$705=3000"]),
    ("a resonance", &["$708=25"]),
    ("Grbl's corners", &["$704=1"]),
    ("fine steps", &["$100=800", "$101=640", "$102=1600", "$0=2"]),
    ("a short reserve", &["$710=0.01"]),
];

fn machine(further: &[&str]) -> Machine {
    let all = QUICK.iter().chain(further);
    let lines: Vec<_> = all
        .map(|text| settings_file::option(text).unwrap())
        .collect();
    Machine::new(Profile::default(), &lines).unwrap()
}

/// The seconds of a job with all its steps on pins: of motion, from the first step to the last, in
/// all.
fn run(machine: &Machine, text: &str) -> [f64; 3] {
    let stream = Stream {
        machine,
        rate: Rate::NeverWaits,
        keep_going: true,
        feed_percent: 100,
        keep_answers: false,
        warn: false,
        only_times: false,
        knows_place: false,
        tell: |_| {},
    };
    let outcome = stream.run("job.nc", text.as_bytes(), ()).unwrap().outcome;
    [
        outcome.motion_seconds,
        outcome.step_seconds,
        outcome.job_seconds,
    ]
}

/// The same by planning alone.
fn timed(machine: &Machine, text: &str) -> [f64; 3] {
    let time = time(machine, Rate::NeverWaits, "job.nc", text.as_bytes()).unwrap();
    [time.motion_seconds, time.step_seconds, time.job_seconds]
}

fn programs(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(folder);
    let all = fs::read_dir(folder)
        .unwrap()
        .map(|file| file.unwrap().path());
    let is_program = |path: &PathBuf| {
        path.extension()
            .is_some_and(|end| end == "nc" || end == "ngc")
    };
    let mut programs: Vec<_> = all.filter(is_program).collect();
    programs.sort();
    programs
}

#[test]
fn planning_alone_takes_as_long_as_a_run_of_every_program_on_every_machine() {
    let folders = [
        "examples",
        "examples/programs",
        "tests/golden",
        "tests/conformance/traces",
    ];
    let all: Vec<_> = folders.into_iter().flat_map(programs).collect();
    assert!(all.len() > 40, "{}", all.len());
    for (number, path) in all.iter().enumerate() {
        let text = fs::read_to_string(path).unwrap();
        // Each program on two machines, and each machine with many programs.
        for offset in [0, 3] {
            let (name, further) = MACHINES[(number + offset) % MACHINES.len()];
            let machine = machine(further);
            let of = (path.display(), name);
            assert_eq!(timed(&machine, &text), run(&machine, &text), "{of:?}");
        }
    }
}

/// A line of a program: a cut, an arc, a rapid, power, a dwell, a pause.
fn line() -> impl Strategy<Value = String> {
    let mm = || (-4000i32..4000).prop_map(|thousandths| f64::from(thousandths) / 1000.0);
    let near = || (-300i32..300).prop_map(|thousandths| f64::from(thousandths) / 1000.0);
    let feed = prop::sample::select(vec![30, 200, 900, 2500, 9000]);
    prop_oneof![
        4 => (mm(), mm(), feed).prop_map(|(x, y, f)| format!("G1X{x:.3}Y{y:.3}F{f}")),
        6 => (near(), near()).prop_map(|(x, y)| format!("G91G1X{x:.3}Y{y:.3}\nG90")),
        2 => (near(), near(), near())
            .prop_map(|(x, y, z)| format!("G91G1X{x:.3}Y{y:.3}Z{z:.3}\nG90")),
        2 => (1u32..9, 0u32..30)
            .prop_map(|(pixels, s)| {
                (0..pixels).map(|k| format!("G91G1X0.1S{}\n", s * (k + 1))).collect::<String>() + "G90"
            }),
        2 => (1i32..3000).prop_map(|r| {
            let r = f64::from(r) / 1000.0;
            format!("G91G2X{r:.3}Y{r:.3}I{r:.3}\nG90")
        }),
        1 => (mm(), mm()).prop_map(|(x, y)| format!("G0X{x:.3}Y{y:.3}")),
        1 => prop::sample::select(vec!["M3S500", "M4S300", "M5", "G4P0.02", "(a word)", "", "M8"])
            .prop_map(String::from),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases / 8))]

    #[test]
    fn planning_alone_takes_as_long_as_a_run_of_any_program(
        lines in prop::collection::vec(line(), 1..60),
        machine_of in 0..MACHINES.len(),
    ) {
        let text = format!("G21G90F1200\n{}\n", lines.join("\n"));
        let (name, further) = MACHINES[machine_of];
        let machine = machine(further);
        prop_assert_eq!(timed(&machine, &text), run(&machine, &text), "{}", name);
    }
}
