//! Real time: the cycle that the simulation should have reached by now.

use leadscrew_sim::clock::{Cycle, CPU_HZ};
use std::time::Duration;

/// The time by which the simulation may fall behind. After that the lost time is skipped, so that
/// the machine does not run too fast to catch up.
const PATIENCE: Duration = Duration::from_millis(250);

/// Ties the simulation's clock to the wall's.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Pace {
    /// Simulated seconds in a second.
    speed: f64,
    wall: Duration,
    cycle: Cycle,
}

impl Pace {
    /// Makes a pace for a simulation that is at `cycle` when the wall clock shows `wall`, and runs
    /// `speed` times as fast as the wall clock.
    pub fn new(speed: f64, wall: Duration, cycle: Cycle) -> Self {
        Self { speed, wall, cycle }
    }

    /// Returns the cycle that the simulation should have reached at `wall`.
    pub fn due(&self, wall: Duration) -> Cycle {
        self.cycle + self.cycles(wall.saturating_sub(self.wall))
    }

    /// Skips the time by which the simulation is behind if it is more than `PATIENCE`. Returns
    /// whether time was skipped.
    pub fn give_up(&mut self, wall: Duration, reached: Cycle) -> bool {
        let behind = self.due(wall) - reached;
        let hopeless = behind > self.cycles(PATIENCE);
        if hopeless {
            *self = Self::new(self.speed, wall, reached);
        }
        hopeless
    }

    /// Returns the cycles that are simulated in `time` of the wall clock.
    pub fn cycles(&self, time: Duration) -> u64 {
        (time.as_secs_f64() * self.speed * CPU_HZ as f64) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn simulated_time_passes_as_many_times_as_fast_as_asked_for() {
        let pace = Pace::new(10.0, 5 * SECOND, Cycle(1000));
        assert_eq!(pace.due(5 * SECOND), Cycle(1000));
        assert_eq!(pace.due(6 * SECOND), Cycle(1000 + 10 * CPU_HZ));
        assert_eq!(pace.due(4 * SECOND), Cycle(1000));
    }

    #[test]
    fn a_short_delay_is_caught_up_and_a_long_one_given_up() {
        let mut pace = Pace::new(1.0, Duration::ZERO, Cycle::ZERO);
        assert!(!pace.give_up(SECOND, Cycle(CPU_HZ * 8 / 10)));
        assert_eq!(pace.due(SECOND), Cycle(CPU_HZ));
        assert!(pace.give_up(SECOND, Cycle(CPU_HZ / 2)));
        assert_eq!(pace.due(SECOND), Cycle(CPU_HZ / 2));
    }
}
