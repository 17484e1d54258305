//! The events outside the chip and their times, and the wires between its pins.
use crate::{
    peripheral::{rcc::ResetCause, NEVER},
    record::Pin,
};
use std::collections::VecDeque;

/// Something that happens outside the chip.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Happening {
    /// A switch or a driver sets a pin.
    Pin { pin: Pin, level: bool },
    /// The crystal stops.
    CrystalStops,
    /// The supply has another voltage, mV.
    Supply { millivolts: u32 },
    /// The reset pin is pulled, or the power goes away.
    Reset(ResetCause),
}

/// A wire from a pin that the chip drives to a pin that it does not drive.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Wire {
    pub(crate) from: Pin,
    pub(crate) to: Pin,
    /// The delay of an edge, cycles: 0 unless a fault is planted.
    pub(crate) cycles: u64,
}

/// The coming events, in order, and the wires.
#[derive(Clone, Debug, Default)]
pub(crate) struct World {
    happenings: VecDeque<(u64, Happening)>,
    wires: Vec<Wire>,
}

impl World {
    /// The cycle of the next event.
    pub(crate) fn next_event(&self) -> u64 {
        self.happenings.front().map_or(NEVER, |&(cycle, _)| cycle)
    }

    /// Takes the next event, if it is due.
    pub(crate) fn due(&mut self, now: u64) -> Option<Happening> {
        let due = self.next_event() <= now;
        due.then(|| self.happenings.pop_front())
            .flatten()
            .map(|(_, happening)| happening)
    }

    /// Connects two pins.
    pub(crate) fn connect(&mut self, wire: Wire) {
        self.wires.push(wire);
    }

    /// The wires that begin at a pin.
    pub(crate) fn wires_of(&self, from: Pin) -> Vec<Wire> {
        let wires = self.wires.iter().filter(|wire| wire.from == from);
        wires.copied().collect()
    }

    /// Adds an event. Events of one cycle keep the order in which they were added.
    pub(crate) fn add(&mut self, cycle: u64, happening: Happening) {
        let place = self
            .happenings
            .partition_point(|&(other, _)| other <= cycle);
        self.happenings.insert(place, (cycle, happening));
    }
}
