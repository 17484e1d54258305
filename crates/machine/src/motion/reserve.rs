//! The amount of motion that should wait in the queue. With more, a line would be answered long
//! before its motion.

use crate::board::Duration;
use leadscrew_planner::Config;

/// The time of motion that is to wait in the queue. With more, a line waits for its answer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Reserve {
    /// This time at a feed override of 100 %, µs; `None`: as much as fits.
    micros: Option<u64>,
    /// The feed override, percent.
    percent: u8,
}

impl Reserve {
    /// A reserve as large as fits.
    pub(super) const ALL: Self = Self {
        micros: None,
        percent: 100,
    };

    /// The time of braking from the highest speed, so that the queue's end limits nothing, and
    /// `stall` more, for which a sender may fall silent. With a `stall` of 0: as much as fits.
    pub(super) fn new<const AXES: usize>(config: &Config<AXES>, stall: Duration) -> Self {
        let braking = (config.longest_stop() * 1e6) as u64;
        Self {
            micros: (stall.ticks() > 0).then(|| braking.saturating_add(stall.ticks())),
            ..Self::ALL
        }
    }

    /// Follows the feed override: motion faster than programmed is over sooner.
    pub(super) fn set_override(&mut self, percent: u8) {
        self.percent = percent.max(100);
    }

    /// Returns true if `waiting` is more than should wait: microseconds of motion at an override of
    /// 100 %.
    pub(super) fn is_exceeded(&self, waiting: u64) -> bool {
        let percent = u64::from(self.percent);
        self.micros
            .is_some_and(|micros| waiting.saturating_mul(100) > micros.saturating_mul(percent))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_ticks(1_000_000);

    fn config() -> Config<2> {
        Config {
            max_rate: [100.0, 50.0],
            acceleration: [500.0, 100.0],
            ..Config::default()
        }
    }

    #[test]
    fn the_slowest_axis_s_braking_and_the_stall_add_up() {
        let reserve = Reserve::new(&config(), SECOND);
        assert!(!reserve.is_exceeded(1_500_000));
        assert!(reserve.is_exceeded(1_500_001));
        let eased = Config {
            jerk: 1000.0,
            ..config()
        };
        // The plan is averaged over 0.106 s, which leaves 53 mm/s².
        let reserve = Reserve::new(&eased, SECOND);
        assert!(!reserve.is_exceeded(2_980_000) && reserve.is_exceeded(2_990_000));
    }

    #[test]
    fn at_twice_the_speed_twice_as_much_is_to_wait() {
        let mut reserve = Reserve::new(&config(), SECOND);
        reserve.set_override(200);
        assert!(!reserve.is_exceeded(3_000_000) && reserve.is_exceeded(3_000_001));
        reserve.set_override(10);
        assert!(!reserve.is_exceeded(1_500_000) && reserve.is_exceeded(1_500_001));
    }

    #[test]
    fn without_a_stall_as_much_waits_as_fits() {
        assert!(!Reserve::new(&config(), Duration::from_ticks(0)).is_exceeded(u64::MAX));
    }
}
