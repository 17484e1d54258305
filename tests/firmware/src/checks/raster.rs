//! Lines a second: a laser's raster of short lines over the fast serial line.
use super::Figures;
use crate::{
    bench::{ensure, Bench, Failure},
    claims::{self, Row},
    firmware::Firmware,
    pins::{CPU_HZ, LINE},
    stream::Stream,
};
use std::fmt::Write;

/// The rate that must be kept up, lines/s; 10 000 are asked for (docs/benchmarks.md).
const RATE: f64 = 8_200.0;
/// The number of lines in a row, 500 mm, and the number of rows.
const PIXELS: usize = 10_000;
const ROWS: usize = 3;
/// Lines that come before the clock starts: they fill the queue of pixels, and motion begins.
const AHEAD: usize = 6_000;
/// The steps of a line, and the rate that must be kept up with them, lines/s. With 20 steps the
/// board reaches its highest step rate, and must only not be late or lose bytes.
const STEPS: [(u32, f64); 2] = [(8, RATE), (20, 0.0)];

/// The rows that state these rates.
const README: Row = Row {
    file: "README.md",
    last: "`cargo fw-test raster`",
    column: 2,
};
const BENCHMARKS: Row = Row {
    file: "docs/benchmarks.md",
    last: "`raster`",
    column: 2,
};

/// Settings of a laser that is faster than the lines come. A line is 0.05 mm and `steps` steps; the
/// laser could burn 12 500 pixels a second, 11 500 with the reversals.
fn settings(steps: u32) -> String {
    let steps_per_mm = 20 * steps;
    format!("$0=3\n$32=1\n$30=1000\n$31=0\n$100={steps_per_mm}\n$101={steps_per_mm}\n$110=37500\n$111=37500\n$120=9000\n$121=9000\n")
}

/// Rows there and back, of lines of 14 bytes with their line feed, each line with another power.
fn raster() -> String {
    let mut program = String::new();
    for row in 0..ROWS {
        for pixel in 1..=PIXELS {
            let place = if row % 2 == 0 { pixel } else { PIXELS - pixel };
            let power = 100 + (pixel * 7919 + row * 104_729) % 900;
            let line = format!("G1X{:06.2}S{power}", place as f64 / 20.0);
            // Writing to a string does not fail.
            let _ = writeln!(program, "{line}");
        }
    }
    program
}

pub(crate) fn raster_lines(firmware: &Firmware) -> Result<Figures, Failure> {
    let program = raster();
    ensure(program.lines().all(|line| line.len() == 13), || {
        "lines of 14 bytes".into()
    })?;
    let (ahead, timed) = program.split_at(14 * AHEAD);
    let mut figures = Figures::default();
    let mut rates = Vec::new();
    for (steps, least) in STEPS {
        let mut bench = Bench::boot(firmware.build("fast")?)?;
        bench.ignore_power();
        bench.commands(&settings(steps))?;
        bench.command("G21G90M4S0F60000")?;
        bench.pins.clear();
        Stream::new(ahead).send_all(&mut bench)?;
        let (began, slept) = (bench.machine.cycle(), bench.machine.slept());
        Stream::new(timed).send_all(&mut bench)?;
        let taken = (bench.machine.cycle() - began) as f64;
        let asleep = (bench.machine.slept() - slept) as f64 / taken;
        bench.wait_for("Idle", 60.0)?;
        let rate = timed.lines().count() as f64 * CPU_HZ as f64 / taken;
        let late = bench.pins.steps.iter().filter(|step| step.late).count();
        let lost = bench.machine.uart_overruns(LINE);
        let busy = 100.0 * (1.0 - asleep);
        figures.add(
            format!("lines of 14 bytes and {steps} steps"),
            format!("{rate:.0} a second, CPU {busy:.0} % busy, {late} late, {lost} bytes lost"),
        );
        ensure(rate >= least && late == 0 && lost == 0, || {
            figures.to_string()
        })?;
        rates.push(Some(rate));
    }
    claims::ensure_stated(&README, &rates[..1])?;
    // The figures between: CPU, steps, kHz, mm/s.
    let few = [rates[0], None, None, None, None, rates[1]];
    claims::ensure_stated(&BENCHMARKS, &few)?;
    Ok(figures)
}
