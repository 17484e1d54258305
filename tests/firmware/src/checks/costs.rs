//! Measures the costs of the firmware's work, in CPU cycles; the simulator charges these costs to
//! its own CPU. `cargo fw-test --costs` writes them to `crates/sim/src/measured.rs`. The check
//! `costs` compares this file with the present firmware.
//!
//! Interrupts are measured one by one. The main loop's work is measured with jobs. Each job adds
//! one kind of work to the work of the jobs before; the additional cycles are this kind's cost.
use super::{
    interrupts::{middle_and_most, Interrupts},
    stopping::moving,
    timing, Figures,
};
use crate::{
    bench::{ensure, fail, Bench, Failure},
    firmware::Firmware,
    pins::LIMIT,
    stream::Stream,
};
use leadscrew_f407emu::{Duty, Exception, Profile};
use leadscrew_sim::measured;
use std::fmt::Write;

/// The interrupts of a switch's edge (EXTI4), of the end of its filter's time (TIM5), of the serial
/// line's listener (TIM7) and of its sender (DMA1 stream 6).
const EDGE_IRQ: u8 = 10;
const SETTLED_IRQ: u8 = 50;
const LISTENER_IRQ: u8 = 55;
const SENDER_IRQ: u8 = 17;
/// The difference that a measured figure may have from the written one, per cent: another compiler
/// moves figures a little. For kinds of main-loop work the cost of a turn is added to the figure
/// first, because their cost is a difference of large numbers.
const OFF_PERCENT: u64 = 10;
/// The bytes that come in a turn of the main loop, at 2 Mbaud with a look every 50 µs.
const BYTES_IN_A_TURN: u64 = 10;

/// Lines of a job; they fit the queue of planned moves.
const MANY: usize = 1000;
/// Status reports that are asked for.
const REPORTS: usize = 50;
/// The number of bytes by which some lines are longer than others.
const LONGER: usize = 64;
/// A move that lasts while the queue is filled behind it: 1 s.
const SLOW: &str = "G1X-0.5F30";
/// A laser that burns rows.
const LASER: &str = "$32=1\nG0X0Y0\nM4S0\n";
/// Bytes of `ok`, carriage return and line feed.
const OK: usize = 4;
/// A feed that three axes follow, reports with the time left, and as many moves queued as fit.
const SETTINGS: &str =
    "$0=3\n$10=9\n$100=80\n$101=80\n$110=60000\n$111=60000\n$120=2000\n$121=2000\n$710=0\n";

/// One figure of `measured.rs`.
struct Cost {
    name: &'static str,
    what: &'static str,
    measured: u64,
    written: u32,
}

macro_rules! cost {
    ($name:ident, $what:literal, $measured:expr) => {
        Cost {
            name: stringify!($name),
            what: $what,
            measured: $measured,
            written: measured::$name,
        }
    };
}

fn profile(bench: &Bench, irq: u8) -> &Profile {
    bench.machine.profile(Exception::irq(irq))
}

/// The costs of step interrupts at which three motors step, with cold caches.
fn of_steps(firmware: &Firmware) -> Result<Vec<Cost>, Failure> {
    let bench = timing::busy_with_three_motors(firmware.build("usual")?)?;
    let interrupts = Interrupts::of(&bench);
    let latencies = bench.pins.steps.iter().map(|step| step.latency.into());
    let (edge, _) = middle_and_most(&latencies.collect::<Vec<u64>>());
    let (step, step_most) = middle_and_most(&interrupts.stepping);
    let (load, load_most) = middle_and_most(&interrupts.loads);
    let (end, _) = middle_and_most(&interrupts.ends);
    let power = power_edge(&bench)?;
    let width = u64::from(timing::PULSE_US) * 168;
    let fall = bench.pins.extremes.pulse.saturating_sub(width);
    Ok(vec![
        cost!(
            STEP_EDGE,
            "From the timer's compare to the edge of the step pins: the median",
            edge
        ),
        cost!(
            POWER_EDGE,
            "From the timer's compare to the power that changes with a step: the median",
            power
        ),
        cost!(
            STEP,
            "A tick at which three motors step and power changes: the median",
            step
        ),
        cost!(STEP_MOST, "The same: the longest", step_most),
        cost!(LOAD, "A tick that loads a segment: the median", load),
        cost!(
            LOAD_MOST,
            "The same: the longest, the first of a line",
            load_most
        ),
        cost!(
            RUN_OUT,
            "A tick that comes to rest where no segment is left",
            interrupts.run_out
        ),
        cost!(
            PULSE_EDGE,
            "From the end of a pulse's time to the fall of the step pins: the shortest",
            fall
        ),
        cost!(PULSE_END, "To end a pulse: the median", end),
    ])
}

