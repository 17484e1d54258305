//! The time for which the flash stops the CPU when a setting is stored.
use crate::{
    board::Board,
    edges::PER_US,
    failure::{fail, Failure},
    report::Row,
    wires::Signal,
};

/// With this filter time the button is not accepted within 10 ms.
const SETTINGS: &str = "$706=10000\n";
/// The level of the button is looked at 10 ms after its edge. Nothing may press it again then.
const SETTLING_SECONDS: f64 = 0.02;
/// The number of times that each time is measured.
const TIMES: u32 = 8;
/// The bounds of the time, µs. The flash programs four words; the data sheet gives 16 µs a word as
/// typical and 100 µs as the maximum (table 40). A turn of the main loop lies in between and may add
/// to or subtract from the difference.
const LEAST_US: f64 = 30.0;
const MOST_US: f64 = 500.0;

/// A pause in which the lines behind it arrive. Otherwise the flash is busy while M9 is still on its
/// way, and a part of its time does not show.
const PAUSE: &str = "G4P0.01";

/// The time from M8 to M9 with this line between them, µs.
fn between(board: &mut Board<'_>, line: &str) -> Result<f64, Failure> {
    board.wait(SETTLING_SECONDS)?;
    board.capture(&[Signal::Flood])?;
    board.stream(&format!("{PAUSE}\nM8\n{line}\nM9\n"))?;
    match board.edges(Signal::Flood)?.pulses().as_slice() {
        [pulse] => Ok((pulse.fall - pulse.rise) as f64 / PER_US),
        other => fail(format!("{} pulses of flood coolant", other.len())),
    }
}

/// Measures a setting line with a new value, and a setting line with the old value, which stores
/// nothing. The difference is the time of the flash.
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
