//! Everything that could delay a step edge, all at once: USB, the serial line in both directions,
//! reading and writing the flash, loads of segments.
use super::{usb::plugged, Figures};
use crate::{
    bench::{ensure, Failure},
    firmware::Firmware,
    pins::{LINE, PULSE_IRQ},
    steps::{jitter, net},
    stream::Stream,
};
use leadscrew_f407emu::Exception;
use std::fmt::Write;

/// How far step edges may be off the schedule, cycles: 0.25 µs.
const JITTER: u32 = 42;
/// Three motors at 250 steps/mm, up to 100 000 steps/s.
const RATE: f64 = 100_000.0;
const PULSE_US: u32 = 3;
/// The number of short lines, each with a power and a direction of its own; and after how many of
/// them an offset is stored.
const LINES: i64 = 1_200;
const STORED_EVERY: i64 = 100;
/// The number of queries that wait on the serial line, at 2 Mbaud: bytes come and go for as long as
/// the job lasts.
const QUERIES: usize = 1_500;

/// The job, and the steps that it makes.
fn job() -> (String, [i64; 3]) {
    let mut lines = String::from("G91M4S500\n");
    for line in 0..LINES {
        let (y, z, power) = (line % 7, line % 3, 300 + line % 500);
        // Writing to a string does not fail.
        let _ = writeln!(lines, "G1X0.4Y0.{y}Z0.{z}S{power}F99999");
        if line % STORED_EVERY == 0 {
            let _ = writeln!(lines, "G10L2P1X{line}");
        }
    }
    let tenths = |every: i64| (0..LINES).map(|line| line % every).sum::<i64>();
    (lines, [100 * LINES, 25 * tenths(7), 25 * tenths(3)])
}

/// No step edge may be delayed by more than a quarter of a microsecond.
pub(crate) fn together(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut bench = plugged(&firmware.fast)?;
    bench.cold();
    bench.ignore_power();
    bench.commands(&super::timing::settings(PULSE_US, RATE, 4000))?;
    bench.pins.clear();
    bench.machine.clear_records();
    bench.machine.uart_out(LINE).clear();
    bench.machine.uart_send(LINE, &b"$G\n?".repeat(QUERIES));
    let (program, moved) = job();
    bench.stream(&Stream::new(&program).polling(0.01))?;
    let (steps, sent) = (&bench.pins.steps, bench.machine.uart_out(LINE).len());
    let written = bench.machine.flash_operations().len();
    let ends = bench.machine.profile(Exception::irq(PULSE_IRQ)).count;
    let mut figures = Figures::default();
    figures.add(
        "all at once",
        format!(
            "{} step events, jitter {} cycles; {LINES} lines and queries over USB, {sent} bytes answered on the serial \
             line, {written} words of flash written, {ends} pulses ended and segments loaded",
            steps.len(),
            jitter(steps)
        ),
    );
    let made = net(steps);
    ensure(made == moved, || format!("{made:?} steps, not {moved:?}"))?;
    ensure(written > 0 && sent > 10 * QUERIES, || figures.to_string())?;
    ensure(jitter(steps) <= JITTER, || {
        format!("more than {JITTER} cycles\n{figures}")
    })?;
    Ok(figures)
}
