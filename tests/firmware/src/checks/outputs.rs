//! The outputs that switch slowly: spindle, coolant, enable.
use super::Figures;
use crate::{
    bench::{ensure, Bench, Failure},
    firmware::Firmware,
    pins::{ENABLE, FLOOD, MIST, POWER, REVERSE, SPINDLE},
};
use leadscrew_f407emu::Pin;

/// Lines, and the pins that are high after each.
const WORDS: [(&str, &[Pin]); 9] = [
    ("$1=25", &[ENABLE]),
    ("M3S1000", &[ENABLE, POWER, SPINDLE]),
    ("M4", &[ENABLE, POWER, SPINDLE, REVERSE]),
    ("M5", &[ENABLE]),
    ("M8", &[ENABLE, FLOOD]),
    ("M7", &[ENABLE, FLOOD, MIST]),
    ("M9", &[ENABLE]),
    ("$1=255", &[ENABLE]),
    ("G91G1X0.1F600", &[]),
];
const PINS: [Pin; 6] = [ENABLE, POWER, SPINDLE, REVERSE, FLOOD, MIST];

/// Speeds of the spindle, of 1000, each with the cycles of a 100 µs period during which the pin is
/// high. The least duty is a 255th.
const POWERS: [(u32, u64); 4] = [(1, 64), (250, 4_200), (500, 8_400), (999, 16_782)];
const PERIOD: u64 = 16_800;

/// Power is a share of the period: 8400 levels, two cycles each.
fn ensure_power(bench: &mut Bench) -> Result<(), Failure> {
    bench.commands("$30=1000\n$31=0\nM3\n")?;
    for (speed, high) in POWERS {
        bench.command(&format!("S{speed}"))?;
        bench.run_for(0.01)?;
        let duties = bench.machine.duties().iter().rev();
        let duty = duties.into_iter().find(|duty| duty.pin == POWER);
        let right = duty.is_some_and(|duty| duty.period == PERIOD && duty.high.abs_diff(high) <= 2);
        ensure(right, || {
            format!("S{speed}: {duty:?}, not {high} of {PERIOD}")
        })?;
    }
    bench.command("M5")?;
    Ok(())
}

pub(crate) fn outputs(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut bench = Bench::boot(firmware.build("usual")?)?;
    ensure_power(&mut bench)?;
    for (words, expected) in WORDS {
        bench.command(words)?;
        bench.run_for(0.05)?;
        for pin in PINS {
            let high = bench.machine.level(pin);
            ensure(high == expected.contains(&pin), || {
                format!(
                    "{pin} is {} after {words}",
                    if high { "high" } else { "low" }
                )
            })?;
        }
    }
    let mut figures = Figures::default();
    figures.add("lines", WORDS.len());
    figures.add("shares of power", POWERS.len());
    Ok(figures)
}
