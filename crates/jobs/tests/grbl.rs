//! The time of Grbl, against 26 motion programs that were recorded with Grbl 1.1h
//! (`tests/conformance/traces`): each has its settings, and the time from its first step to its
//! last.

use leadscrew_jobs::{settings_file, time, Machine};
use leadscrew_sim::link::Rate;
use leadscrew_sim::profile::Profile;
use serde_json::Value;
use std::fs;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

/// The most that a time may differ from Grbl's, and their median.
const MOST: f64 = 0.015;
const MEDIAN: f64 = 0.003;

fn programs() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/conformance/traces");
    let all = fs::read_dir(folder)
        .unwrap()
        .map(|file| file.unwrap().path());
    let mut programs: Vec<PathBuf> = all
        .filter(|path| path.extension().is_some_and(|end| end == "nc"))
        .collect();
    programs.sort();
    programs
}

/// Returns how much longer a program takes here than it took Grbl, as shares of Grbl's time: from
/// the first step to the last one; and half-way between that and the time from start to rest. Grbl
/// makes pieces of 10 ms at constant speed, so its first step comes sooner after the start than
/// ours, and its last one longer before the rest.
fn difference(program: &Path) -> [f64; 2] {
    let recording = fs::read_to_string(program.with_extension("json")).unwrap();
    let grbl: Value = serde_json::from_str(&recording).unwrap();
    let settings = grbl["settings"].as_object().unwrap();
    let lines: Vec<_> = settings
        .iter()
        .map(|(name, value)| settings_file::option(&format!("{name}={value}")).unwrap())
        .collect();
    let machine = Machine::new(Profile::default(), &lines).unwrap().as_grbl();
    let rate = Rate::Baud(NonZeroU32::new(115_200).unwrap());
    let text = fs::read(program).unwrap();
    let here = time(&machine, rate, "job.nc", &text[..]).unwrap();
    let grbl = grbl["first_to_last_step_s"].as_f64().unwrap();
    let middle = 0.5 * (here.step_seconds + here.motion_seconds);
    [here.step_seconds, middle].map(|seconds| seconds / grbl - 1.0)
}

#[test]
fn the_time_of_grbl_is_grbls() {
    let all = programs();
    assert!(all.len() >= 26);
    let mut middles = Vec::new();
    for program in &all {
        let [steps, middle] = difference(program);
        let (of, percent) = (program.display(), 100.0 * steps);
        assert!(steps.abs() <= MOST, "{of}: {percent:+.3} %");
        middles.push(middle.abs());
    }
    middles.sort_by(f64::total_cmp);
    let median = middles[middles.len() / 2];
    assert!(median <= MEDIAN, "{median}");
}
