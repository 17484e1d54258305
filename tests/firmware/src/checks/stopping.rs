//! Brings a laser into full motion, and finds when its steps and its light stopped. Checks that
//! stop it in some way use this file.
use crate::{
    bench::{ensure, Bench, Failure},
    firmware::Build,
    pins::{FLOOD, POWER, SPINDLE, STEP},
    steps::Step,
};
use leadscrew_f407emu::{Edge, Pin};

/// 50 000 steps/s, so that the last step shows exactly when stepping stopped. At full power the
/// laser's pin has no edges except on and off. Limit switches stop the machine.
const SETTINGS: &str = "$0=5\n$21=1\n$32=1\n$30=1000\n$701=0\n$100=250\n$110=12000\n$120=4000\n";
/// 400 mm at 250 steps/mm, with 2 s of cruise.
const JOB: &str = "G91M3M8S1000\nG1X400F12000\n";
/// Steps of the whole job.
pub(super) const STEPS: i64 = 100_000;
/// Time between two steps in the cruise, µs.
pub(super) const INTERVAL_US: f64 = 20.0;

/// A board whose laser has been moving along X for `seconds`.
pub(super) fn moving(build: &Build, seconds: f64) -> Result<Bench, Failure> {
    move_off(Bench::switch_on(build)?, seconds)
}

/// As [`moving`], on a board that was just switched on.
pub(super) fn move_off(mut bench: Bench, seconds: f64) -> Result<Bench, Failure> {
    bench.hear_banner()?;
    bench.commands(SETTINGS)?;
    bench.pins.clear();
    bench.commands(JOB)?;
    bench.run_for(seconds)?;
    ensure(bench.pins.steps.len() > 10, || "nothing moves".into())?;
    ensure(bench.machine.level(POWER), || "the laser is off".into())?;
    Ok(bench)
}

/// The cycle of the last step edge.
pub(super) fn last_step(bench: &Bench) -> u64 {
    bench.pins.steps.last().map_or(0, Step::edge)
}

/// The edge at which the laser went off.
///
/// # Errors
/// The laser is on.
pub(super) fn power_edge(bench: &Bench) -> Result<Edge, Failure> {
    let edges = bench.pins.others.iter();
    let last = edges.rev().find(|edge| edge.pin == POWER);
    let off = last.filter(|edge| !edge.level).copied();
    off.ok_or_else(|| Failure(format!("the laser is not off: {last:?}")))
}

/// The cycle at which the laser went off.
pub(super) fn power_off(bench: &Bench) -> Result<u64, Failure> {
    Ok(power_edge(bench)?.cycle)
}

/// Checks that steps, laser, spindle and coolant are off.
pub(super) fn ensure_safe(bench: &Bench) -> Result<(), Failure> {
    let is_low = |pin: &Pin| !bench.machine.level(*pin);
    let outputs = [POWER, SPINDLE, FLOOD];
    let on: Vec<_> = STEP
        .iter()
        .chain(&outputs)
        .filter(|pin| !is_low(pin))
        .collect();
    ensure(on.is_empty(), || format!("still on: {on:?}"))
}
