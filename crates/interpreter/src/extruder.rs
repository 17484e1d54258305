//! The extruder: the word E, M82 and M83.
//!
//! ```text
//!   M82  E is a place in work coordinates       G90  M82 too
//!   M83  E is a way from the axis's place       G91  M83 too
//! ```
//!
//! A machine with three axes has no extruder, and is built without this code.

use super::code::Code;
use super::code::Group;
use super::context::Context;
use super::modal_state::Distance;
use super::words::Block;
use crate::axes::{self, AxisKind, WITHOUT_EXTRUDER};
use crate::Status;
use leadscrew_gcode::{Letter, Number};

impl<const AXES: usize> Context<'_, AXES> {
    /// The axis of the extruder.
    pub(super) fn extruder(&self) -> Option<usize> {
        axes::extruder(self.axes)
    }

    /// Returns how E counts after this code, if it is M82 or M83 and there is an extruder.
    pub(super) fn extrusion(&self, code: Code) -> Option<Distance> {
        if AXES <= WITHOUT_EXTRUDER {
            return None;
        }
        let distance = match code.exact()? {
            82 => Distance::Absolute,
            83 => Distance::Incremental,
            _ => return None,
        };
        self.extruder().map(|_| distance)
    }
}

impl<const AXES: usize> Block<AXES> {
    /// Applies G90 or G91. For E, an M82 or M83 on the same line wins.
    pub(super) fn take_distance(&mut self, distance: Distance) {
        self.modal.distance = distance;
        if AXES > WITHOUT_EXTRUDER && !self.groups.contains(Group::Extrusion) {
            self.modal.extrusion = None;
        }
    }

    /// Notes that an axis beyond Z has a word and answers the place for its value. E is the word of
    /// the extruder, and of it alone.
    pub(super) fn further_axis(
        &mut self,
        letter: Letter,
        context: &Context<'_, AXES>,
    ) -> Result<&mut Number, Status> {
        let extruder = context.extruder();
        let axis = match letter {
            Letter::A => Some(WITHOUT_EXTRUDER),
            Letter::B => Some(WITHOUT_EXTRUDER + 1),
            Letter::C => Some(WITHOUT_EXTRUDER + 2),
            _ => None,
        };
        match axis {
            Some(axis) if axis >= AxisKind::count(context.axes) || extruder == Some(axis) => {
                Err(Status::UnsupportedCommand)
            }
            Some(axis) => self.axis(axis),
            None => self.axis(extruder.ok_or(Status::UnsupportedCommand)?),
        }
    }
}
