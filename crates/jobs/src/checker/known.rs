//! The values that a program may read of the machine that a checker follows.

use super::Checker;
use leadscrew_machine::extension::Known;
use leadscrew_planner::Coordinate;
use leadscrew_program::{Item, Value, World};

/// The end of the last probe.
#[derive(Clone, Copy)]
pub(super) struct Probed<const AXES: usize> {
    /// The place of the end, machine position.
    pub(super) at: [Coordinate; AXES],
    pub(super) touched: bool,
}

impl<const AXES: usize> World for Checker<AXES> {
    fn read(&self, item: Item) -> Option<Value> {
        let known = Known {
            interpreter: &self.interpreter,
            axes: &self.config.axes,
            probed: self.probed.map(|probed| probed.at),
            contact: self.probed.is_some_and(|probed| probed.touched),
            tool: Some(self.tool),
        };
        known.read(item)
    }
}

impl<const AXES: usize> Checker<AXES> {
    /// Takes over the place at which a probe has ended, machine coordinates, mm.
    pub(super) fn end_probe(&mut self, at: &[f32], touched: bool) {
        let mut place = *self.interpreter.position();
        for (place, at) in place.iter_mut().zip(at) {
            *place = Coordinate::from_mm(*at).unwrap_or(*place);
        }
        self.interpreter.set_position(place);
        let at = place;
        self.probed = Some(Probed { at, touched });
    }
}
