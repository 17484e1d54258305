//! The highest speed of a motor.

use crate::clock::{Cycle, CPU_HZ};

/// Intervals over which a rate is measured. Bresenham's tracer makes single intervals uneven, so
/// over fewer of them the rate would seem higher than it is.
const LONG: usize = 16;

/// Intervals over which the rate of a shorter burst is measured, such as a move between two rests.
const SHORT: usize = 8;

/// A step begins a new burst if its interval is more than this multiple of the interval before it.
/// The last intervals of a ramp grow by a factor of less than 4, also with limited jerk.
const REST: u64 = 4;

/// Follows the steps of one motor.
#[derive(Clone, Debug)]
pub(super) struct PeakRate {
    /// Instants of the last steps, a ring indexed by their count.
    recent: [Cycle; LONG],
    steps: usize,
    burst: Burst,
    /// Shortest time that [`LONG`] intervals took, cycles. `short`: shortest time that [`SHORT`]
    /// intervals took, in bursts with fewer than [`LONG`].
    long: u64,
    short: u64,
    /// The fastest of the bursts with fewer than [`SHORT`] intervals.
    brief: Brief,
}

/// Steps in one direction without a rest.
#[derive(Clone, Copy, Debug)]
struct Burst {
    begun: Cycle,
    intervals: usize,
    /// The last interval, cycles.
    interval: u64,
    /// The direction.
    by: i32,
    /// Shortest time that [`SHORT`] intervals took, cycles.
    short: u64,
}

/// A few intervals and the cycles that they took.
#[derive(Clone, Copy, Debug)]
struct Brief {
    intervals: usize,
    cycles: u64,
}

impl Brief {
    const NONE: Self = Self {
        intervals: 0,
        cycles: 1,
    };

    fn rate(self) -> f64 {
        self.intervals as f64 * CPU_HZ as f64 / self.cycles.max(1) as f64
    }

    /// The faster of the two. A measurement over several intervals is preferred to one over a
    /// single interval, which is uncertain.
    fn max(self, other: Self) -> Self {
        let key = |brief: Self| (brief.intervals.min(2), brief.rate());
        if key(other) > key(self) {
            other
        } else {
            self
        }
    }
}

impl PeakRate {
    pub(super) fn new() -> Self {
        Self {
            recent: [Cycle::ZERO; LONG],
            steps: 0,
            burst: Burst::begin(Cycle::ZERO, 0),
            long: u64::MAX,
            short: u64::MAX,
            brief: Brief::NONE,
        }
    }

    /// Notes a step.
    #[inline]
    pub(super) fn step(&mut self, now: Cycle, by: i32) {
        let interval = now - self.recent[self.steps.wrapping_sub(1) % LONG];
        if self.burst.goes_on(interval, by) {
            self.burst.intervals += 1;
            self.burst.interval = interval;
            if self.burst.intervals >= LONG {
                self.long = self.long.min(now - self.recent[self.steps % LONG]);
            } else if self.burst.intervals >= SHORT {
                let span = now - self.recent[self.steps.wrapping_sub(SHORT) % LONG];
                self.burst.short = self.burst.short.min(span);
            }
        } else {
            (self.short, self.brief) = self.with_burst();
            self.burst = Burst::begin(now, by);
        }
        self.recent[self.steps % LONG] = now;
        self.steps += 1;
    }

    /// The highest rate, steps/s.
    pub(super) fn hertz(&self) -> f64 {
        let (short, brief) = self.with_burst();
        let rate = |intervals: usize, cycles: u64| match cycles {
            u64::MAX => 0.0,
            cycles => Brief { intervals, cycles }.rate(),
        };
        let measured = rate(LONG, self.long).max(rate(SHORT, short));
        if measured > 0.0 {
            measured
        } else {
            brief.rate()
        }
    }

    /// The values of `short` and `brief` with the present burst included.
    fn with_burst(&self) -> (u64, Brief) {
        let burst = &self.burst;
        match burst.intervals {
            LONG.. => (self.short, self.brief),
            SHORT.. => (self.short.min(burst.short), self.brief),
            intervals => {
                let last = self.recent[self.steps.wrapping_sub(1) % LONG];
                let cycles = last.0.saturating_sub(burst.begun.0);
                (self.short, self.brief.max(Brief { intervals, cycles }))
            }
        }
    }
}

impl Burst {
    fn begin(now: Cycle, by: i32) -> Self {
        Self {
            begun: now,
            intervals: 0,
            interval: u64::MAX / REST,
            by,
            short: u64::MAX,
        }
    }

    #[inline]
    fn goes_on(&self, interval: u64, by: i32) -> bool {
        self.by == by && interval <= REST * self.interval
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rate of steps at these intervals, in steps a second.
    fn hertz(intervals: impl IntoIterator<Item = u64>) -> f64 {
        let (mut rate, mut now) = (PeakRate::new(), Cycle(1000));
        rate.step(now, 1);
        for interval in intervals {
            now = now + interval;
            rate.step(now, 1);
        }
        rate.hertz()
    }

    fn every(interval: u64) -> f64 {
        CPU_HZ as f64 / interval as f64
    }

    #[test]
    fn the_peak_rate_is_that_of_the_fastest_sixteen_intervals() {
        let intervals = [10_000; 20].into_iter().chain([3000; 16]);
        assert_eq!(hertz(intervals.chain([5000; 30])), every(3000));
    }

    #[test]
    fn rests_between_short_moves_do_not_make_them_slow() {
        for steps in [2, 3, 5, 8, 9, 10, 16] {
            let one = std::iter::repeat_n(10_000, steps - 1).chain([100_000_000]);
            let many = std::iter::repeat_n(one, 30).flatten();
            assert_eq!(hertz(many), every(10_000), "{steps}");
        }
    }

    #[test]
    fn a_few_steps_close_together_are_no_speed() {
        // One step of a new piece of the path follows immediately on the last step of the piece
        // before.
        let uneven = [10_000; 20]
            .into_iter()
            .chain([100, 9_900])
            .chain([10_000; 20]);
        assert!(hertz(uneven) <= every(10_000) * 1.07);
    }

    #[test]
    fn steps_back_are_another_move() {
        let mut rate = PeakRate::new();
        let mut now = Cycle(0);
        for k in 0..40 {
            now = now + if k % 10 == 0 { 100 } else { 10_000 };
            rate.step(now, if k / 10 % 2 == 0 { 1 } else { -1 });
        }
        assert_eq!(rate.hertz(), every(10_000));
    }

    #[test]
    fn no_step_and_one_step_are_no_speed() {
        assert_eq!(PeakRate::new().hertz(), 0.0);
        assert_eq!(hertz([]), 0.0);
    }
}
