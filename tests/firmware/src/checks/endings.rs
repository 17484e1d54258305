//! Ways in which the program ends: the outputs are made safe, the chip is reset, and the next boot says why.
use super::{
    stopping::{ensure_safe, last_step, move_off, moving, power_edge},
    Figures,
};
use crate::{
    bench::{cycles, ensure, Bench, Failure},
    firmware::{Build, Firmware},
    pins::STEP_IRQ,
    stream::Stream,
};
use leadscrew_f407emu::{Cause, ResetCause, LSI_FASTEST_HZ, LSI_SLOWEST_HZ};
use object::{Object, ObjectSymbol};

/// From the event to the last step edge and to laser off at most, where a handler of the firmware sees to it, µs.
const HANDLED_US: f64 = 10.0;
/// The same where the watchdog does, µs.
const HUNG_US: f64 = 50_000.0;
/// The longest that a reset may take to come, s.
const RESET_SECONDS: f64 = 0.1;
/// Where the flash begins.
const FLASH: u32 = 0x0800_0000;
/// Instants after the start at which it happens, s: in the ramp and in the cruise.
const INSTANTS: [f64; 2] = [0.03, 0.4007];

/// Makes something happen in a few cycles; what it has replaced for that in the program.
type Event = fn(&mut Bench, &Build) -> Result<Option<Replaced>, Failure>;

/// Bytes of the program as they were.
struct Replaced {
    address: u32,
    bytes: Vec<u8>,
}

/// An event, and what the machine says of it when it is back.
struct Ending {
    name: &'static str,
    cause: Event,
    /// The clock of the CPU from then on, Hz.
    hz: f64,
    says: &'static str,
}

const FULL_SPEED: f64 = 168e6;
/// The internal oscillator's, which takes over.
const INTERNAL: f64 = 16e6;

const ENDINGS: [Ending; 7] = [
    Ending {
        name: "a panic",
        cause: |bench, build| plant(bench, &jump(panic_handler(&build.elf)?)),
        hz: FULL_SPEED,
        says: "[MSG:a fault in the program]",
    },
    Ending {
        name: "an instruction that is none",
        cause: |bench, _| plant(bench, &[0xDE00]), // udf
        hz: FULL_SPEED,
        says: "[MSG:a fault of the processor]",
    },
    Ending {
        name: "an address where nothing is",
        // movw r0, #0; movt r0, #0x6000; ldr r0, [r0]
        cause: |bench, _| plant(bench, &[0xF240, 0x0000, 0xF2C6, 0x0000, 0x6800]),
        hz: FULL_SPEED,
        says: "[MSG:a fault of the processor]",
    },
    Ending {
        name: "a jump to nowhere",
        // mov.w r0, #0x20000000; bx r0: not a Thumb address
        cause: |bench, _| plant(bench, &[0xF04F, 0x5000, 0x4700]),
        hz: FULL_SPEED,
        says: "[MSG:a fault of the processor]",
    },
    Ending {
        name: "a stack that is full",
        // movw r0, #0x10; movt r0, #0x1000; mov sp, r0; push {r0-r7}: the stack ends at 0x10000000
        cause: |bench, _| plant(bench, &[0xF240, 0x0010, 0xF2C1, 0x0000, 0x4685, 0xB4FF]),
        hz: FULL_SPEED,
        says: "[MSG:the stack was full]",
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
    },
    Ending {
        name: "the supply is low for 0.1 s",
        cause: |bench, _| {
            let now = bench.machine.cycle();
            bench.machine.supply_at(now + 100, true);
            bench.machine.supply_at(now + 16_800_000, false);
            bench.run_to(now + 100)?;
            Ok(None)
        },
        hz: FULL_SPEED,
        says: "[MSG:the supply voltage was low]",
    },
];

/// Replaces the instructions that the main loop carries out next, the next time that it sleeps.
fn plant(bench: &mut Bench, halfwords: &[u16]) -> Result<Option<Replaced>, Failure> {
    let end = bench.machine.cycle() + 1_680_000;
    while !bench.machine.is_asleep() {
        ensure(bench.machine.cycle() < end, || {
            "the main loop never sleeps".into()
        })?;
        bench.run_to(bench.machine.cycle() + 1)?;
    }
    let address = bench.machine.pc();
    replace(bench, address, halfwords)
}

