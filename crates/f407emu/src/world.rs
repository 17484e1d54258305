//! The events outside the chip, and their times.
use crate::{
    peripheral::{rcc::ResetCause, NEVER},
    record::Pin,
};
use std::collections::VecDeque;

/// Something that the world does.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Happening {
    /// A switch or a driver sets a pin.
    Pin { pin: Pin, level: bool },
    /// The crystal stops.
    CrystalStops,
    /// The supply falls below the voltage detector's threshold, or comes back.
    Supply { low: bool },
    /// The reset pin, or the power.
    Reset(ResetCause),
}

/// The coming events, in order.
#[derive(Clone, Debug, Default)]
pub(crate) struct World {
    happenings: VecDeque<(u64, Happening)>,
}

impl World {
    /// The cycle of the next happening.
    pub(crate) fn next_event(&self) -> u64 {
        self.happenings.front().map_or(NEVER, |&(cycle, _)| cycle)
    }

    /// Takes the next happening, if it is due.
    pub(crate) fn due(&mut self, now: u64) -> Option<Happening> {
        let due = self.next_event() <= now;
        due.then(|| self.happenings.pop_front())
            .flatten()
            .map(|(_, happening)| happening)
    }

    /// Adds a happening; happenings of one cycle keep the order in which they were added.
    pub(crate) fn add(&mut self, cycle: u64, happening: Happening) {
        let place = self
            .happenings
            .partition_point(|&(other, _)| other <= cycle);
        self.happenings.insert(place, (cycle, happening));
    }
}
