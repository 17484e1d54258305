//! The time of the waiting motion, kept up to date as moves come and go. It decides whether more
//! moves are wanted.

use super::Planner;
use crate::config::SLOWEST;
use crate::moves::PlannedMove;
use crate::real::{max, min, norm2, sqrt};
use crate::{Config, Kinematics};

/// The sum of the least times of the moves that wait.
#[derive(Debug)]
pub(super) struct Backlog {
    micros: u64,
    /// The highest speed that any path can have, mm/s.
    fastest: f32,
}

impl Backlog {
    /// Nothing waits.
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
    fn micros<const AXES: usize, const MOTORS: usize>(
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
    /// The least time of the moves that wait after the running one, µs, at 100 % of the speed asked
    /// for.
    pub const fn waiting_micros(&self) -> u64 {
        self.backlog.micros
    }

    /// The line number of the first move that waits.
    pub fn next_line_number(&self) -> Option<u32> {
        self.queue.next_queued()?.line_number()
    }

    /// Queues a move. The caller has checked that there is room.
    pub(super) fn queue_newest(&mut self, planned: &PlannedMove<AXES, MOTORS>) {
        self.backlog
            .replace(None, Some(self.backlog.micros(planned)));
        self.queue.push(planned);
    }

    /// Replaces the newest move by the same move made longer.
    pub(super) fn lengthen_newest(&mut self, longer: PlannedMove<AXES, MOTORS>) {
        let shorter = self.queue.newest().map(|of| self.backlog.micros(of));
        self.backlog
            .replace(shorter, Some(self.backlog.micros(&longer)));
        self.queue.lengthen_last(longer);
    }

    /// Notes that a move does not wait any more.
    pub(super) fn note_started(&mut self) {
        let started = self.queue.running();
        let micros = started.map(|started| self.backlog.micros(started));
        self.backlog.replace(micros, None);
    }
}

#[cfg(test)]
mod tests {
    use crate::reference::{to, Rig, RigQueue};
    use crate::{Config, MovePower};
    use proptest::prelude::*;

    /// The sum from the queue itself, one move after the other, µs.
    fn counted(rig: &Rig<'_>) -> u64 {
        let waiting = rig.planner.len() - usize::from(rig.planner.queue.running().is_some());
        let moves = rig.planner.queue.latest().take(waiting);
        moves
            .map(|of| u64::from(rig.planner.backlog.micros(of)))
            .sum()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        /// The sum stays right, whatever moves are merged, joined and started.
        #[test]
        fn the_sum_is_that_of_the_moves_that_wait(
            points in prop::collection::vec((-2.0f64..2.0, 0.001f64..2.0, 1u8..4, 0.5f32..900.0), 1..80),
            plays in prop::collection::vec(0usize..6, 80), pixels in (0usize..2).prop_map(|rows| 64 * rows),
        ) {
            let mut queue = RigQueue::new();
            let mut rig = Rig::new(Config { pixels, ..Config::default() }, &mut queue);
            let mut x = 0.0;
            for ((y, step, level, feed), plays) in points.into_iter().zip(plays) {
                x += step;
                let mut next = to(x, if level == 1 { 0.0 } else { y }, feed);
                let power = leadscrew_stepper::Power::from_share(fixed::types::U1F31::from_num(f64::from(level) / 4.0));
                next.power = MovePower::Constant { power };
                rig.planner.push(&next).unwrap();
                (0..plays).for_each(|_| { rig.step(); });
                prop_assert_eq!(rig.planner.waiting_micros(), counted(&rig));
            }
            while rig.step().is_some() {}
            prop_assert_eq!(rig.planner.waiting_micros(), 0);
        }
    }

    #[test]
    fn a_millimetre_at_ten_millimetres_a_second_takes_a_tenth_of_a_second() {
        let mut queue = RigQueue::new();
        let mut rig = Rig::new(
            Config {
                max_rate: [100.0; 2],
                ..Config::default()
            },
            &mut queue,
        );
        for k in 1..=3 {
            rig.planner.push(&to(f64::from(k), 0.0, 10.0)).unwrap();
        }
        let waits = rig.planner.waiting_micros();
        assert!((299_990..=300_000).contains(&waits), "{waits}");
        rig.step();
        let waits = rig.planner.waiting_micros();
        assert!((199_990..=200_000).contains(&waits), "{waits}");
        rig.planner.clear();
        assert_eq!(rig.planner.waiting_micros(), 0);
    }
}