fn replace(
    bench: &mut Bench,
    address: u32,
    halfwords: &[u16],
) -> Result<Option<Replaced>, Failure> {
    // A literal that is loaded must be on a word.
    let nop = (!address.is_multiple_of(4)).then_some(&0xBF00);
    let bytes: Vec<u8> = nop
        .into_iter()
        .chain(halfwords)
        .flat_map(|half| half.to_le_bytes())
        .collect();
    let offset = usize::try_from(address.wrapping_sub(FLASH))?;
    let before = bench.machine.flash().get(offset..offset + bytes.len());
    let before = before.ok_or_else(|| Failure(format!("{address:#x} is not in the flash")))?;
    let replaced = Replaced {
        address,
        bytes: before.to_vec(),
    };
    bench.machine.program_flash(address, &bytes);
    Ok(Some(replaced))
}

/// Waits for the reset, puts the program right, and hears what the machine says.
fn hear_restart(bench: &mut Bench, replaced: Option<Replaced>) -> Result<Vec<String>, Failure> {
    let end = bench.machine.cycle() + cycles(RESET_SECONDS);
    while bench.machine.resets().is_empty() {
        ensure(bench.machine.cycle() < end, || {
            format!("no reset; at {:#x}", bench.machine.pc())
        })?;
        bench.run_to(bench.machine.cycle() + 100)?;
    }
    if let Some(replaced) = replaced {
        bench
            .machine
            .program_flash(replaced.address, &replaced.bytes);
    }
    bench.hear_boot()
}

/// `ldr r0, [pc]; bx r0` and the address.
fn jump(to: u32) -> [u16; 4] {
    let to = to | 1;
    [0x4800, 0x4700, to as u16, (to >> 16) as u16]
}

/// Where the handler of panics is.
fn panic_handler(elf: &[u8]) -> Result<u32, Failure> {
    let file = object::File::parse(elf)?;
    let mut symbols = file.symbols();
    let symbol = symbols.find(|symbol| {
        let name = symbol.name().unwrap_or_default();
        name.contains("rust_begin_unwind")
    });
    let symbol = symbol.ok_or_else(|| Failure("the ELF has no handler of panics".into()))?;
    Ok(u32::try_from(symbol.address())? & !1)
}

/// How long steps and laser went on after `began`, µs.
fn went_on(bench: &Bench, began: u64, hz: f64) -> Result<(f64, f64), Failure> {
    let micros = |cycle: u64| cycle.saturating_sub(began) as f64 * 1e6 / hz;
    Ok((micros(last_step(bench)), micros(power_edge(bench)?.cycle)))
}

/// Lets something happen in full motion; how long steps and laser went on.
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
    bench
        .machine
        .reset_at(bench.machine.cycle() + 100, ResetCause::Pin);
    bench.run_for(0.001)?;
    let again = bench.hear_boot()?;
    ensure(!again.iter().any(|line| line == ending.says), || {
        "says it twice".into()
    })?;
    Ok((steps, laser))
}

