//! Times the check of a whole job without writing anything.
//!
//!     python3 bench/workloads/gen.py /tmp
//!     cargo run --profile fast -p leadscrew-jobs --example check_a_job -- /tmp/spiral.gcode

use leadscrew_jobs::{follow, read_through, Machine};
use leadscrew_sim::profile::Profile;
use std::error::Error;
use std::time::Instant;

/// The number of checks; the fastest one's time is printed.
const RUNS: usize = 9;

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("usage: check_a_job FILE")?;
    let text = std::fs::read(&file)?;
    let machine = Machine::new(Profile::default(), &[])?;
    let mut fastest = f64::INFINITY;
    let (mut lines, mut errors) = (0, 0);
    for _ in 0..RUNS {
        let start = Instant::now();
        let mut checker = follow(&file, &machine);
        let report = read_through(&mut *checker, &file, text.as_slice(), |_| {})?;
        fastest = fastest.min(start.elapsed().as_secs_f64());
        (lines, errors) = (report.lines, report.error_count);
    }
    let rate = lines as f64 / fastest / 1e6;
    println!("{lines} lines, {errors} errors, {rate:.2} million lines a second");
    Ok(())
}
