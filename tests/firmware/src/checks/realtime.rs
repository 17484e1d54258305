//! What must happen at once: a reset that comes in while motors step.
use super::{
    stopping::{last_step, moving, power_off},
    Figures,
};
use crate::{
    bench::{ensure, micros_between, Bench, Failure},
    firmware::Firmware,
    pins::LINE,
};

/// From the last bit of a reset (0x18) to the last step edge at most, µs.
const RESET_US: f64 = 1_000.0;
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

pub(crate) fn reset_byte(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    for seconds in INSTANTS {
        let mut bench = moving(&firmware.usual, seconds)?;
        let arrived = send_and_arrive(&mut bench, 0x18)?;
        bench.hear_banner()?;
        bench.run_for(0.3)?;
        let stopped = micros_between(arrived, last_step(&bench));
        let off = micros_between(arrived, power_off(&bench)?);
        figures.add(
            format!("0x18 after {seconds} s"),
            format!("last step edge {stopped:.1} us later, laser off {off:.1} us later"),
        );
        ensure(stopped <= RESET_US && off <= RESET_US, || {
            format!("steps or power go on\n{figures}")
        })?;
    }
    Ok(figures)
}
