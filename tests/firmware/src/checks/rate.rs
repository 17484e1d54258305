//! The highest rate at which three motors may step together with the shortest pulses. The job's
//! lines change direction a little, because the tick that loads a line's first segment takes
//! longest.
use super::{
    interrupts::{middle_and_most, Interrupts},
    timing::{ensure_no_gap, fastest, longest_tick, settings, LOADING},
    Figures,
};
use crate::{
    bench::{ensure, Bench, Failure},
    firmware::{Build, Firmware},
    pins::CPU_HZ,
    steps::jitter,
    stream::Stream,
};
use std::fmt::Write;

/// The rate that must be kept up, and to which faster settings are limited, steps/s.
const RATE: f64 = 370_000.0;
/// The rate that a too fast setting asks for, steps/s.
const FASTER: f64 = 400_000.0;
/// The message about that setting: 370 370 steps/s · 60 / 250.
const CAPPED: &str = "can be 88888.800 at most]";

/// The number of lines of the job. Each is 4 mm long on all axes, some 1000 steps: 500 lines/s at
/// 500 000 steps/s. Their feed bounds nothing.
const LINES: usize = 400;
/// The acceleration, mm/s²: from rest to 400 000 steps/s in a quarter of the job.
const ACCELERATION: u32 = 5000;
/// The bounds of the search, steps/s: a rate that must hold, and the highest one that pulses of 1 µs
/// leave room for (a tick of 2 µs); and the precision.
const SLOWEST: f64 = RATE;
const FASTEST: f64 = 500_000.0;
const EXACT: f64 = 2_000.0;

fn program() -> String {
    let mut text = String::from("G91M4S500F400000\nG1");
    for line in 0..LINES {
        let x = 4.0 + (line % 3) as f64 * 0.004;
        // Writing to a string does not fail.
        let _ = writeln!(text, "X{x:.3}Y4Z4");
    }
    text
}

/// Runs the job on a board. Returns the board, and the share of the time in which its CPU was
/// awake.
fn run(build: &Build, rate: f64) -> Result<(Bench, f64), Failure> {
    let mut bench = Bench::boot(build)?;
    bench.ignore_power();
    bench.commands(&settings(1, rate, ACCELERATION))?;
    bench.pins.clear();
    bench.machine.clear_records();
    bench.machine.record_services();
    let (began, slept) = (bench.machine.cycle(), bench.machine.slept());
    bench.stream(&Stream::new(&program()).polling(0.1))?;
    let asleep = (bench.machine.slept() - slept) as f64;
    let busy = 1.0 - asleep / (bench.machine.cycle() - began) as f64;
    ensure_no_gap(&bench.pins.steps)?;
    Ok((bench, busy))
}

fn late(bench: &Bench) -> usize {
    bench.pins.steps.iter().filter(|step| step.late).count()
}

/// Runs three motors at the board's highest rate for a second; the setting that asks for more must
/// be answered with a message.
pub(crate) fn at_the_cap(firmware: &Firmware) -> Result<Figures, Failure> {
    let (mut bench, busy) = run(firmware.build("fast")?, FASTER)?;
    let (steps, late) = (&bench.pins.steps, late(&bench));
    let (rate, jitter) = (fastest(steps), jitter(steps));
    let count = steps.len();
    let interrupts = Interrupts::of(&bench);
    let (_, end) = middle_and_most(&interrupts.ends);
    let tick = longest_tick(&bench);
    let mut figures = Figures::default();
    figures.add(
        "three motors, pulses of 1 us",
        format!("{rate:.0} steps/s, {count} step events, {late} late, jitter {jitter} cycles"),
    );
    figures.add(
        "longest tick, end of a pulse",
        format!("{tick} and {end} cycles"),
    );
    figures.add(
        "most from one tick to the next",
        format!("{} of {} cycles", interrupts.busiest, CPU_HZ as f64 / RATE),
    );
    let percent = 100.0 * busy;
    figures.add(
        "CPU in the mean of the whole job",
        format!("{percent:.0} %"),
    );
    ensure(
        late == 0 && (0.999 * RATE..=1.001 * RATE).contains(&rate),
        || figures.to_string(),
    )?;
    ensure(tick <= LOADING, || {
        format!("a step interrupt of more than {LOADING} cycles\n{figures}")
    })?;
    let feed = FASTER / 250.0 * 60.0;
    bench.command("$700=1")?;
    for axis in 110..113 {
        let heard = bench.command(&format!("${axis}={feed}"))?;
        let told = format!("[MSG:Step rate: ${axis} {CAPPED}");
        ensure(heard == [told], || format!("{heard:?}"))?;
    }
    Ok(figures)
}

/// Looks for the highest rate at which no tick is late, with a build that limits no rate. Answers
/// the sentence for the report.
pub(crate) fn highest(uncapped: &Build) -> Result<String, Failure> {
    if is_on_time(uncapped, FASTEST)? {
        return Ok(format!(
            "no tick is late up to {FASTEST:.0} steps/s, the most that pulses of 1 us leave room for"
        ));
    }
    let (mut on_time, mut too_fast) = (SLOWEST, FASTEST);
    while too_fast - on_time > EXACT {
        let rate = (on_time + too_fast) / 2.0;
        if is_on_time(uncapped, rate)? {
            on_time = rate;
        } else {
            too_fast = rate;
        }
    }
    Ok(format!("no tick is late up to {on_time:.0} steps/s"))
}

/// Returns true if no tick is late at a rate. Prints the figures.
fn is_on_time(uncapped: &Build, rate: f64) -> Result<bool, Failure> {
    let (bench, busy) = run(uncapped, rate)?;
    let (late, reached) = (late(&bench), fastest(&bench.pins.steps));
    ensure(late > 0 || reached > 0.999 * rate, || {
        format!("asked for {rate:.0}, {reached:.0} steps/s")
    })?;
    let busiest = Interrupts::of(&bench).busiest;
    println!("{rate:.0} steps/s: {late} late, CPU {:.0} % busy, step interrupts {busiest} cycles from tick to tick at most", 100.0 * busy);
    Ok(late == 0)
}
