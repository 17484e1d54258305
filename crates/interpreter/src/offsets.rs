//! The places of the program's coordinate systems in the machine.
//!
//! ```text
//! work offset = origin of G54…G59.3 + G92 + tool length (Z)      machine = work + work offset
//! ```

use super::command::OffsetId;
use super::modal_state::WorkSystem;
use super::Coordinate;

/// The axis along which the tool points: Z.
pub(super) const TOOL_AXIS: usize = 2;

/// All offsets, exact, in mm or degrees.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Offsets<const AXES: usize> {
    systems: [[Coordinate; AXES]; WorkSystem::ALL.len()],
    g28: [Coordinate; AXES],
    g30: [Coordinate; AXES],
    g92: [Coordinate; AXES],
    /// The offset that G92.2 has put aside, and that G92.3 puts in force again.
    kept_g92: [Coordinate; AXES],
    tool_length: Coordinate,
}

impl<const AXES: usize> Offsets<AXES> {
    /// Makes offsets that are all zero.
    pub const fn new() -> Self {
        let zero = [Coordinate::ZERO; AXES];
        Self {
            systems: [zero; WorkSystem::ALL.len()],
            g28: zero,
            g30: zero,
            g92: zero,
            kept_g92: zero,
            tool_length: Coordinate::ZERO,
        }
    }

    /// Returns an offset that outlasts power.
    pub fn get(&self, id: OffsetId) -> &[Coordinate; AXES] {
        match id {
            OffsetId::Work(system) => self.system(system),
            OffsetId::G28 => &self.g28,
            OffsetId::G30 => &self.g30,
        }
    }

    /// Returns the G92 offset, forgotten by a reset.
    pub fn g92(&self) -> &[Coordinate; AXES] {
        &self.g92
    }

    /// Returns the tool length offset along Z, forgotten by a reset.
    pub fn tool_length(&self) -> Coordinate {
        self.tool_length
    }

    /// Returns the sum of all offsets in force while `system` is selected: `WCO` of reports.
    pub fn work_offset(&self, system: WorkSystem) -> [Coordinate; AXES] {
        self.work_offset_with(system, None)
    }

    /// The sum of [`Self::work_offset`], but with this `tool_length`, if one is given.
    pub(super) fn work_offset_with(
        &self,
        system: WorkSystem,
        tool_length: Option<Coordinate>,
    ) -> [Coordinate; AXES] {
        let mut sum = self.without_g92(system, tool_length);
        for (sum, g92) in sum.iter_mut().zip(&self.g92) {
            *sum = *sum + *g92;
        }
        sum
    }

    /// Returns the sum of all offsets in force except G92, with this `tool_length`, if one is
    /// given.
    pub(super) fn without_g92(
        &self,
        system: WorkSystem,
        tool_length: Option<Coordinate>,
    ) -> [Coordinate; AXES] {
        self.with_tool(*self.system(system), tool_length)
    }

    /// Returns the sum of all offsets in force except the origin of the work coordinate system,
    /// with this `tool_length`, if one is given.
    pub(super) fn without_system(&self, tool_length: Option<Coordinate>) -> [Coordinate; AXES] {
        self.with_tool(self.g92, tool_length)
    }

    /// Adds the tool length: this one, or the one in force.
    fn with_tool(
        &self,
        mut sum: [Coordinate; AXES],
        tool_length: Option<Coordinate>,
    ) -> [Coordinate; AXES] {
        if let Some(sum) = sum.get_mut(TOOL_AXIS) {
            *sum = *sum + tool_length.unwrap_or(self.tool_length);
        }
        sum
    }

    pub(super) fn set(&mut self, id: OffsetId, value: [Coordinate; AXES]) {
        match id {
            OffsetId::Work(system) => {
                if let Some(slot) = self.systems.get_mut(system as usize) {
                    *slot = value;
                }
            }
            OffsetId::G28 => self.g28 = value,
            OffsetId::G30 => self.g30 = value,
        }
    }

    /// Sets the G92 offset, for G92.3 too.
    pub(super) fn set_g92(&mut self, value: [Coordinate; AXES]) {
        self.g92 = value;
        self.kept_g92 = value;
    }

    /// G92.2: no G92 offset is in force. G92.3: the last one that was set is.
    pub(super) fn use_g92(&mut self, again: bool) {
        self.g92 = match again {
            true => self.kept_g92,
            false => [Coordinate::ZERO; AXES],
        };
    }

    pub(super) fn set_tool_length(&mut self, length: Coordinate) {
        self.tool_length = length;
    }

    /// Forgets the offsets that do not outlast a reset: G92 and the tool length.
    pub(super) fn reset(&mut self) {
        self.set_g92([Coordinate::ZERO; AXES]);
        self.tool_length = Coordinate::ZERO;
    }

    fn system(&self, system: WorkSystem) -> &[Coordinate; AXES] {
        let [g54, g55, g56, g57, g58, g59, g59_1, g59_2, g59_3] = &self.systems;
        match system {
            WorkSystem::G54 => g54,
            WorkSystem::G55 => g55,
            WorkSystem::G56 => g56,
            WorkSystem::G57 => g57,
            WorkSystem::G58 => g58,
            WorkSystem::G59 => g59,
            WorkSystem::G59_1 => g59_1,
            WorkSystem::G59_2 => g59_2,
            WorkSystem::G59_3 => g59_3,
        }
    }
}

impl<const AXES: usize> Default for Offsets<AXES> {
    fn default() -> Self {
        Self::new()
    }
}
