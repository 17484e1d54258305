//! Ways in which the program ends. The outputs must be made safe, the chip is reset, and the next
//! boot says why.
use super::{
    planting::{hear_restart, jump, panic_site, plant, went_on, Event, INSTANTS},
    stopping::{ensure_safe, last_step, moving, power_edge},
    Figures,
};
use crate::{
    bench::{ensure, Bench, Failure},
    firmware::{Build, Firmware},
    pins::POWER,
};
use leadscrew_f407emu::{Cause, ResetCause};

/// The longest time from the event to the last step edge and to laser off if a handler of the
/// firmware stops them, µs.
const HANDLED_US: f64 = 10.0;

/// The supply that the flash needs (docs/hardware.md), at which all goes on; the supply below which
/// every chip's detector sees it as low (data sheet, table 19); the lowest supply at which a board
/// of 3.0 V starts, mV.
const FLASH_NEEDS_MV: u32 = 2_700;
const LOW_MV: u32 = 2_580;
const LOWEST_START_MV: u32 = 2_900;

/// An event, and the message of the machine at the next boot.
struct Ending {
    name: &'static str,
    cause: Event,
    /// The clock of the CPU after the event, Hz.
    hz: f64,
    says: &'static str,
    /// The beginning of the second message, if there is one.
    place: Option<&'static str>,
}

const FULL_SPEED: f64 = 168e6;
/// The frequency of the internal oscillator, which takes over when the crystal stops, Hz.
const INTERNAL: f64 = 16e6;

const ENDINGS: [Ending; 7] = [
    Ending {
        name: "a panic",
        cause: |bench, build| plant(bench, &panics(build)?),
        hz: FULL_SPEED,
        says: "[MSG:a fault in the program]",
        place: Some(".rs line "),
    },
    Ending {
        name: "an instruction that is none",
        cause: |bench, _| plant(bench, &[0xDE00]), // udf
        hz: FULL_SPEED,
        says: "[MSG:a fault of the processor]",
        place: Some("status 0x00010000"),
    },
    Ending {
        name: "an address where nothing is",
        // movw r0, #0; movt r0, #0x6000; ldr r0, [r0]
        cause: |bench, _| plant(bench, &[0xF240, 0x0000, 0xF2C6, 0x0000, 0x6800]),
        hz: FULL_SPEED,
        says: "[MSG:a fault of the processor]",
        place: Some("status 0x00008200"),
    },
    Ending {
        name: "a jump to nowhere",
        // mov.w r0, #0x20000000; bx r0: not a Thumb address
        cause: |bench, _| plant(bench, &[0xF04F, 0x5000, 0x4700]),
        hz: FULL_SPEED,
        says: "[MSG:a fault of the processor]",
        place: Some("status 0x00020000"),
    },
    Ending {
        name: "a stack that is full",
        // movw r0, #0x10; movt r0, #0x1000; mov sp, r0; push {r0-r7}: the stack ends at 0x10000000
        cause: |bench, _| plant(bench, &[0xF240, 0x0010, 0xF2C1, 0x0000, 0x4685, 0xB4FF]),
        hz: FULL_SPEED,
        says: "[MSG:the stack was full]",
        place: None,
    },
    Ending {
        name: "the crystal stops",
        cause: |bench, _| {
            let now = bench.machine.cycle();
            bench.machine.crystal_stops_at(now + 100);
            bench.run_to(now + 100)?;
            Ok(None)
        },
        hz: INTERNAL,
        says: "[MSG:the crystal stopped]",
        place: None,
    },
    Ending {
        name: "the supply is low for 0.1 s",
        cause: |bench, _| {
            let now = bench.machine.cycle();
            for (cycles, millivolts) in [(0, FLASH_NEEDS_MV), (100, LOW_MV), (16_800_000, 3_300)] {
                bench.machine.supply_at(now + cycles, millivolts);
            }
            bench.run_to(now + 90)?;
            ensure(bench.machine.level(POWER), || "dark too early".into())?;
            bench.run_to(now + 100)?;
            Ok(None)
        },
        hz: FULL_SPEED,
        says: "[MSG:the supply voltage was low]",
        place: None,
    },
];

/// A jump to a panic of the program.
pub(super) fn panics(build: &Build) -> Result<[u16; 4], Failure> {
    Ok(jump(panic_site(&build.elf)?))
}

/// Checks that the place of the end is told, at the next start and by `$I`.
fn ensure_place(bench: &mut Bench, ending: &Ending, heard: &[String]) -> Result<(), Failure> {
    let mut behind = heard.iter().skip_while(|line| *line != ending.says).skip(1);
    let told = behind.next().filter(|line| line.starts_with("[MSG:"));
    let is_told = match (ending.place, told) {
        (None, None) => true,
        (Some(place), Some(told)) => told.contains(place),
        _ => false,
    };
    ensure(is_told, || format!("says {heard:?}"))?;
    let of_event = |line: &String| {
        let words = line.strip_prefix("[LAST END:");
        let reason = ending
            .says
            .trim_start_matches("[MSG:")
            .trim_end_matches(']');
        words.is_some_and(|words| {
            words.starts_with(reason) && words.contains(ending.place.unwrap_or_default())
        })
    };
    let asked = bench.command("$I")?;
    ensure(asked.len() == 3 && asked.iter().any(of_event), || {
        format!("$I: {asked:?}")
    })
}