/// The median time from a tick's compare to the change of duty with its step, cycles.
fn power_edge(bench: &Bench) -> Result<u64, Failure> {
    let steps = &bench.pins.steps;
    let after = |duty: &Duty| {
        let next = steps.partition_point(|step| step.edge() <= duty.cycle);
        let step = steps.get(next.checked_sub(1)?)?;
        Some(duty.cycle - step.edge() + u64::from(step.latency))
    };
    let all: Vec<u64> = bench.machine.duties().iter().filter_map(after).collect();
    match middle_and_most(&all) {
        (0, _) => fail("the power never changes"),
        (middle, _) => Ok(middle),
    }
}

/// The cost of a limit switch, with cold caches.
fn of_switches(firmware: &Firmware) -> Result<Cost, Failure> {
    let mut bench = moving(firmware.build("usual")?, 0.1)?;
    bench.cold();
    bench.machine.clear_records();
    bench.set(LIMIT[0], false);
    bench.hear_until(0.1, |line| line == "ALARM:1")?;
    let both = profile(&bench, EDGE_IRQ).max + profile(&bench, SETTLED_IRQ).max;
    Ok(cost!(
        SWITCHES,
        "The interrupts of a switch's edge and of the end of its filter's time",
        both
    ))
}

/// The work that the main loop did during a stretch of time.
#[derive(Clone, Copy)]
struct Spent {
    cycles: u64,
    instructions: u64,
    turns: u64,
    /// The number of segments loaded, and so of segments made.
    segments: u64,
}

impl Spent {
    /// The main loop's work during `job`.
    fn on(
        bench: &mut Bench,
        job: impl FnOnce(&mut Bench) -> Result<(), Failure>,
    ) -> Result<Spent, Failure> {
        bench.pins.clear();
        bench.machine.clear_records();
        let before = bench.machine.turns();
        job(bench)?;
        let after = bench.machine.turns();
        Ok(Spent {
            cycles: after.cycles - before.cycles,
            instructions: after.instructions - before.instructions,
            turns: after.count - before.count,
            segments: Interrupts::of(bench).loads.len() as u64,
        })
    }
}

/// The cycles of all looks at the serial line beyond the cost of looks that find nothing.
fn listening(bench: &Bench, nothing: u64) -> u64 {
    let listener = profile(bench, LISTENER_IRQ);
    listener.total.saturating_sub(listener.count * nothing)
}

/// The allowed error of a figure, cycles.
fn allowed(name: &str, written: u64) -> u64 {
    let turn = u64::from(measured::POLL);
    let with = match name {
        "LINE" | "PLANNED_MOVE" | "PIXEL" | "SEGMENT" | "REPORT" => turn,
        "BYTE" => turn / BYTES_IN_A_TURN,
        _ => 0,
    };
    (written + with) * OFF_PERCENT / 100
}

fn lines(of: impl Fn(usize) -> String) -> String {
    (0..MANY).map(|number| of(number) + "\n").collect()
}

/// The costs of the kinds of work of the main loop, cycles. The measurement of each cost needs the
/// costs before it.
#[derive(Default)]
struct Work {
    poll: u64,
    byte: u64,
    line: u64,
    report: u64,
    segment: u64,
}

