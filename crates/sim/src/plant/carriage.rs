//! A motor's carriage: its position and its highest speed.

use super::rate::PeakRate;
use crate::clock::Cycle;

/// A window that contains no position: at the next step the plant looks at the switches.
pub(super) const NOWHERE: (i32, i32) = (i32::MAX, i32::MIN);

/// One motor's carriage.
#[derive(Clone, Debug)]
pub(super) struct Carriage {
    pub(super) position: i32,
    /// The carriage's position less the net steps of its motor. It changes when the carriage is
    /// placed by hand.
    pub(super) origin: i64,
    /// No switch changes while the position is from `window.0` to `window.1`.
    pub(super) window: (i32, i32),
    pub(super) pulses: u64,
    pub(super) direction_changed: Cycle,
    pub(super) rate: PeakRate,
}

impl Carriage {
    pub(super) fn new() -> Self {
        Self {
            position: 0,
            origin: 0,
            window: (i32::MIN, i32::MAX),
            pulses: 0,
            direction_changed: Cycle::ZERO,
            rate: PeakRate::new(),
        }
    }

    /// Moves one step; returns whether this may change a switch.
    #[inline]
    pub(super) fn step(&mut self, now: Cycle, by: i32) -> bool {
        self.position = self.position.wrapping_add(by);
        self.rate.step(now, by);
        self.pulses += 1;
        self.position < self.window.0 || self.position > self.window.1
    }
}
