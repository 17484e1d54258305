//! Lines a second: a laser's raster of short lines over the fast serial line.
use super::Figures;
use crate::{
    bench::{ensure, Bench, Failure},
    firmware::Firmware,
    pins::{CPU_HZ, LINE},
    stream::Stream,
};
use std::fmt::Write;

/// Lines a second that must be kept up.
const RATE: f64 = 10_000.0;
/// Lines of a row and rows.
const PIXELS: usize = 4_000;
const ROWS: usize = 5;
/// A laser at 80 steps/mm, as fast as the lines come: just over 1000 mm/s, 0.1 mm a line.
const SETTINGS: &str = "$0=3\n$32=1\n$30=1000\n$31=0\n$100=80\n$101=80\n$110=120000\n$111=120000\n$120=9000\n$121=9000\n";

/// Rows there and back of lines of 14 bytes with their line feed, each with another power.
fn raster() -> String {
    let mut program = String::from("G21G90M4S0F62000\n");
    for row in 0..ROWS {
        for pixel in 1..=PIXELS {
            let place = if row % 2 == 0 { pixel } else { PIXELS - pixel };
            let power = 100 + (pixel * 7919 + row * 104_729) % 900;
            let line = format!("G1X{:06.2}S{power}", place as f64 / 10.0);
            // Writing to a string does not fail.
            let _ = writeln!(program, "{line}");
        }
    }
    program
}

pub(crate) fn raster_lines(firmware: &Firmware) -> Result<Figures, Failure> {
    let program = raster();
    ensure(program.lines().skip(1).all(|line| line.len() == 13), || {
        "lines of 14 bytes".into()
    })?;
    let mut bench = Bench::boot(&firmware.fast)?;
    bench.ignore_power();
    bench.commands(SETTINGS)?;
    bench.pins.clear();
    let began = bench.machine.cycle();
    let slept = bench.machine.slept();
    Stream::new(&program).send_all(&mut bench)?;
    let seconds = (bench.machine.cycle() - began) as f64 / CPU_HZ as f64;
    let asleep = (bench.machine.slept() - slept) as f64 / (bench.machine.cycle() - began) as f64;
    bench.wait_for("Idle", 60.0)?;
    let lines = (ROWS * PIXELS) as f64 / seconds;
    let late = bench.pins.steps.iter().filter(|step| step.late).count();
    let lost = bench.machine.uart_overruns(LINE);
    let mut figures = Figures::default();
    figures.add(
        "lines of 14 bytes",
        format!(
            "{lines:.0} a second over {seconds:.2} s, CPU {:.0} % busy",
            100.0 * (1.0 - asleep)
        ),
    );
    figures.add("late step events, lost bytes", format!("{late}, {lost}"));
    ensure(lines >= RATE && late == 0 && lost == 0, || {
        figures.to_string()
    })?;
    Ok(figures)
}