impl Work {
    /// The cycles of a stretch of time for each of `things`, after the known costs of turns,
    /// segments, bytes and lines are subtracted.
    fn rest_of(&self, spent: Spent, lines: usize, bytes: usize, things: usize) -> u64 {
        let known = spent.turns * self.poll
            + spent.segments * self.segment
            + bytes as u64 * self.byte
            + lines as u64 * self.line;
        spent.cycles.saturating_sub(known) / things.max(1) as u64
    }
}

/// Sends lines, and waits for their answers.
fn send(text: &str) -> impl FnOnce(&mut Bench) -> Result<(), Failure> + '_ {
    |bench| Stream::new(text).send_all(bench)
}

/// Asks for [`REPORTS`] status reports. Returns the number of their bytes.
fn ask(bench: &mut Bench) -> Result<usize, Failure> {
    let mut bytes = 0;
    for _ in 0..REPORTS {
        bytes += bench.status()?.len() + 2;
    }
    Ok(bytes)
}

/// Lets the machine move until no step has come for 0.1 s, which is longer than any interval of the
/// job.
fn run_out(bench: &mut Bench) -> Result<(), Failure> {
    bench.send("~");
    loop {
        let steps = bench.pins.steps.len();
        bench.run_for(0.1)?;
        if bench.pins.steps.len() == steps {
            return Ok(());
        }
    }
}

/// The costs of the serial line at 2 Mbaud and of the main loop.
fn of_main_loop(firmware: &Firmware) -> Result<Vec<Cost>, Failure> {
    let mut bench = Bench::boot(firmware.build("fast")?)?;
    bench.commands(SETTINGS)?;
    bench.run_for(0.1)?;
    bench.machine.record_services();
    let mut work = Work::default();
    let (byte_in, byte_out) = of_bytes(&mut bench, &mut work)?;
    of_lines(&mut bench, &mut work)?;
    let motion = of_motion(&mut bench, &mut work)?;
    let pixel = of_a_row(&mut bench, &work)?;
    Ok(vec![
        cost!(
            BYTE_IN,
            "To receive a byte of a line of 2 Mbaud that never rests",
            byte_in
        ),
        cost!(BYTE_OUT, "To send a byte of `ok`", byte_out),
        cost!(POLL, "A turn of the main loop at rest", work.poll),
        cost!(
            BYTE,
            "A byte taken from the receive queue, or given to the sender",
            work.byte
        ),
        cost!(
            LINE,
            "A line of seven words, none of them a place, checked and interpreted, and answered",
            work.line
        ),
        cost!(
            PLANNED_MOVE,
            "A move planned, and its words: in the mean of a thousand",
            motion.planned
        ),
        cost!(
            PIXEL,
            "A move that became part of a row of pixels, and its words: in the mean of a thousand",
            pixel
        ),
        cost!(
            SEGMENT,
            "To make a segment, and to find no room for the next: in the mean of a thousand moves",
            work.segment
        ),
        cost!(
            TIMED,
            "A queued move whose time is added up for a report",
            motion.timed
        ),
        cost!(REPORT, "A status report", work.report),
        cost!(
            HUNDRED_INSTRUCTIONS,
            "A hundred instructions of the main loop, while a thousand moves are planned",
            motion.hundred_instructions
        ),
    ])
}

/// Measures a rest, and then bytes without a gap. Returns the cycles of a byte in and of a byte
/// out.
fn of_bytes(bench: &mut Bench, work: &mut Work) -> Result<(u64, u64), Failure> {
    let rest = Spent::on(bench, |bench| bench.run_for(0.5))?;
    work.poll = rest.cycles / rest.turns.max(1);
    let nothing = profile(bench, LISTENER_IRQ).min;

    let short = lines(|_| "()".into());
    let long = lines(|_| format!("({})", "-".repeat(LONGER)));
    let few = Spent::on(bench, send(&short))?;
    let many = Spent::on(bench, send(&long))?;
    let byte_in = listening(bench, nothing) / long.len() as u64;
    let byte_out = profile(bench, SENDER_IRQ).total / (OK * MANY) as u64;
    let few = work.rest_of(few, 0, 0, MANY);
    work.byte = work.rest_of(many, 0, 0, MANY).saturating_sub(few) / LONGER as u64;
    Ok((byte_in, byte_out))
}

