//! The motor drivers: on in motion, off some time after it.

use crate::board::{Board, Duration, Instant};

/// `$1=255` keeps motors enabled.
const ALWAYS: u32 = 255;

/// Motor drivers: enabled before the first step, disabled some time after the last (`$1`). The
/// value says whether they are enabled, and since when they are not needed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Drivers {
    enabled: bool,
    idle_since: Option<Instant>,
}

impl Drivers {
    /// Enables the drivers. Before the step timer is started. Main loop.
    pub(crate) fn enable<B: Board>(&mut self, board: &mut B) {
        if !self.enabled {
            board.enable_motors(true);
        }
        self.enabled = true;
        self.idle_since = None;
    }

    /// Disables the drivers at once. Main loop, after a stop.
    pub(crate) fn drop<B: Board>(&mut self, board: &mut B) {
        board.enable_motors(false);
        self.enabled = false;
    }

    /// Disables the drivers `delay_ms` after motion ended; 255 stands for never. With `locked` (in
    /// an alarm, or asleep) 255 does not keep them enabled. Main loop, while at rest.
    pub(crate) fn rest<B: Board>(
        &mut self,
        delay_ms: impl FnOnce() -> u32,
        locked: bool,
        board: &mut B,
        now: Instant,
    ) {
        if !self.enabled {
            return;
        }
        self.idle_since.get_or_insert(now);
        if self.rest_at(delay_ms, locked).is_some_and(|end| now >= end) {
            board.enable_motors(false);
            self.enabled = false;
        }
    }

    /// Returns when the drivers are to be disabled; `None`: time does not disable them.
    pub(crate) fn rest_at(&self, delay_ms: impl FnOnce() -> u32, locked: bool) -> Option<Instant> {
        let since = self.idle_since.filter(|_| self.enabled)?;
        let delay_ms = delay_ms();
        (locked || delay_ms != ALWAYS).then(|| since + millis(delay_ms))
    }
}

fn millis(millis: u32) -> Duration {
    Duration::from_ticks(u64::from(millis) * 1_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motors_that_are_always_enabled_wait_for_nothing() {
        let drivers = Drivers {
            enabled: true,
            idle_since: Some(Instant::from_ticks(5)),
        };
        assert_eq!(drivers.rest_at(|| ALWAYS, false), None);
        assert_eq!(
            drivers.rest_at(|| 25, false),
            Some(Instant::from_ticks(25_005))
        );
        assert_eq!(
            drivers.rest_at(|| ALWAYS, true),
            Some(Instant::from_ticks(255_005))
        );
    }
}
