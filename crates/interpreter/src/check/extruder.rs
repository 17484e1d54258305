//! The extruder's word: where it counts from, and its refusal.

use super::{out_of_range, Check};
use crate::code::Letters;
use crate::fault::Refusal;
use crate::modal_state::Distance;
use crate::takers::NonModal;
use crate::Coordinate;
use crate::Status;
use leadscrew_gcode::Letter;

impl<const AXES: usize> Check<'_, AXES> {
    /// Returns the place from which the extruder's word counts; `None` if it counts as the words of
    /// other axes do.
    pub(super) fn extruder_origin(&self) -> Option<Coordinate> {
        let axis = self.context.extruder()?;
        if self.block.non_modal == NonModal::MachineCoordinates {
            return None;
        }
        let origins = match self.block.modal.extrusion? {
            Distance::Absolute => self.state.offsets.work_offset(self.block.modal.system),
            Distance::Incremental => self.state.position,
        };
        origins.get(axis).copied()
    }

    /// The refusal of a word that leads beyond the reach of its axis.
    pub(super) fn beyond_reach(&self, axis: usize) -> Refusal {
        match self.context.extruder() == Some(axis) {
            true => Refusal::words(Status::OutOfRange, Letters::of(&[Letter::E])),
            false => out_of_range(axis),
        }
    }
}