/// Measures lines that move nothing, and reports.
fn of_lines(bench: &mut Bench, work: &mut Work) -> Result<(), Failure> {
    let program = lines(|_| "G21G90G54G94M9F1500.5".into());
    let spent = Spent::on(bench, send(&program))?;
    work.line = work.rest_of(spent, 0, program.len() + OK * MANY, MANY);

    let mut bytes = 0;
    let spent = Spent::on(bench, |bench| ask(bench).map(|sent| bytes = sent))?;
    work.report = work.rest_of(spent, 0, bytes, REPORTS);
    Ok(())
}

/// The costs of lines with moves, cycles.
struct Motion {
    planned: u64,
    timed: u64,
    hundred_instructions: u64,
}

/// Measures a thousand moves: planned, timed in a hold, and run.
fn of_motion(bench: &mut Bench, work: &mut Work) -> Result<Motion, Failure> {
    let mut bytes = 0;
    let program = lines(|number| {
        let (x, y) = (number as f64 * 0.3, (number % 5) as f64 * 0.02);
        format!("G1X{x:.3}Y{y:.3}F9000")
    });
    bench.command(SLOW)?;
    let planning = Spent::on(bench, send(&program))?;
    bench.send("!");
    bench.wait_for("Hold:0", 1.0)?;
    let spent = Spent::on(bench, |bench| ask(bench).map(|sent| bytes = sent))?;
    let timing = work.rest_of(spent, 0, bytes, REPORTS);
    let timed = timing.saturating_sub(work.report) / MANY as u64;

    let moving = Spent::on(bench, run_out)?;
    work.segment = work.rest_of(moving, 0, 0, moving.segments as usize);
    let bytes = program.len() + OK * MANY;
    Ok(Motion {
        planned: work.rest_of(planning, MANY, bytes, MANY),
        timed,
        hundred_instructions: 100 * planning.cycles / planning.instructions.max(1),
    })
}

/// Measures a thousand pixels of a row. Returns the cycles of one.
fn of_a_row(bench: &mut Bench, work: &Work) -> Result<u64, Failure> {
    let row = lines(|number| {
        let (x, power) = (number as f64 * 0.05, 100 + number * 37 % 900);
        format!("G1X{x:.2}S{power}")
    });
    bench.commands(LASER)?;
    bench.command(SLOW)?;
    let pixels = Spent::on(bench, send(&row))?;
    Ok(work.rest_of(pixels, MANY, row.len() + OK * MANY, MANY))
}

fn measure(firmware: &Firmware) -> Result<Vec<Cost>, Failure> {
    let mut all = of_steps(firmware)?;
    all.push(of_switches(firmware)?);
    all.append(&mut of_main_loop(firmware)?);
    Ok(all)
}

/// The text of `measured.rs`.
pub(crate) fn source(firmware: &Firmware) -> Result<String, Failure> {
    let mut text = String::from(
        "//! What the firmware took on an emulated STM32F407, in cycles. Written by `cargo fw-test --costs`: do not edit.\n",
    );
    for Cost {
        name,
        what,
        measured,
        ..
    } in measure(firmware)?
    {
        // Writing to a string does not fail.
        let _ = write!(text, "\n/// {what}.\npub const {name}: u32 = {measured};\n");
    }
    Ok(text)
}

/// Checks that the written figures are the measured ones.
pub(crate) fn costs(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let mut off = Vec::new();
    for Cost {
        name,
        what,
        measured,
        written,
    } in measure(firmware)?
    {
        let written = u64::from(written);
        figures.add(what, format!("{measured} cycles"));
        if measured.abs_diff(written) > allowed(name, written) {
            off.push(format!("{name}, {written}"));
        }
    }
    ensure(off.is_empty(), || {
        format!("not as written: {off:?}; `cargo fw-test --costs` writes them anew\n{figures}")
    })?;
    Ok(figures)
}
