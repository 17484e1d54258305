//! Checks that each wire is where it should be: runs a job in which each signal has a different
//! number of edges.
use crate::{board::Board, failure::Failure, report::Row, wires::Signal};

/// 250 steps/mm, and a filter time of 10 ms, so that the short pulse of flood coolant does not
/// press the button.
const SETTINGS: &str = "$100=250\n$101=250\n$120=1000\n$121=1000\n$706=10000\n";
const JOB: &str = "G91\nM3S500\nG1X-0.1F600\nX0.1\nY0.04\nM5\nM8\nM9\n";
/// The least and the most edges of each signal: 25 steps of X there and as many back, the two
/// changes of direction, 10 steps of Y, flood on and off. Power has the edges of some periods.
const EDGES: [(Signal, usize, usize); 5] = [
    (Signal::StepX, 100, 100),
    (Signal::StepY, 20, 20),
    (Signal::DirectionX, 2, 2),
    (Signal::Power, 200, 10_000),
    (Signal::Flood, 2, 2),
];

/// Checks each signal in turn.
pub(super) fn each(board: &mut Board<'_>) -> Result<Vec<Row>, Failure> {
    board.stream(SETTINGS)?;
    let mut rows = Vec::new();
    for (signal, least, most) in EDGES {
        board.capture(&[signal])?;
        board.run(JOB)?;
        let count = board.edges(signal)?.counts().len();
        rows.push(Row::count(&format!("{signal}, edges"), count, least..=most));
    }
    Ok(rows)
}
