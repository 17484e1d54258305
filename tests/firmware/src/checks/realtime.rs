//! Realtime bytes take effect at once: they come in while motors step, alone and among other bytes.
use super::{
    stopping::{last_step, moving, power_off},
    Figures,
};
use crate::{
    bench::{ensure, micros_between, Bench, Failure},
    firmware::Firmware,
    pins::{CPU_HZ, LINE},
};

/// The longest time from the last bit of a reset (0x18) to the last step edge, µs.
const RESET_US: f64 = 1_000.0;
/// Instants after the start at which the byte comes, s: in the ramp and in the cruise.
const INSTANTS: [f64; 4] = [0.02, 0.151, 0.4007, 0.77];
/// Cycles between two looks for the arrival of a byte.
const LOOK: u64 = 100;

/// The longest time from the last bit of a byte on a full line at 2 Mbaud to the last step edge, or
/// to the first byte of the report, µs. The firmware looks at the line every 50 µs, and a poll that
/// has just begun ends first.
const FULL_LINE_US: f64 = 300.0;
/// The number of other bytes in front of the realtime byte; each number gives another phase of the
/// looks.
const BEFORE: [usize; 10] = [20, 101, 182, 263, 344, 425, 506, 587, 668, 749];

/// Sends a byte and waits until its last bit has arrived. Returns the cycle of the arrival, which
/// is too late by [`LOOK`] at most.
fn send_and_arrive(bench: &mut Bench, byte: u8) -> Result<u64, Failure> {
    send_and_arrive_among(bench, byte, 0, 0)
}

/// As [`send_and_arrive`], with `before` bytes of comments right before the byte, and `after` bytes
/// of comments right after it.
fn send_and_arrive_among(
    bench: &mut Bench,
    byte: u8,
    before: usize,
    after: usize,
) -> Result<u64, Failure> {
    let mut traffic = b"(traffic)\n".repeat((before + after).div_ceil(10));
    traffic.insert(before, byte);
    traffic.truncate(before + 1 + after);
    bench.send(traffic);
    while bench.machine.uart_unsent(LINE) > after {
        bench.run_to(bench.machine.cycle() + LOOK)?;
    }
    Ok(bench.machine.cycle() - LOOK)
}

pub(crate) fn reset_byte(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    for seconds in INSTANTS {
        let mut bench = moving(firmware.build("usual")?, seconds)?;
        let arrived = send_and_arrive(&mut bench, 0x18)?;
        bench.hear_banner()?;
        bench.run_for(0.3)?;
        let stopped = micros_between(arrived, last_step(&bench));
        let off = micros_between(arrived, power_off(&bench)?);
        figures.add(
            format!("0x18 after {seconds} s"),
            format!("last step edge {stopped:.1} us later, laser off {off:.1} us later"),
        );
        ensure(stopped <= RESET_US && off <= RESET_US, || {
            format!("steps or power go on\n{figures}")
        })?;
    }
    Ok(figures)
}

/// The number of bytes that follow, so that the line stays full.
const BEHIND: usize = 200;

/// The time from the arrival of `?` on a full line to the first byte of the report, µs.
fn until_report(bench: &mut Bench, before: usize) -> Result<f64, Failure> {
    let arrived = send_and_arrive_among(bench, b'?', before, BEHIND)?;
    report_after(bench, arrived)
}

/// The time from a cycle to the end of the report's first byte, µs.
fn report_after(bench: &mut Bench, arrived: u64) -> Result<f64, Failure> {
    while !bench.machine.uart_out(LINE).contains(&b'<') {
        bench.run_to(bench.machine.cycle() + LOOK)?;
        ensure(bench.machine.cycle() < arrived + CPU_HZ, || {
            "no report".into()
        })?;
    }
    // The byte has gone out whole: it began ten bits before.
    Ok(micros_between(arrived, bench.machine.cycle()))
}

/// The time from the arrival of 0x18 on a full line to the last step edge, µs; negative if the
/// edge came before.
fn until_stop(bench: &mut Bench, before: usize) -> Result<f64, Failure> {
    let arrived = send_and_arrive_among(bench, 0x18, before, BEHIND)?;
    bench.hear_banner()?;
    bench.run_for(0.1)?;
    Ok(micros_between(arrived, last_step(bench)))
}

/// Realtime bytes on a full line must be seen as soon as bytes on a silent one.
pub(crate) fn on_a_full_line(firmware: &Firmware) -> Result<Figures, Failure> {
    let bench = moving(firmware.build("fast")?, 0.4)?;
    let (mut report, mut stop) = (0f64, f64::MIN);
    for before in BEFORE {
        report = report.max(until_report(&mut bench.clone(), before)?);
        stop = stop.max(until_stop(&mut bench.clone(), before)?);
    }
    let mut figures = Figures::default();
    figures.add(
        "? to the first byte of the report",
        format!("{report:.0} us at most"),
    );
    figures.add(
        "0x18 to the last step edge",
        format!("{stop:.0} us at most"),
    );
    ensure(report.max(stop) <= FULL_LINE_US, || figures.to_string())?;
    Ok(figures)
}

/// The time of a byte at 115200 baud, s.
const BYTE: f64 = 10.0 / 115_200.0;
/// The numbers of the list's 342 bytes that have gone out when the report is asked for: some at
/// ends of rows, some within rows.
const GONE_OUT: [u32; 6] = [1, 44, 101, 200, 250, 300];
/// The longest time from the arrival of `?` during a list at 115200 baud to the report's first
/// byte, µs.
const IN_A_LIST_US: f64 = 5_000.0;

/// A report that is asked for while `$$` goes out comes after the row under way.
pub(crate) fn in_a_list(firmware: &Firmware) -> Result<Figures, Failure> {
    let bench = Bench::boot(firmware.build("usual")?)?;
    let mut longest = 0f64;
    for bytes in GONE_OUT {
        let mut bench = bench.clone();
        bench.send("$$\n");
        bench.run_for(f64::from(3 + bytes) * BYTE)?;
        let arrived = send_and_arrive(&mut bench, b'?')?;
        longest = longest.max(report_after(&mut bench, arrived)?);
        let heard = bench.hear_until(1.0, |line| line == "ok")?;
        let report = heard.iter().find(|line| line.starts_with('<'));
        ensure(report.is_some_and(|line| line.ends_with('>')), || {
            format!("no report between rows: {heard:?}")
        })?;
    }
    let mut figures = Figures::default();
    figures.add(
        "? to the first byte of the report",
        format!("{longest:.0} us at most"),
    );
    ensure(longest <= IN_A_LIST_US, || figures.to_string())?;
    Ok(figures)
}
