//! The board's clock, compared with this computer's.
use crate::{board::Board, edges::PER_US, failure::Failure, report::Row};

/// The time over which the clocks are compared, s.
const SECONDS: f64 = 2.0;
/// The error that the board's clock may have, per cent. The internal oscillator would be 1 % off, a
/// crystal 0.01 %. An adapter and its driver delay a line by some milliseconds.
const PERCENT: f64 = 0.5;

/// The rate of the board's timer over [`SECONDS`].
pub(super) fn rate(board: &mut Board<'_>) -> Result<Vec<Row>, Failure> {
    let began = (board.link().seconds(), board.count()?);
    board.wait(SECONDS)?;
    let ended = (board.link().seconds(), board.count()?);
    let counts = f64::from(ended.1.wrapping_sub(began.1));
    let expected = (ended.0 - began.0) * PER_US * 1e6;
    let off = (counts / expected - 1.0) * 100.0;
    Ok(vec![Row::within("faster by", off, -PERCENT, PERCENT, "%")])
}
