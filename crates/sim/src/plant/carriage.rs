//! A motor's carriage: where it is, and how fast it went.

use crate::clock::{Cycle, CPU_HZ};

/// Steps over which a motor's rate is measured. Fewer would see the unevenness of Bresenham's tracer as speed.
const RATE_STEPS: usize = 16;

/// A window that no position is in: the next step looks at the switches.
pub(super) const NOWHERE: (i32, i32) = (i32::MAX, i32::MIN);

/// One motor's carriage.
#[derive(Clone, Debug)]
pub(super) struct Carriage {
    pub(super) position: i32,
    /// Where it was put by hand, less the steps that it had made: `position` less the net steps.
    pub(super) origin: i64,
    /// Nothing changes from `window.0` to `window.1`.
    pub(super) window: (i32, i32),
    pub(super) pulses: u64,
    pub(super) direction_changed: Cycle,
    first_step: Cycle,
    last_step: Cycle,
    /// Instants of the last [`RATE_STEPS`] steps, a ring indexed by the pulse count.
    recent: [Cycle; RATE_STEPS],
    /// Shortest time of [`RATE_STEPS`] intervals.
    fastest: u64,
}

impl Carriage {
    pub(super) fn new() -> Self {
        Self {
            position: 0,
            origin: 0,
            window: (i32::MIN, i32::MAX),
            pulses: 0,
            direction_changed: Cycle::ZERO,
            first_step: Cycle::NEVER,
            last_step: Cycle::ZERO,
            recent: [Cycle::ZERO; RATE_STEPS],
            fastest: u64::MAX,
        }
    }

    /// Moves one step; returns whether a switch may change by it.
    #[inline]
    pub(super) fn step(&mut self, now: Cycle, by: i32) -> bool {
        self.position = self.position.wrapping_add(by);
        let slot = &mut self.recent[self.pulses as usize % RATE_STEPS];
        let span = now.0 - slot.0;
        *slot = now;
        if self.pulses < RATE_STEPS as u64 {
            self.first_step = self.first_step.min(now);
        } else {
            self.fastest = self.fastest.min(span);
        }
        self.pulses += 1;
        self.last_step = now;
        self.position < self.window.0 || self.position > self.window.1
    }

    /// Highest rate in steps/s over [`RATE_STEPS`] intervals, over all where there were no more.
    pub(super) fn peak_rate(&self) -> f64 {
        let (steps, cycles) = if self.pulses > RATE_STEPS as u64 {
            (RATE_STEPS as u64, self.fastest)
        } else {
            (
                self.pulses.saturating_sub(1),
                self.last_step - self.first_step,
            )
        };
        steps as f64 * CPU_HZ as f64 / cycles.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_rate_is_that_of_the_fastest_sixteen_intervals() {
        let mut carriage = Carriage::new();
        let mut now = Cycle(0);
        for interval in [10_000; 20].into_iter().chain([1000; 17]).chain([5000; 30]) {
            now = now + interval;
            carriage.step(now, 1);
        }
        assert_eq!(carriage.peak_rate(), CPU_HZ as f64 / 1000.0);
    }
}
