//! From reset to work: when the pins are driven, and what happens if the crystal does not start.
use super::{motion, Figures};
use crate::{
    bench::{cycles, ensure, Bench, Failure},
    compare, desk,
    firmware::{Build, Firmware},
    job::Job,
    pins::{CRYSTAL_HZ, ENABLE},
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
/// The longest time until the banner, s: a sector may be erased before.
const BANNER_SECONDS: f64 = 2.0;

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
    let end = cycles(BANNER_SECONDS);
    while bench.heard().is_empty() {
        ensure(bench.machine.cycle() < end, || "no banner".into())?;
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

/// The first address of SRAM.
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
    for mhz in OTHER_CRYSTALS {
        let mut bench = Bench::switch_on_with(firmware.build("usual")?, mhz * 1_000_000)?;
        let heard = bench.hear_banner()?;
        let says = format!(
            "[MSG:the crystal has {mhz} MHz, the board's file says 8: times are exact to 1 %, no USB]"
        );
        ensure(heard.contains(&says), || format!("{mhz} MHz: {heard:?}"))?;
        figures.add(format!("{mhz} MHz fitted"), says);
    }
    Ok(figures)
}

/// Crystals that boards of this chip have, in place of the 8 MHz of the board's file, MHz.
const OTHER_CRYSTALS: [u32; 4] = [4, 12, 16, 25];

/// The message on a chip that is none of the firmware's.
const ANOTHER_CHIP: &str = "[MSG:This chip is no STM32F407, locked: flash the firmware of its own]";
/// Device numbers of an STM32F446 (RM0390 section 33.6.1) and of an STM32F429 (RM0090 section
/// 38.6.1): boards that come with either chip have them, and the registers of both are alike so far.
const OTHERS: [u16; 2] = [0x421, 0x419];
/// The number of an F407, and the one that its revision A says.
const OURS: [u16; 2] = [0x413, 0x411];
/// Lines that would drive pins.
const DRIVING: [&str; 6] = ["$X", "$1=255", "$4=1", "M3S1000", "G1X1F100", "$H"];

/// Another chip: no pin is driven but those with safe levels and the serial line's.
pub(crate) fn another_chip(firmware: &Firmware) -> Result<Figures, Failure> {
    let usual = firmware.build("usual")?;
    let boot = |number| {
        let mut bench = Bench::switch_on(usual)?;
        bench.machine.set_device_number(number);
        bench.hear_banner()?;
        Ok::<_, Failure>(bench)
    };
    for number in OTHERS {
        let mut bench = boot(number)?;
        bench.hear_until(0.1, |line| line == ANOTHER_CHIP)?;
        for line in DRIVING {
            bench.say(line)?;
            bench.run_for(0.05)?;
            ensure(!bench.machine.drives(ENABLE), || {
                format!("{number:#x}, {line}: {ENABLE} is driven")
            })?;
            let wiring = bench.wiring;
            let pins = wiring.step.iter().chain(wiring.direction);
            let mut pins = pins.chain([&wiring.power, &wiring.spindle]);
            let on = pins.find(|pin| !is_off(&bench, **pin));
            ensure(on.is_none(), || {
                format!("{number:#x}, {line}: {on:?} is not low")
            })?;
        }
    }
    for number in OURS {
        let mut bench = boot(number)?;
        bench.command("$1=255")?;
        bench.run_for(0.05)?;
        ensure(bench.machine.drives(ENABLE), || {
            format!("{number:#x}: {ENABLE} floats")
        })?;
    }
    let mut figures = Figures::default();
    figures.add("device numbers 0x421 and 0x419", ANOTHER_CHIP);
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
