//! The world around the machine, which stays as it is when the machine loses its power.

use crate::event_loop::Simulation;
use crate::observer::Observer;
use crate::plant::{Pin, Switch};
use leadscrew_machine::board::Switches;
use leadscrew_planner::Kinematics;

/// Inputs, switches and carriages.
#[derive(Clone, Debug)]
pub(super) struct World<const N: usize> {
    pub(super) levels: Switches,
    pub(super) switches: Vec<Switch>,
    pub(super) carriages: [i32; N],
}

impl<const N: usize> World<N> {
    /// A world without switches: all inputs open, the carriages at 0.
    pub(super) fn new() -> Self {
        Self {
            levels: Switches::OPEN,
            switches: Vec::new(),
            carriages: [0; N],
        }
    }

    /// Connects this world to a machine that has not booted yet.
    pub(super) fn wire_to<K, O, const MOVES: usize>(
        &self,
        sim: &mut Simulation<'_, K, O, N, N, MOVES>,
    ) where
        K: Kinematics<N, N> + Clone,
        O: Observer,
    {
        let levels = &self.levels;
        for motor in 0..self.carriages.len() {
            sim.set_pin(Pin::Limit(motor), levels.limits.contains(motor));
        }
        sim.set_pin(Pin::Probe, levels.probe);
        sim.set_pin(Pin::Reset, levels.reset);
        sim.set_pin(Pin::Hold, levels.hold);
        sim.set_pin(Pin::Start, levels.start);
        sim.set_pin(Pin::Door, levels.door);
        sim.place(self.carriages);
        for switch in &self.switches {
            sim.add_switch(*switch);
        }
    }
}
