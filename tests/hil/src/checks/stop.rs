//! The reset button; the output for flood coolant is wired to it and presses it.
use crate::{
    board::Board,
    edges::{Edges, PER_US},
    failure::{fail, Failure},
    report::Row,
    wires::Signal,
};

/// 40 000 steps/s and power: the capture has room for the edges of 85 ms.
const SETTINGS: &str = "$0=3\n$32=0\n$100=250\n$110=9600\n$120=20000\n";
const JOB: &str = "G91\nM3S500\nG1X40F9600\n";
const INTERVAL_US: f64 = 25.0;
const TIMES: usize = 3;
/// The time after the start of motion at which the button is pressed, s: the ramp is over then.
const AFTER: f64 = 0.03;
/// The realtime byte that toggles flood coolant.
const FLOOD: &[u8] = b"\xA0";
/// A switch is accepted after 200 µs (`$706`). It may be accepted later by a count of the filter's
/// clock, 1 µs, and by the time of an interrupt that loads a segment first.
const FILTER_US: f64 = 200.0;
const FILTER_LATE_US: f64 = 4.7;
/// The longest time from the acceptance of the switch to the last step, µs (docs/hardware.md).
const STEPS_US: f64 = 10.0;
/// The period of the PWM, µs: its last edge may be older than the stop by this.
const PERIOD_US: f64 = 100.0;

/// Stops in motion. Returns the edges of two signals.
fn stop(board: &mut Board<'_>, signals: [Signal; 2]) -> Result<[Edges; 2], Failure> {
    board.reset()?;
    board.capture(&signals)?;
    board.stream(JOB)?;
    board.wait(AFTER)?;
    board.send(FLOOD)?;
    let heard = board.hear_until(1.0, |line| line.starts_with("Grbl"))?;
    if !heard.iter().any(|line| line == "ALARM:3") {
        return fail(format!("no ALARM:3 in motion, but {heard:?}"));
    }
    // Nothing may move after this.
    board.wait(0.05)?;
    board.reset()?;
    let one = board.edges(signals[0])?;
    let other = board.edges(signals[1])?.beside(&one);
    Ok([one, other])
}

/// Measures the last edges of steps and of power, several times.
pub(super) fn by_button(board: &mut Board<'_>) -> Result<Vec<Row>, Failure> {
    board.stream(SETTINGS)?;
    let (mut steps_us, mut dark_us) = (Vec::new(), Vec::new());
    for _ in 0..TIMES {
        let [steps, flood] = stop(board, [Signal::StepX, Signal::Flood])?;
        let (Some(last), Some(pressed)) = (steps.pulses().last().copied(), flood.counts().first())
        else {
            return fail("no steps, or no edge of flood coolant");
        };
        steps_us.push((last.rise as f64 - *pressed as f64) / PER_US);
        let [steps, power] = stop(board, [Signal::StepX, Signal::Power])?;
        let (Some(step), Some(dark)) = (steps.pulses().last().copied(), power.counts().last())
        else {
            return fail("no steps, or no power");
        };
        if power.level_at(u64::MAX) {
            return fail("power is on after the stop");
        }
        dark_us.push((*dark as f64 - step.rise as f64) / PER_US);
    }
    let least = |all: &[f64]| all.iter().copied().fold(f64::INFINITY, f64::min);
    let most = |all: &[f64]| all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let steps = |what: &str, figure| {
        let earliest = FILTER_US - FILTER_LATE_US - INTERVAL_US;
        let latest = FILTER_US + FILTER_LATE_US + STEPS_US;
        Row::within(what, figure, earliest, latest, "us")
    };
    Ok(vec![
        steps(
            "from the button to the last step, shortest",
            least(&steps_us),
        ),
        steps("... and longest", most(&steps_us)),
        Row::within(
            "from the last step to the last edge of power, longest",
            most(&dark_us),
            -PERIOD_US - STEPS_US,
            INTERVAL_US + FILTER_LATE_US,
            "us",
        ),
    ])
}
