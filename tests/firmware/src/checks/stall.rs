//! Settings in the flash: how long writing them stops everything else, and the bytes that come
//! meanwhile.
use super::{
    power_loss::{with_known, LONGEST},
    Figures,
};
use crate::{
    bench::{ensure, micros_between, Bench, Failure},
    firmware::Firmware,
    pins::LINE,
    steps::net,
    stream::Stream,
};
use leadscrew_f407emu::FlashOperation;
use std::fmt::Write;

/// The times that the flash takes to program a word, µs: typical and maximum (data sheet, table
/// 40).
const PROGRAMMING: [u32; 2] = [16, 100];
/// The longest that the main loop may wait for the flash, µs.
const STALL_US: f64 = 2_000.0;
/// Words that follow the word before sooner than this, in cycles, are written in one go: an
/// interrupt may come between them, but a poll takes longer.
const IN_ONE_GO: u64 = 4_000;

/// The number of lines with moves that come while a record is written: together 1000 steps and
/// more.
const MOVES: usize = 60;
/// The number of bytes that a sender may have under way unanswered.
const WINDOW: usize = Stream::WINDOW;

/// The text of `count` moves, and the number of their steps.
fn moves(count: usize) -> (String, i64) {
    let (mut lines, mut steps) = (String::new(), 0);
    for index in 1..=count {
        // 250 steps/mm: 4 µm a step. Writing to a string does not fail.
        let _ = writeln!(lines, "X{:.3}", (index % 37 + 1) as f64 * 0.004);
        steps += (index % 37 + 1) as i64;
    }
    (lines, steps)
}

/// Sends lines, one of which is stored. At `cycle` (at once if it has passed) it sends moves behind
/// them, with a status query among them. Returns the longest time that the main loop waits for the
/// flash, µs.
fn stall(bench: Bench, lines: &str, cycle: u64) -> Result<f64, Failure> {
    stall_with(moves(MOVES), bench, lines, cycle)
}

/// As [`stall`], with other moves: their lines, and the number of their steps.
fn stall_with(
    (moves, steps): (String, i64),
    mut bench: Bench,
    lines: &str,
    cycle: u64,
) -> Result<f64, Failure> {
    let (first, second) = moves.split_at(moves.len() / 2);
    bench.pins.clear();
    bench.send(format!("{lines}\n"));
    bench.run_to(cycle)?;
    bench.send(format!("{first}?{second}"));
    let answers = lines.lines().count() + moves.lines().count();
    let mut heard = Vec::new();
    while heard.iter().filter(|line| *line == "ok").count() < answers {
        let more = bench.hear_until(1.0, |_| true)?;
        ensure(
            !more
                .iter()
                .any(|line| line.starts_with("error") || line.starts_with("ALARM")),
            || format!("{more:?}"),
        )?;
        heard.extend(more);
    }
    ensure(heard.iter().any(|line| line.starts_with('<')), || {
        "no status report".into()
    })?;
    let lost = bench.machine.uart_overruns(LINE);
    ensure(lost == 0, || format!("{lost} bytes lost"))?;
    bench.wait_for("Idle", 10.0)?;
    let moved = net(&bench.pins.steps);
    ensure(moved == [steps, 0, 0], || {
        format!("{moved:?} steps, not {steps}")
    })?;
    Ok(longest_stall(&bench))
}

/// Sends as many lines as a sender may have under way behind `line`, whose record causes an erase:
/// none may be lost. Returns how long the main loop waits, µs. The board must be at 250 steps/mm in
/// X, in G91 G1.
pub(super) fn ensure_window_survives(bench: &Bench, line: &str) -> Result<f64, Failure> {
    let room = WINDOW - line.len() - 1;
    // Each move takes seven bytes with its line feed.
    let all = moves(room / 7);
    ensure((room - 7..=room).contains(&all.0.len()), || {
        format!("{} bytes, not {room}", all.0.len())
    })?;
    stall_with(all, bench.clone(), line, 0)
}

/// The longest time in which the flash was written without a poll of the main loop between, µs.
fn longest_stall(bench: &Bench) -> f64 {
    let operations = bench.machine.flash_operations();
    let one_go = |one: &FlashOperation, next: &FlashOperation| next.begin - one.end < IN_ONE_GO;
    let stalls = operations.chunk_by(one_go).filter_map(|stall| {
        let (first, last) = (stall.first()?, stall.last()?);
        Some(micros_between(first.begin, last.end))
    });
    stalls.fold(0.0, f64::max)
}

/// The cycles at which the flash began to write and at which it was done.
fn writing(bench: &Bench) -> Result<(u64, u64), Failure> {
    let operations = bench.machine.flash_operations();
    let (Some(first), Some(last)) = (operations.first(), operations.last()) else {
        return Err(Failure("nothing is stored".into()));
    };
    Ok((first.begin, last.end))
}

/// The cycles that a byte takes at 2 Mbaud.
const BYTE: u64 = 840;
/// The first instant that is tried is this many cycles before the first word.
const BEFORE: u64 = 700;
/// Cycles from one instant that is tried to the next.
const APART: usize = 35;

/// Returns true if bytes go out while the flash is written because of these lines.
fn is_sending(bench: &Bench, lines: &str, begin: u64, end: u64) -> Result<bool, Failure> {
    let mut bench = bench.clone();
    bench.send(format!("{lines}\n"));
    bench.run_to(begin)?;
    let before = bench.machine.uart_out(LINE).len();
    bench.run_to(end)?;
    Ok(bench.machine.uart_out(LINE).len() > before)
}

/// Bytes begin to come at many instants around the first word of a record: on a line that is
/// otherwise silent, and while the end of a list goes out.
fn at_many_instants(bench: &Bench) -> Result<String, Failure> {
    let mut count = 0;
    for lines in ["$30=24000", "$#\n$30=24000"] {
        let mut alone = bench.clone();
        alone.send(format!("{lines}\n"));
        alone.run_for(0.05)?;
        let (begin, end) = writing(&alone)?;
        ensure(
            is_sending(bench, lines, begin, end)? == lines.starts_with("$#"),
            || format!("{lines:?}: the wrong one sends while the flash is written"),
        )?;
        for arrival in (begin - BEFORE..begin).step_by(APART) {
            let before = begin - arrival;
            stall(bench.clone(), lines, arrival - BYTE).map_err(|failure| {
                Failure(format!("{lines:?}, {before} cycles before: {failure}"))
            })?;
            count += 1;
        }
    }
    Ok(format!("{count} tried, nothing lost"))
}

pub(crate) fn flash_stall(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut bench = with_known(firmware.build("fast")?)?;
    bench.commands("$100=250\n$110=6000\n$120=500\nG91G1F3000\n")?;
    bench.machine.clear_records();
    let lines = [
        "$30=24000",
        "G10L2P2X-123.456Y234.567Z-0.001",
        "$I=a board on a bench",
        LONGEST,
    ];
    let mut figures = Figures::default();
    for line in lines {
        for program_us in PROGRAMMING {
            bench.machine.timing_mut().program_us = program_us;
            let micros = stall(bench.clone(), line, 0);
            let micros = micros.map_err(|failure| Failure(format!("{line}: {failure}")))?;
            figures.add(
                format!("a line of {} bytes, {program_us} us a word", line.len()),
                format!("{micros:.0} us at a time, nothing lost"),
            );
            ensure(micros <= STALL_US, || format!("too long\n{figures}"))?;
        }
    }
    bench.machine.timing_mut().program_us = PROGRAMMING[0];
    figures.add(
        "bytes from around the first word on",
        at_many_instants(&bench)?,
    );
    Ok(figures)
}
