//! The board at each rate: a table of step events and lines a second, late ticks and the CPU's
//! load.
//!
//! The build limits no rate; three motors and power run, fed at 2 Mbaud. A row has the requested
//! rates and the result.
use super::timing::{ensure_no_gap, fastest, settings};
use crate::{
    bench::{Bench, Failure},
    firmware::Build,
    stream::Stream,
};
use std::fmt::Write;

/// Steps in a millimetre.
const STEPS_PER_MM: f64 = 250.0;
/// The time from rest to the rate, s: a quarter of the job is ramps.
const RAMP_SECONDS: f64 = 0.125;
/// The time for which the job goes at its rate, s.
const SECONDS: f64 = 1.0;

/// The requested rates: step events a second, lines a second.
const ROWS: [(f64, f64); 9] = [
    (100_000.0, 500.0),
    (200_000.0, 500.0),
    (300_000.0, 500.0),
    (370_000.0, 500.0),
    (430_000.0, 500.0),
    (500_000.0, 500.0),
    (200_000.0, 2_000.0),
    (200_000.0, 5_000.0),
    (200_000.0, 10_000.0),
];

/// A job of lines on all axes, straight ahead, with another power in every other line. The lines
/// are as short as they can be. Their feed bounds nothing.
fn program(rate: f64, lines: f64) -> (String, usize) {
    let length = format!("{:.3}", rate / lines / STEPS_PER_MM);
    let length = length.trim_matches('0').trim_end_matches('.');
    let count = (SECONDS * lines) as usize;
    let mut text = String::from("G91M4S5F400000\nG1");
    for line in 0..count {
        let power = 5 + line % 2;
        // Writing to a string does not fail.
        let _ = writeln!(text, "X{length}Y{length}Z{length}S{power}");
    }
    (text, count)
}

/// A row of the table.
fn row(build: &Build, rate: f64, lines: f64) -> Result<String, Failure> {
    let (program, count) = program(rate, lines);
    let mut bench = Bench::boot(build)?;
    bench.ignore_power();
    let acceleration = (rate / STEPS_PER_MM / RAMP_SECONDS) as u32;
    bench.commands(&settings(1, rate, acceleration))?;
    bench.pins.clear();
    bench.machine.clear_records();
    let (began, slept) = (bench.machine.cycle(), bench.machine.slept());
    if let Err(Failure(words)) = bench.stream(&Stream::new(&program).polling(0.1)) {
        return Ok(format!("| {rate:.0} | {lines:.0} | not done: {words} |"));
    }
    let cycles = (bench.machine.cycle() - began) as f64;
    let load = 100.0 - 100.0 * (bench.machine.slept() - slept) as f64 / cycles;
    let steps = &bench.pins.steps;
    let late = steps.iter().filter(|step| step.late).count();
    let seconds = cycles / crate::pins::CPU_HZ as f64;
    let gap = match ensure_no_gap(steps) {
        Ok(()) => "",
        Err(_) => ", motion stands still in between",
    };
    Ok(format!(
        "| {rate:.0} | {lines:.0} | ticks up to {:.0}/s, {:.0} lines/s in the mean of the job, {late} late, CPU {load:.0} %{gap} |",
        fastest(steps),
        count as f64 / seconds
    ))
}

/// Prints the table.
pub(crate) fn table(uncapped: &Build) -> Result<(), Failure> {
    println!("| steps/s | lines/s | three motors and power |\n|---|---|---|");
    for (rate, lines) in ROWS {
        println!("{}", row(uncapped, rate, lines)?);
    }
    Ok(())
}
