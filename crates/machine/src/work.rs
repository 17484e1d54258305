//! Counts of the work done so far, for cost models and benchmarks.

use leadscrew_planner::Pushed;

/// Counters of the main loop's work since power-up; each wraps around.
///
/// A simulator reads them after every `Machine::poll` and charges its CPU for the difference.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Work {
    /// The number of calls of `Machine::poll`.
    pub polls: u32,
    /// Bytes taken from the receive queues into lines.
    pub bytes: u32,
    /// Lines interpreted, `$` lines included.
    pub lines: u32,
    /// Moves planned; chords of arcs each count.
    pub moves: u32,
    /// Moves that became part of the row of pixels before them.
    pub pixels: u32,
    /// The number of segments that were made.
    pub segments: u32,
    /// Queued moves whose time was added up for status reports: an upper bound.
    pub timed: u32,
    /// The number of status reports that were written.
    pub reports: u32,
    /// Bytes handed to the board for sending.
    pub written: u32,
    /// Realtime requests acted on.
    pub requests: u32,
}

impl Work {
    pub(crate) fn count_move(&mut self, pushed: Pushed) {
        let counter = match pushed {
            Pushed::Queued => &mut self.moves,
            Pushed::Merged => &mut self.pixels,
            Pushed::TooShort => return,
        };
        *counter = counter.wrapping_add(1);
    }
}
