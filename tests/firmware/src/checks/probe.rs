//! The probe: the position that it latches.
use super::Figures;
use crate::{
    bench::{ensure, Bench, Failure},
    desk,
    firmware::Firmware,
    pins::PROBE,
};

/// 250 steps/mm; Z up to 50 000 steps/s.
const SETTINGS: &str = "$0=5\n$701=0\n$102=250\n$112=12000\n$122=1000\n";
/// Probing lines, each with the steps to the contact: a slow one, and the cruise of faster ones.
const PROBINGS: [(&str, usize); 3] = [
    ("G38.2Z-20F60", 100),
    ("G38.3Z-60F3000", 1501),
    ("G38.2Z-200F12000", 7003),
];
/// The instants of the contact between two steps, in sixteenths of the interval.
const PLACES: [u64; 4] = [2, 5, 10, 14];

/// The machine's report of a probing that meets something between the steps `contact` and `contact
/// + 1`, `place` sixteenths of the interval after the first.
fn report(bench: &Bench, line: &str, contact: usize, place: u64) -> Result<Vec<String>, Failure> {
    // A clone shows when the steps will come: the emulator does the same in every run.
    let mut ahead = bench.clone();
    ahead.send(format!("{line}\n"));
    while ahead.pins.steps.len() <= contact {
        ahead.run_for(0.001)?;
    }
    let (before, after) = (
        ahead.pins.steps[contact - 1].edge(),
        ahead.pins.steps[contact].edge(),
    );
    let edge = before + (after - before) * place / 16;
    let mut bench = bench.clone();
    bench.machine.pin_at(edge, PROBE, false);
    let mut heard = bench.say(line)?;
    let touched = bench
        .pins
        .steps
        .iter()
        .filter(|step| step.edge() <= edge)
        .count();
    ensure(touched == contact, || {
        format!("{touched} steps before the contact, not {contact}")
    })?;
    heard.retain(|line| line.starts_with("[PRB:"));
    Ok(heard)
}

pub(crate) fn probe(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut bench = Bench::boot(firmware.build("usual")?)?;
    bench.commands(SETTINGS)?;
    bench.cold();
    bench.pins.clear();
    let mut figures = Figures::default();
    for (line, contact) in PROBINGS {
        let expected = desk::probe(SETTINGS, &format!("{line}\n"), contact)?;
        for place in PLACES {
            let found = report(&bench, line, contact, place)?;
            ensure(found == [expected.as_str()], || {
                format!("{line}: contact at {place}/16 after step {contact}: {found:?}, the simulator says {expected}")
            })?;
        }
        figures.add(line, expected);
    }
    Ok(figures)
}
