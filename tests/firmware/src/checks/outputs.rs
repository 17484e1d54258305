//! The slow outputs: spindle, coolant, enable.
use super::Figures;
use crate::{
    bench::{ensure, Bench, Failure},
    firmware::Firmware,
    pins::{ENABLE, FLOOD, MIST, POWER, REVERSE, SPINDLE},
};
use leadscrew_f407emu::Pin;

/// Words, and the pins that are high after them.
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

pub(crate) fn outputs(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut bench = Bench::boot(&firmware.usual)?;
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
    Ok(figures)
}
