//! From reset to work: when the pins are driven, and what happens if the crystal does not start.
use super::{motion, Figures};
use crate::{
    bench::{ensure, Bench, Failure},
    compare, desk,
    firmware::{Build, Firmware},
    job::Job,
    pins::CRYSTAL_HZ,
    wiring::{FAN, HEATERS, OUTPUT},
};
use leadscrew_f407emu::Pin;
use leadscrew_sim::Rate;
use object::{Object, ObjectSymbol};

/// The clock from reset on, Hz: the internal oscillator.
const INTERNAL_HZ: f64 = 16e6;
/// The longest time from reset until a pin that could do harm is driven low, µs.
const DRIVEN_US: f64 = 20.0;
/// Cycles between two looks at the pins afterwards, up to the banner.
const LOOK: u64 = 1_000;

fn is_off(bench: &Bench, pin: Pin) -> bool {
    bench.machine.drives(pin) && !bench.machine.level(pin)
}

/// The time after reset at which a pin is first driven, µs; `latest_us` at most.
fn first_driven(build: &Build, pin: Pin, latest_us: f64) -> Result<f64, Failure> {
    let mut bench = Bench::switch_on(build)?;
    while !is_off(&bench, pin) {
        let passed_us = bench.machine.cycle() as f64 * 1e6 / INTERNAL_HZ;
        ensure(passed_us <= latest_us, || {
            format!("{pin} floats for more than {latest_us} us")
        })?;
        ensure(!bench.machine.drives(pin), || format!("{pin} is high"))?;
        bench.run_to(bench.machine.cycle() + 1)?;
    }
    Ok(bench.machine.cycle() as f64 * 1e6 / INTERNAL_HZ)
}

/// Checks that the pins that could do harm, and the `further` ones, are off from the time when they
/// are first driven until the banner.
pub(super) fn ensure_off_at_once(build: &Build, further: &[Pin]) -> Result<String, Failure> {
    ensure_off_within(build, further, DRIVEN_US)
}

/// As [`ensure_off_at_once`], with another longest time until the pins are driven, µs.
pub(super) fn ensure_off_within(
    build: &Build,
    further: &[Pin],
    driven_us: f64,
) -> Result<String, Failure> {
    let wiring = build.wiring;
    let motors = wiring.step.iter().chain(wiring.direction);
    let motors = motors.chain(wiring.lines.iter().flatten());
    let pins: Vec<Pin> = motors
        .chain([&wiring.power, &wiring.spindle])
        .chain(further)
        .copied()
        .collect();
    let power = first_driven(build, wiring.power, driven_us)?;
    let mut last = power;
    for pin in &pins {
        last = last.max(first_driven(build, *pin, driven_us)?);
    }
    let mut bench = Bench::switch_on(build)?;
    bench.run_to((driven_us * INTERNAL_HZ / 1e6) as u64)?;
    while bench.heard().is_empty() {
        let on = pins.iter().find(|pin| !is_off(&bench, **pin));
        ensure(on.is_none(), || {
            format!("{on:?} is not off before the banner")
        })?;
        bench.run_to(bench.machine.cycle() + LOOK)?;
    }
    Ok(format!(
        "power is driven after {power:.1} us, the last pin after {last:.1} us"
    ))
}

pub(crate) fn pins(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let (prototyper, printer) = (
        firmware.build("machine-file-001")?,
        firmware.build("machine-file-004")?,
    );
    let [nozzle, bed] = HEATERS;
    for (name, build, further) in [
        ("discovery", firmware.build("usual")?, &[][..]),
        ("machine-003", firmware.build("machine-003")?, &[]),
        ("dual-y", firmware.build("dual-y")?, &[]),
        ("machine 001", prototyper, &[OUTPUT, nozzle, bed]),
        ("machine 004", printer, &[FAN, nozzle, bed]),
    ] {
        let words = ensure_off_at_once(build, further);
        figures.add(
            name,
            words.map_err(|Failure(words)| Failure(format!("{name}: {words}")))?,
        );
    }
    Ok(figures)
}

/// Where SRAM begins.
const SRAM: u64 = 0x2000_0000;
/// The machine's message about a crystal that does not start.
const NO_CRYSTAL: &str = "[MSG:the crystal does not start: times are exact to 1 %, no USB]";
/// The least share of the time at rest in which the core must sleep.
const ASLEEP: f64 = 0.95;

/// Without a crystal the machine must say so, and do the job all the same.
pub(crate) fn crystal(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut bench = Bench::switch_on_with(firmware.build("usual")?, 0)?;
    let heard = bench.hear_banner()?;
    ensure(heard.iter().any(|line| line == NO_CRYSTAL), || {
        format!("says {heard:?}")
    })?;
    let job = Job::trace("line_xyz")?;
    let steps = motion::run_queued_on(&mut bench, &job)?;
    let settings = format!("{}{}", job.settings, motion::AFTER_ALL);
    compare::to_the_tick(
        &steps,
        &desk::plan(&settings, &job.program, Rate::NeverWaits)?,
    )?;
    let mut with = Bench::switch_on_with(firmware.build("usual")?, CRYSTAL_HZ)?;
    let heard = with.hear_banner()?;
    ensure(heard.iter().all(|line| line != NO_CRYSTAL), || {
        format!("says {heard:?}")
    })?;
    let mut figures = Figures::default();
    figures.add(
        "none fitted",
        format!("{NO_CRYSTAL}, {} step events to the tick", steps.len()),
    );
    Ok(figures)
}

/// The number of bytes logged so far: the write offset of RTT's first channel. SEGGER's control
/// block has 16 bytes of name and two counts; a channel has its name, its buffer, the buffer's
/// size, and then this offset.
fn logged(bench: &Bench, elf: &[u8]) -> Result<u32, Failure> {
    const WRITTEN: usize = 16 + 2 * 4 + 3 * 4;
    let file = object::File::parse(elf)?;
    let block = file
        .symbols()
        .find(|symbol| symbol.name() == Ok("_SEGGER_RTT"));
    let block = block.ok_or_else(|| Failure("the ELF has no log".into()))?;
    let place = usize::try_from(block.address() - SRAM)? + WRITTEN;
    let word = bench.machine.sram().get(place..place + 4);
    let word = word.and_then(|bytes| bytes.try_into().ok());
    word.map(u32::from_le_bytes)
        .ok_or_else(|| Failure("the log is not in SRAM".into()))
}

/// The log as probe-rs would show it: the board's name and clock, in at least four bytes.
pub(crate) fn log(firmware: &Firmware) -> Result<Figures, Failure> {
    let bench = Bench::boot(firmware.build("usual")?)?;
    let bytes = logged(&bench, &firmware.build("usual")?.elf)?;
    ensure(bytes >= 4, || {
        format!("{bytes} bytes are logged at start-up")
    })?;
    let mut figures = Figures::default();
    figures.add("bytes logged at start-up", bytes);
    Ok(figures)
}

/// At rest the core sleeps.
pub(crate) fn sleep(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut bench = Bench::boot(firmware.build("usual")?)?;
    bench.run_for(0.1)?;
    let (began, slept) = (bench.machine.cycle(), bench.machine.slept());
    bench.run_for(1.0)?;
    let passed = (bench.machine.cycle() - began) as f64;
    let share = (bench.machine.slept() - slept) as f64 / passed;
    let mut figures = Figures::default();
    figures.add(
        "asleep at rest",
        format!("{:.1} % of the time", 100.0 * share),
    );
    ensure(share >= ASLEEP, || figures.to_string())?;
    Ok(figures)
}
