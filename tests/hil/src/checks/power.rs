//! Laser and spindle power.
use crate::{
    board::Board,
    edges::{Edges, PER_US},
    failure::{fail, Failure},
    plan::plan,
    report::Row,
    wires::Signal,
};

/// The counts of a period of the PWM: 10 kHz.
const PERIOD: u64 = 8400;
/// A mean duty may be off by less than this, in counts.
const HALF: f64 = 0.5;
/// Values of S, of 1000, each with the high counts that it asks for: PERIOD · S / 1000. The shares
/// are exact as binary numbers, because the firmware cuts off fractions of a count.
const VALUES: [(u32, f64); 4] = [(125, 1050.0), (250, 2100.0), (500, 4200.0), (875, 7350.0)];
/// The time that each value lasts, s: some hundred periods.
const SECONDS: f64 = 0.02;

/// One move with ramps, at 5000 steps/s and at most half of full power.
const SETTINGS: &str = "$32=1\n$100=250\n$110=6000\n$120=400\n";
const JOB: &str = "G91\nM4S500\nG1X2F1200\nM5\n";
/// The time by which power may change later than its tick, µs: a period of the PWM, and a count of
/// the capture.
const PERIOD_US: f64 = 100.0;
/// The time of the instructions between a tick and its change of power, µs: less than this.
const TICK_US: f64 = 1.0;
/// The error that the energy of a move may have, per cent: the power of the last tick may be held
/// for a whole period of the PWM or be cut off.
const ENERGY_PERCENT: f64 = 1.0;

/// The mean of the high counts of the pulses, and the mean of their periods.
fn mean(edges: &Edges) -> Result<(f64, f64), Failure> {
    let pulses = edges.pulses();
    // The first and the last pulse may be cut off.
    let [_, whole @ .., last] = pulses.as_slice() else {
        return fail("no pulses of power");
    };
    let count = whole.len() as f64;
    let Some(first) = whole.first() else {
        return fail("less than three pulses of power");
    };
    let high: u64 = whole.iter().map(|pulse| pulse.fall - pulse.rise).sum();
    let all = last.rise - first.rise;
    Ok((high as f64 / count, all as f64 / count))
}

/// Measures the power for some values of S at rest.
pub(super) fn duty(board: &mut Board<'_>) -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    for (value, expected) in VALUES {
        board.command(&format!("M3S{value}"))?;
        board.capture(&[Signal::Power])?;
        board.wait(SECONDS)?;
        board.command("M5")?;
        let (high, period) = mean(&board.edges(Signal::Power)?)?;
        let within = |what: String, figure, middle: f64| {
            Row::within(&what, figure, middle - HALF, middle + HALF, "counts")
        };
        rows.push(within(format!("S{value}, high"), high, expected));
        rows.push(within(format!("S{value}, period"), period, PERIOD as f64));
    }
    Ok(rows)
}

/// Measures the power in motion.
pub(super) fn in_motion(board: &mut Board<'_>) -> Result<Vec<Row>, Failure> {
    board.stream(SETTINGS)?;
    board.capture(&[Signal::StepX, Signal::Power])?;
    board.run(JOB)?;
    let steps = board.edges(Signal::StepX)?;
    let power = board.edges(Signal::Power)?.beside(&steps);
    let (steps, power) = (steps.pulses(), power.pulses());
    let plan = plan(SETTINGS, JOB)?;
    let planned = plan.of(0);
    let (Some((on, off)), [first, .., last], [lit, .., dark], [begin, .., end]) = (
        plan.lit(),
        steps.as_slice(),
        power.as_slice(),
        planned.as_slice(),
    ) else {
        return fail(format!(
            "{} steps, {} pulses of power",
            steps.len(),
            power.len()
        ));
    };
    let us = |later: u64, earlier: u64| (later as f64 - earlier as f64) / PER_US;
    let (lights, ends) = (us(on, begin.due), us(off, end.due));
    let high: u64 = power.iter().map(|pulse| pulse.fall - pulse.rise).sum();
    Ok(vec![
        Row::equal("steps", steps.len(), planned.len()),
        Row::within(
            "from the first step to light",
            us(lit.rise, first.rise),
            lights - TICK_US,
            lights + PERIOD_US + TICK_US,
            "us",
        ),
        Row::within(
            "from the last step to the end of light",
            us(dark.fall, last.rise),
            ends - PERIOD_US - TICK_US,
            ends + TICK_US,
            "us",
        ),
        Row::within(
            "energy beyond the simulator's",
            (high as f64 / plan.energy() - 1.0) * 100.0,
            -ENERGY_PERCENT,
            ENERGY_PERCENT,
            "%",
        ),
    ])
}
