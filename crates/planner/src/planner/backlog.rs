//! The time of the moves that wait, kept up to date as they come and go.

use super::Planner;
use crate::config::SLOWEST;
use crate::moves::PlannedMove;
use crate::real::{max, min, norm2, sqrt};
use crate::{Config, Kinematics};

/// The sum of the least times of the moves that wait, kept up to date as moves come and go. The
/// machine asks for more moves while this sum is small.
#[derive(Debug)]
pub(super) struct Backlog {
    micros: u64,
    /// The highest speed that any path can have, mm/s.
    fastest: f32,
}

impl Backlog {
    /// Makes the backlog of an empty queue.
    pub(super) fn new<const AXES: usize>(config: &Config<AXES>) -> Self {
        Self {
            micros: 0,
            fastest: sqrt(norm2(&config.max_rate)),
        }
    }

    /// Replaces the time of one move (µs) by the time of another. `None` stands for no move.
    fn replace(&mut self, old: Option<u32>, new: Option<u32>) {
        self.micros += u64::from(new.unwrap_or(0));
        self.micros = self.micros.saturating_sub(old.unwrap_or(0).into());
    }

    /// The least time of a move at 100 %, µs. It uses only values that do not change while the move
    /// waits.
    pub(super) fn micros<const AXES: usize, const MOTORS: usize>(
        &self,
        planned: &PlannedMove<AXES, MOTORS>,
    ) -> u32 {
        let speed = max(min(planned.feed, self.fastest), SLOWEST);
        (planned.length / speed * 1e6) as u32
    }
}

impl<K, const AXES: usize, const MOTORS: usize> Planner<'_, K, AXES, MOTORS>
where
    K: Kinematics<AXES, MOTORS>,
{
    /// Returns the least time of the moves that wait after the running one, µs, at 100 % of the
    /// speed asked for.
    pub const fn waiting_micros(&self) -> u64 {
        self.backlog.micros
    }

    /// Returns the line number of the first move that waits.
    pub fn next_line_number(&self) -> Option<u32> {
        self.queue.next_queued()?.line_number()
    }

    /// Queues a move. The caller has checked that there is room.
    pub(super) fn queue_newest(&mut self, planned: &PlannedMove<AXES, MOTORS>) {
        self.backlog
            .replace(None, Some(self.backlog.micros(planned)));
        self.queue.push(planned);
    }

    /// Makes the newest move longer.
    pub(super) fn lengthen_newest(
        &mut self,
        lengthen: impl FnOnce(&mut PlannedMove<AXES, MOTORS>),
    ) {
        if let Some(newest) = self.queue.lengthen_last() {
            let shorter = self.backlog.micros(newest);
            lengthen(newest);
            let longer = self.backlog.micros(newest);
            self.backlog.replace(Some(shorter), Some(longer));
        }
    }

    /// Notes that a move does not wait any more.
    pub(super) fn note_started(&mut self) {
        let started = self.queue.running();
        let micros = started.map(|started| self.backlog.micros(started));
        self.backlog.replace(micros, None);
    }
}
