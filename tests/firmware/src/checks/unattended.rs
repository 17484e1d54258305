//! Nobody is there: heaters go off without their sender, and motion without a step interrupt is
//! told.
use super::{
    machines::{boot_printer, until_off},
    Figures,
};
use crate::{
    bench::{ensure, Bench, Failure},
    firmware::{Build, Fault, Firmware},
    wiring::HEATERS,
};

/// A state in which heaters stay on while the sender is there, and the bytes that lead to it.
struct Stay {
    name: &'static str,
    bytes: &'static [u8],
}

const STAYS: [Stay; 3] = [
    Stay {
        name: "at rest",
        bytes: b"",
    },
    Stay {
        name: "in M0",
        bytes: b"M0\n",
    },
    Stay {
        name: "at the door",
        bytes: b"\x84",
    },
];

/// `$722`, s, and how much later the heaters may go off.
const SILENCE: f64 = 1.0;
const LATER: f64 = 0.01;
/// The longest time until 0x18 switches heaters off, s.
const RESET: f64 = 0.005;
/// The time for which what is off must stay off, s.
const STAYS_OFF: f64 = 1.0;
/// A sender's pause between two `?`, s.
const POLL: f64 = 0.2;

fn are_on(bench: &Bench) -> [bool; 2] {
    HEATERS.map(|pin| bench.machine.level(pin))
}

fn ensure_are(bench: &Bench, on: bool, when: &str) -> Result<(), Failure> {
    let heaters = are_on(bench);
    ensure(heaters == [on; 2], || {
        format!("{when}: heaters are on: {heaters:?}")
    })
}

/// Switches both heaters on, and keeps asking for a while longer than a silence may be.
fn heat(build: &Build, stay: &Stay) -> Result<Bench, Failure> {
    let mut bench = boot_printer(build)?;
    bench.commands("$X\n$722=1\nM104S250\nM140S110\n")?;
    bench.send(stay.bytes);
    for _ in 0..(1.5 * SILENCE / POLL) as usize {
        bench.run_for(POLL)?;
        bench.status()?;
        ensure_are(&bench, true, stay.name)?;
    }
    Ok(bench)
}

/// Waits for the heaters to go off, in so many seconds; they must stay off. Returns the time, ms.
fn go_off(bench: &mut Bench, seconds: f64, when: &str) -> Result<f64, Failure> {
    let off = until_off(bench, seconds);
    let off = off.map_err(|Failure(words)| Failure(format!("{when}: {words}")))?;
    bench.run_for(STAYS_OFF)?;
    ensure_are(bench, false, when)?;
    Ok(off)
}

/// The sender falls silent. Returns how long the heaters were on after its last report, ms.
fn silence(mut bench: Bench, when: &str) -> Result<f64, Failure> {
    bench.run_for(0.9 * SILENCE)?;
    ensure_are(&bench, true, when)?;
    let off = go_off(&mut bench, 0.1 * SILENCE + LATER, when)?;
    let heard = bench.heard();
    ensure(heard.iter().any(|line| line.contains("silent")), || {
        format!("{when}: nothing is said: {heard:?}")
    })?;
    Ok(900.0 * SILENCE + off)
}

/// 0x18 comes. Returns how long the heaters were on after it, ms.
fn reset(mut bench: Bench, when: &str) -> Result<f64, Failure> {
    bench.send(b"\x18");
    go_off(&mut bench, RESET, when)
}

pub(crate) fn heaters(firmware: &Firmware) -> Result<Figures, Failure> {
    let build = firmware.build("machine-file-004")?;
    let mut figures = Figures::default();
    for stay in &STAYS {
        let bench = heat(build, stay)?;
        let silent = silence(bench.clone(), stay.name)?;
        let reset = reset(bench, stay.name)?;
        figures.add(
            stay.name,
            format!(
                "on while the sender asks; off {silent:.1} ms after its last report, {reset:.1} ms \
                 after 0x18"
            ),
        );
    }
    Ok(figures)
}

/// The register that lets interrupts 0 to 31 come, and the step timer's among them.
const NVIC_ISER: u32 = 0xE000_E100;
const STEPS: u32 = 1 << crate::pins::STEP_IRQ;
/// The alarm comes after so long, and within so long, s: nothing was taken for 100 ms, and the main
/// loop looks every 20 ms.
const NOT_BEFORE: f64 = 0.09;
const NOT_AFTER: f64 = 0.13;

pub(crate) fn no_step_interrupt(firmware: &Firmware) -> Result<Figures, Failure> {
    let deaf = Build {
        fault: Some(Fault {
            register: NVIC_ISER,
            tamper: |word| Some(word & !STEPS),
        }),
        ..firmware.build("usual")?.clone()
    };
    let mut bench = Bench::boot(&deaf)?;
    bench.command("G1X10F600")?;
    bench.run_for(NOT_BEFORE)?;
    let early = bench.heard();
    ensure(early.is_empty(), || format!("too early: {early:?}"))?;
    let heard = bench.hear_until(NOT_AFTER - NOT_BEFORE, |line| {
        line == "[MSG:The step interrupt does not come: nothing moves]"
    })?;
    ensure(heard.iter().any(|line| line == "ALARM:3"), || {
        format!("no alarm: {heard:?}")
    })?;
    let steps = bench.pins.steps.len();
    ensure(steps == 0, || format!("{steps} steps"))?;
    let mut figures = Figures::default();
    figures.add("no step interrupt", format!("{heard:?}"));
    Ok(figures)
}
