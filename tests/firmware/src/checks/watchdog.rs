//! The watchdog: at its slowest it acts in time, and at its fastest never in normal work.
use super::{
    planting::{hear_restart, plant, plant_in_step_interrupt, went_on, Event, FOR_EVER, INSTANTS},
    stopping::{ensure_safe, move_off},
    Figures,
};
use crate::{
    bench::{cycles, ensure, Bench, Failure},
    firmware::{Build, Firmware},
    pins::CPU_HZ,
    stream::Stream,
};
use leadscrew_f407emu::{LSI_FASTEST_HZ, LSI_SLOWEST_HZ};

/// The longest time from the event to the last step edge and to laser off, µs.
const HUNG_US: f64 = 50_000.0;

/// Makes something hang while the watchdog is at its slowest. Returns how long steps and laser went
/// on, µs.
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
    went_on(&bench, began, CPU_HZ as f64)
}

pub(crate) fn watchdog(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let main_loop: Event = |bench, _| plant(bench, &FOR_EVER);
    let step_interrupt: Event = |bench, _| plant_in_step_interrupt(bench, &FOR_EVER);
    for (name, what) in [
        ("the main loop", main_loop),
        ("the step interrupt", step_interrupt),
    ] {
        for seconds in INSTANTS {
            let (steps, laser) = hang(firmware.build("usual")?, seconds, what)?;
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

/// A debugger halts the core while the watchdog is at its slowest: the laser must be off in time
/// all the same.
pub(crate) fn halted(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    for seconds in INSTANTS {
        let mut bench = Bench::switch_on(firmware.build("usual")?)?;
        bench.machine.set_lsi(LSI_SLOWEST_HZ);
        let mut bench = move_off(bench, seconds)?;
        let began = bench.machine.cycle();
        bench.machine.halt(2 * cycles(HUNG_US * 1e-6));
        bench.run_for(0.0)?;
        let (steps, laser) = went_on(&bench, began, CPU_HZ as f64)?;
        ensure(steps.max(laser) <= HUNG_US, || {
            format!("the laser is off after {:.1} ms only", laser / 1e3)
        })?;
        figures.add(
            format!("halted after {seconds} s"),
            format!("laser off after {:.1} ms", laser / 1e3),
        );
    }
    Ok(figures)
}

/// Does everything that keeps the main loop busy: settings, reports, a stream of short moves, a
/// dwell.
pub(crate) fn normal_work(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut bench = Bench::switch_on(firmware.build("fast")?)?;
    bench.machine.set_lsi(LSI_FASTEST_HZ);
    bench.hear_banner()?;
    bench.cold();
    // The flash is as slow as the data sheet allows (table 40).
    bench.machine.timing_mut().program_us = 100;
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
