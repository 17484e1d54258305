//! The main loop's side of the switches: the words that the switch interrupts write, and the edges
//! with which the main loop has dealt.

use crate::dual::DualAxis;
use crate::ends::Ends;
use crate::inputs::{ActiveSwitches, Edges, Inputs};
use leadscrew_stepper::MotorMask;

/// The state of the switches, as far as the main loop has dealt with them.
pub(crate) struct SwitchWatch<'a, const AXES: usize, const MOTORS: usize> {
    pub(crate) inputs: &'a Inputs<MOTORS>,
    /// Edges that have been dealt with.
    pub(crate) edges: Edges,
    /// Limit switches that stay closed.
    pub(crate) ends: Ends<AXES, MOTORS>,
    /// The axis with two motors, if there is one.
    pub(crate) dual: Option<DualAxis>,
    /// Motors of axes that are absent.
    pub(crate) absent: MotorMask,
}

impl<'a, const AXES: usize, const MOTORS: usize> SwitchWatch<'a, AXES, MOTORS> {
    /// Nothing has happened yet.
    pub(crate) fn new(
        inputs: &'a Inputs<MOTORS>,
        dual: Option<DualAxis>,
        absent: MotorMask,
    ) -> Self {
        Self {
            inputs,
            edges: inputs.edges(),
            ends: Ends::new(),
            dual,
            absent,
        }
    }

    /// The axes whose limit switch is active; the switch of a second motor is its axis's.
    pub(crate) fn axes_at_limits(&self, active: &ActiveSwitches) -> MotorMask {
        let second = self.dual.filter(|dual| active.limits.contains(dual.motor));
        let of_axis = second.map_or(MotorMask::NONE, |dual| MotorMask::only(dual.axis));
        let motor = self
            .dual
            .map_or(MotorMask::NONE, |dual| MotorMask::only(dual.motor));
        active.limits.without(motor).with(of_axis)
    }
}
