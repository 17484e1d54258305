//! The jobs of `examples/`: each runs without a complaint with its settings, in the time that it
//! took when it was committed.

use leadscrew_tests::run_program;
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

/// Job time of each example in s, from the first byte to rest.
const SECONDS: [(&str, f64); 10] = [
    ("drill_dip14.nc", 60.55),
    ("drill_holes.nc", 144.06),
    ("heart.nc", 83.7),
    ("heart_as_printed.nc", 41.64),
    ("laser_delay.nc", 71.58),
    ("pocket.nc", 99.84),
    ("print_square.nc", 55.03),
    ("print_testbar.nc", 16.01),
    ("raster.nc", 27.99),
    ("spiral.nc", 37.75),
];

/// The most by which a job time may be off: 1 %.
const TOLERANCE: f64 = 0.01;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../examples")
}

/// Job and settings file of each row of the table in `examples/README.md`: ``| `job.nc` | … |
/// `settings.txt` | … |``.
fn table() -> BTreeMap<String, String> {
    let readme = fs::read_to_string(folder().join("README.md")).unwrap();
    let rows = readme.lines().filter_map(|line| {
        let mut cells = line.strip_prefix("| `")?.split(" | ");
        let job = cells.next()?.trim_end_matches('`');
        let settings = cells.nth(1)?.trim_matches('`');
        job.ends_with(".nc")
            .then(|| (job.to_owned(), settings.to_owned()))
    });
    rows.collect()
}

/// Runs a job with its settings. Returns the fault of the run, if it has one.
fn complaint(job: &str, settings: &str, seconds: f64) -> Option<String> {
    let read = |path: PathBuf| fs::read_to_string(path).unwrap();
    let settings = read(folder().join("settings").join(settings));
    let took = run_program(&settings, &read(folder().join(job)))
        .outcome
        .job_seconds;
    let off = (took / seconds - 1.0).abs() > TOLERANCE;
    off.then(|| format!("{job}: {took:.3} s, not {seconds}"))
}

#[test]
fn every_job_is_in_the_table_and_has_its_time() {
    let mut files: Vec<String> = fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".nc"))
        .collect();
    files.sort();
    assert_eq!(table().into_keys().collect::<Vec<_>>(), files);
    assert_eq!(SECONDS.map(|(job, _)| job).to_vec(), files);
}

#[test]
fn every_job_runs_clean_in_its_time() {
    let table = table();
    let complaints: Vec<String> = std::thread::scope(|scope| {
        let jobs = SECONDS.map(|(job, seconds)| {
            let settings = &table[job];
            scope.spawn(move || complaint(job, settings, seconds))
        });
        jobs.into_iter()
            .filter_map(|job| job.join().expect("a job does not run clean"))
            .collect()
    });
    assert!(complaints.is_empty(), "\n{}", complaints.join("\n"));
}