pub(crate) fn endings(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    for ending in &ENDINGS {
        let mut worst = (0f64, 0f64);
        for seconds in INSTANTS {
            let found = end(&firmware.usual, ending, seconds);
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

/// Resets that come from outside, and what is said of them.
const RESETS: [(ResetCause, Option<&str>); 3] = [
    (ResetCause::Pin, None),
    (ResetCause::PowerOn, None),
    (
        ResetCause::BrownOut,
        Some("[MSG:the supply voltage was low]"),
    ),
];

pub(crate) fn resets(firmware: &Firmware) -> Result<Figures, Failure> {
    let base = moving(&firmware.usual, 0.1)?;
    let mut figures = Figures::default();
    for (cause, says) in RESETS {
        let mut bench = base.clone();
        let reset = bench.machine.cycle() + 1_000;
        bench.machine.reset_at(reset, cause);
        bench.run_to(reset + 100)?;
        let heard = bench.hear_boot()?;
        let said = heard.iter().find(|line| line.starts_with("[MSG:"));
        ensure(said.map(String::as_str) == says, || {
            format!("{cause:?}: says {heard:?}")
        })?;
        ensure(
            last_step(&bench) <= reset && power_edge(&bench)?.cycle <= reset,
            || format!("{cause:?}: something goes on after it"),
        )?;
        ensure_safe(&bench)?;
        figures.add(format!("{cause:?}"), says.unwrap_or("nothing is said"));
    }
    Ok(figures)
}

/// `b .`
const FOR_EVER: [u16; 1] = [0xE7FE];

/// Something hangs while the slowest watchdog counts; how long steps and laser went on.
fn hang(build: &Build, seconds: f64, what: Event) -> Result<(f64, f64), Failure> {
    let mut bench = Bench::switch_on(build)?;
    bench.machine.set_lsi(LSI_SLOWEST_HZ);
    let mut bench = move_off(bench, seconds)?;
    let replaced = what(&mut bench, build)?;
    let began = bench.machine.cycle();
    let heard = hear_restart(&mut bench, replaced)?;
    ensure(
        heard.iter().any(|line| line == "[MSG:the main loop hung]"),
        || format!("says {heard:?}"),
    )?;
    ensure_safe(&bench)?;
    went_on(&bench, began, FULL_SPEED)
}

pub(crate) fn watchdog(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let main_loop: Event = |bench, _| plant(bench, &FOR_EVER);
    let step_interrupt: Event = |bench, _| {
        let vector = (16 + usize::from(STEP_IRQ)) * 4;
        let handler = bench.machine.flash().get(vector..vector + 4);
        let handler = handler
            .and_then(|bytes| bytes.try_into().ok())
            .map_or(0, u32::from_le_bytes);
        replace(bench, handler & !1, &FOR_EVER)
    };
    for (name, what) in [
        ("the main loop", main_loop),
        ("the step interrupt", step_interrupt),
    ] {
        for seconds in INSTANTS {
            let (steps, laser) = hang(&firmware.usual, seconds, what)?;
            let words = format!(
                "last step edge after {:.1} ms, laser off after {:.1} ms",
                steps / 1e3,
                laser / 1e3
            );
            figures.add(format!("{name} hangs after {seconds} s"), words);
            ensure(steps.max(laser) <= HUNG_US, || {
                format!("not safe in time\n{figures}")
            })?;
        }
    }
    figures.add("LSI", format!("{LSI_SLOWEST_HZ} Hz"));
    Ok(figures)
}

/// Everything that keeps the main loop busy: settings, reports, a stream of short moves, a dwell.
pub(crate) fn normal_work(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut bench = Bench::switch_on(&firmware.fast)?;
    bench.machine.set_lsi(LSI_FASTEST_HZ);
    bench.hear_banner()?;
    bench.cold();
    bench.commands("$RST=*\n$$\n$#\n$N0=G54\n$N1=G21\n$I\n$10=3\n$G\n")?;
    bench.commands("$100=250\n$101=250\n$110=12000\n$111=12000\n$120=4000\n$121=4000\nG4P0.3\n")?;
    let chords: String = (0..1500)
        .map(|index| {
            let (x, y) = (f64::from(index % 7) * 0.05, f64::from(index % 5) * 0.05);
            format!("G1X{x:.3}Y{y:.3}F6000\n")
        })
        .collect();
    bench.stream(&Stream::new(&chords).polling(0.05))?;
    bench.commands("G90G0X0Y0\nG2X0Y0I20F9000\nG4P0.1\n")?;
    bench.wait_for("Idle", 60.0)?;
    ensure(bench.machine.resets().is_empty(), || {
        format!("{:?}", bench.machine.resets())
    })?;
    let mut figures = Figures::default();
    figures.add(
        format!("settings, reports, 1500 chords, an arc, dwells; LSI {LSI_FASTEST_HZ} Hz"),
        "no reset",
    );
    Ok(figures)
}
