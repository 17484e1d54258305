//! What must happen at once: a reset that comes in while motors step.
use super::Figures;
use crate::{
    bench::{ensure, Bench, Failure},
    firmware::Firmware,
    pins::{CPU_HZ, LINE, POWER, STEP},
    steps::Step,
};
use leadscrew_f407emu::Pin;

/// From the last bit of a reset (0x18) to the last step edge at most, s.
const RESET: f64 = 1e-3;
/// Fast enough that the last step says when stepping stopped: 50 000 steps/s.
const SETTINGS: &str = "$0=5\n$32=1\n$30=1000\n$701=0\n$100=250\n$110=12000\n$120=4000\n";
const JOB: &str = "G91M3S800\nG1X400F12000\n";
/// Instants after the start at which it comes, s: in the ramp and in the cruise.
const INSTANTS: [f64; 4] = [0.02, 0.151, 0.4007, 0.77];
/// Cycles in which a byte's arrival is looked for.
const LOOK: u64 = 100;

/// Sends a byte and waits until its last bit has arrived; the cycle of that, too late by [`LOOK`] at most.
fn send_and_arrive(bench: &mut Bench, byte: u8) -> Result<u64, Failure> {
    bench.send([byte]);
    while bench.machine.uart_unsent(LINE) > 0 {
        bench.run_to(bench.machine.cycle() + LOOK)?;
    }
    Ok(bench.machine.cycle() - LOOK)
}

/// A laser that moves along X.
fn moving(elf: &[u8], seconds: f64) -> Result<Bench, Failure> {
    let mut bench = Bench::boot(elf)?;
    bench.machine.watch(POWER, false);
    bench.commands(SETTINGS)?;
    bench.commands(JOB)?;
    bench.run_for(seconds)?;
    ensure(bench.pins.steps.len() > 10, || "nothing moves".into())?;
    Ok(bench)
}

/// Seconds from `cycle` to the last step edge; 0 where there was none after it.
fn last_step_after(steps: &[Step], cycle: u64) -> f64 {
    let last = steps.last().map_or(0, Step::edge);
    last.saturating_sub(cycle) as f64 / CPU_HZ as f64
}

fn is_low(bench: &Bench, pins: &[Pin]) -> bool {
    pins.iter().all(|&pin| !bench.machine.level(pin))
}

pub(crate) fn reset_byte(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    for seconds in INSTANTS {
        let mut bench = moving(&firmware.elf, seconds)?;
        let arrived = send_and_arrive(&mut bench, 0x18)?;
        bench.hear_banner()?;
        bench.run_for(0.3)?;
        let stopped = last_step_after(&bench.pins.steps, arrived);
        let power = bench.machine.duties().last().map_or(0, |duty| duty.high);
        figures.add(
            format!("0x18 after {seconds} s"),
            format!("last step edge {:.1} us later", stopped * 1e6),
        );
        ensure(stopped <= RESET, || format!("steps go on\n{figures}"))?;
        ensure(power == 0 && is_low(&bench, &STEP), || {
            format!("power {power} after the reset")
        })?;
    }
    Ok(figures)
}
