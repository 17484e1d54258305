//! How long the flash keeps the CPU when a setting is stored.
use crate::{
    board::Board,
    edges::PER_US,
    failure::{fail, Failure},
    report::Row,
    wires::Signal,
};

/// The button is not believed within 10 ms.
const SETTINGS: &str = "$706=10000\n";
/// How often each is measured.
const TIMES: u32 = 8;
/// Four words of 16 µs, as the data sheet has it in the middle, and of 100 µs at most (table 40),
/// µs; a turn of the main loop and its look at the line lie in between, one way or the other.
const LEAST_US: f64 = 30.0;
const MOST_US: f64 = 500.0;

/// The time from M8 to M9 with this line between them, µs.
fn between(board: &mut Board<'_>, line: &str) -> Result<f64, Failure> {
    board.capture(&[Signal::Flood])?;
    board.stream(&format!("M8\n{line}\nM9\n"))?;
    match board.edges(Signal::Flood)?.pulses().as_slice() {
        [pulse] => Ok((pulse.fall - pulse.rise) as f64 / PER_US),
        other => fail(format!("{} pulses of flood coolant", other.len())),
    }
}

/// A setting that changes, and one that does not.
pub(super) fn stall(board: &mut Board<'_>) -> Result<Vec<Row>, Failure> {
    board.stream(SETTINGS)?;
    let (mut same, mut changed) = (Vec::new(), Vec::new());
    for time in 0..TIMES {
        changed.push(between(board, &format!("$110={}", 600 + time))?);
        same.push(between(board, &format!("$110={}", 600 + time))?);
    }
    let middle = |mut all: Vec<f64>| {
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    };
    let most = changed.iter().copied().fold(0.0, f64::max);
    let (same, changed) = (middle(same), middle(changed));
    Ok(vec![
        Row::within(
            "longer in the middle by",
            changed - same,
            LEAST_US,
            MOST_US,
            "us",
        ),
        Row::within("longer at most by", most - same, LEAST_US, MOST_US, "us"),
    ])
}
