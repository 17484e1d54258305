//! Everything that could delay a step edge, all at once: USB, the serial line in both directions,
//! reading and writing the flash, loads of segments, edges of switches. The priorities of all
//! interrupts are those of the board's README.
use super::{stopping::last_step, usb::plugged, Figures};
use crate::{
    bench::{ensure, Bench, Failure},
    firmware::{Build, Firmware},
    pins::{CPU_HZ, DOOR, HOLD, LIMIT, LINE, PROBE, PULSE_IRQ, RESET, START, STEP_IRQ},
    steps::{jitter, net},
    stream::Stream,
};
use leadscrew_f407emu::{Exception, Pin};
use std::fmt::Write;

/// The most by which step edges may be off the schedule, cycles: 0.25 µs.
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

/// The times between two edges of a switch that is not worked, and for which it then has another
/// level, cycles: 0.14 ms and 5 µs, which no filter passes. A glitch comes at every phase of a tick.
const BETWEEN_GLITCHES: u64 = 23_531;
const GLITCH: u64 = 840;
/// The switches of the Discovery, and the level that each has at rest.
const SWITCHES: [(Pin, bool); 8] = [
    (LIMIT[0], true),
    (LIMIT[1], true),
    (LIMIT[2], true),
    (PROBE, true),
    (DOOR, true),
    (RESET, true),
    (HOLD, true),
    (START, false),
];
/// The time for which glitches come, s: longer than the job.
const GLITCHES_SECONDS: u64 = 60;

/// The interrupts of edges and of the filter's time that these switches cause: EXTI0, EXTI1, EXTI2,
/// EXTI4, EXTI9_5, TIM5.
const EDGES: [u8; 6] = [6, 7, 8, 10, 23, 50];

/// The priorities in the NVIC: 0 is the most urgent one. The F407 uses the upper four bits of the
/// register.
const NVIC_ISER: u32 = 0xE000_E100;
const NVIC_IPR: u32 = 0xE000_E400;
const INTERRUPTS: u32 = 82;

/// The priority that the board's README gives to an interrupt, by its number (RM0090 table 62).
fn priority(irq: u32) -> Option<u32> {
    const STEP: u32 = STEP_IRQ as u32;
    const PULSE: u32 = PULSE_IRQ as u32;
    Some(match irq {
        STEP => 0,
        PULSE => 1,
        // PVD, EXTI0 to EXTI15, TIM5.
        1 | 6..=10 | 23 | 40 | 50 => 2,
        // TIM7, the streams of DMA that send.
        55 | 17 | 70 => 3,
        // OTG_FS
        67 => 4,
        _ => return None,
    })
}

/// Every interrupt that is on has the priority of the table. Returns how many there are.
fn ensure_priorities(build: &Build) -> Result<usize, Failure> {
    let mut bench = Bench::boot(build)?;
    let mut seen = 0;
    for irq in 0..INTERRUPTS {
        let is_on = bench.machine.peek(NVIC_ISER + 4 * (irq / 32)) >> (irq % 32) & 1 != 0;
        if is_on {
            let word = bench.machine.peek(NVIC_IPR + (irq & !3));
            let found = word >> (8 * (irq & 3) + 4) & 15;
            ensure(Some(found) == priority(irq), || {
                format!("interrupt {irq} has the priority {found}")
            })?;
            seen += 1;
        }
    }
    Ok(seen)
}

/// Lets the switches glitch, one after the other.
fn glitch(bench: &mut Bench) {
    let glitches = GLITCHES_SECONDS * CPU_HZ / BETWEEN_GLITCHES;
    let start = bench.machine.cycle();
    for (number, (pin, rest)) in (1..=glitches).zip(SWITCHES.into_iter().cycle()) {
        let at = start + number * BETWEEN_GLITCHES;
        bench.machine.pin_at(at, pin, !rest);
        bench.machine.pin_at(at + GLITCH, pin, rest);
    }
}

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
    let mut bench = plugged(firmware.build("fast")?)?;
    bench.cold();
    bench.ignore_power();
    bench.commands(&super::timing::settings(PULSE_US, RATE, 4000))?;
    bench.pins.clear();
    bench.machine.clear_records();
    bench.machine.uart_out(LINE).clear();
    bench.machine.uart_send(LINE, &b"$G\n?".repeat(QUERIES));
    let (program, moved) = job();
    glitch(&mut bench);
    let start = bench.machine.cycle();
    bench.stream(&Stream::new(&program).polling(0.01))?;
    let (steps, sent) = (&bench.pins.steps, bench.machine.uart_out(LINE).len());
    let written = bench.machine.flash_operations().len();
    let ends = bench.machine.profile(Exception::irq(PULSE_IRQ)).count;
    let edges: u64 = EDGES
        .iter()
        .map(|irq| bench.machine.profile(Exception::irq(*irq)).count)
        .sum();
    let mut figures = Figures::default();
    for (name, build) in [
        ("discovery", firmware.build("fast")?),
        ("skr-2", firmware.build("skr-2")?),
    ] {
        let interrupts = ensure_priorities(build)?;
        figures.add(
            format!("priorities, {name}"),
            format!("{interrupts} interrupts, as in the README"),
        );
    }
    figures.add(
        "all at once",
        format!(
            "{} step events, jitter {} cycles; {LINES} lines and queries over USB, {sent} bytes answered on the serial \
             line, {written} words of flash written, {ends} pulses ended and segments loaded, {edges} interrupts of switches",
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
    let lasted = last_step(&bench) - start;
    let came = lasted.min(GLITCHES_SECONDS * CPU_HZ) / BETWEEN_GLITCHES;
    ensure(lasted < GLITCHES_SECONDS * CPU_HZ && edges > came, || {
        format!("{came} glitches in {lasted} cycles\n{figures}")
    })?;
    Ok(figures)
}