/// Makes the event happen in full motion. Returns how long steps and laser went on, µs.
fn end(build: &Build, ending: &Ending, seconds: f64) -> Result<(f64, f64), Failure> {
    let mut bench = moving(build, seconds)?;
    bench.cold();
    let replaced = (ending.cause)(&mut bench, build)?;
    let began = bench.machine.cycle();
    let heard = hear_restart(&mut bench, replaced)?;
    ensure(heard.iter().any(|line| line == ending.says), || {
        format!("says {heard:?}")
    })?;
    let reset = bench.machine.resets().last().copied();
    let (reset, why) = reset.ok_or_else(|| Failure("no reset".into()))?;
    ensure(why == ResetCause::Software, || format!("reset by {why:?}"))?;
    let off = power_edge(&bench)?;
    ensure(
        off.cycle < reset && matches!(off.cause, Cause::Core(_)),
        || format!("the reset switches the laser off, not the handler: {off:?}"),
    )?;
    ensure_safe(&bench)?;
    let (steps, laser) = went_on(&bench, began, ending.hz)?;
    ensure(steps.max(laser) <= HANDLED_US, || {
        format!("steps go on for {steps:.1} us, the laser for {laser:.1} us")
    })?;
    ensure_place(&mut bench, ending, &heard)?;
    let reset = |bench: &mut Bench, cause| {
        bench.machine.reset_at(bench.machine.cycle() + 100, cause);
        bench.run_for(0.001)?;
        let again = bench.hear_boot()?;
        ensure(!again.iter().any(|line| line == ending.says), || {
            "says it twice".into()
        })?;
        bench.command("$I")
    };
    let later = reset(&mut bench, ResetCause::Pin)?;
    ensure(later.len() == 3, || format!("$I after a reset: {later:?}"))?;
    let later = reset(&mut bench, ResetCause::PowerOn)?;
    ensure(later.len() == 2, || format!("$I after power-up: {later:?}"))?;
    Ok((steps, laser))
}

pub(crate) fn endings(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let mut bench = Bench::switch_on(firmware.build("usual")?)?;
    bench.machine.supply_at(0, LOWEST_START_MV);
    let heard = bench.hear_banner();
    heard.map_err(|failure| Failure(format!("at {LOWEST_START_MV} mV: {failure}")))?;
    for ending in &ENDINGS {
        let mut worst = (0f64, 0f64);
        for seconds in INSTANTS {
            let found = end(firmware.build("usual")?, ending, seconds);
            let found = found.map_err(|failure| Failure(format!("{}: {failure}", ending.name)))?;
            worst = (worst.0.max(found.0), worst.1.max(found.1));
        }
        figures.add(
            ending.name,
            format!(
                "last step edge after {:.1} us, laser off after {:.1} us; {}",
                worst.0, worst.1, ending.says
            ),
        );
    }
    Ok(figures)
}

/// Resets from outside, each with the machine's message, if it has one.
const RESETS: [(ResetCause, Option<&str>); 3] = [
    (ResetCause::Pin, None),
    (ResetCause::PowerOn, None),
    (
        ResetCause::BrownOut,
        Some("[MSG:the supply voltage was low]"),
    ),
];

pub(crate) fn resets(firmware: &Firmware) -> Result<Figures, Failure> {
    let base = moving(firmware.build("usual")?, 0.1)?;
    let mut figures = Figures::default();
    for (cause, says) in RESETS {
        let mut bench = base.clone();
        let reset = bench.machine.cycle() + 1_000;
        let said = says_after(&mut bench, cause, reset)?;
        ensure(said.as_deref() == says, || format!("{cause:?}: {said:?}"))?;
        ensure(
            last_step(&bench) <= reset && power_edge(&bench)?.cycle <= reset,
            || format!("{cause:?}: something goes on after it"),
        )?;
        ensure_safe(&bench)?;
        // The chip keeps the causes of resets until the program clears them.
        let later = bench.machine.cycle() + 1_000;
        let said = says_after(&mut bench, ResetCause::Pin, later)?;
        ensure(said.is_none(), || {
            format!("{cause:?}, and another reset: {said:?}")
        })?;
        figures.add(format!("{cause:?}"), says.unwrap_or("nothing is said"));
    }
    Ok(figures)
}

/// Resets the chip at a cycle. Returns the message with which it starts, if it has one.
fn says_after(bench: &mut Bench, cause: ResetCause, cycle: u64) -> Result<Option<String>, Failure> {
    bench.machine.reset_at(cycle, cause);
    bench.run_to(cycle + 100)?;
    let heard = bench.hear_boot()?;
    Ok(heard.into_iter().find(|line| line.starts_with("[MSG:")))
}
