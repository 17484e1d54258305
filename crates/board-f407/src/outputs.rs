//! The pins of M62 to M65, for the extension `leadscrew_outputs`.
use crate::{profile::PROFILE, step_port};
use leadscrew_outputs::OutputPort;
use leadscrew_stepper::OutputChange;

/// The outputs of the board.
pub(crate) struct OutputPins;

impl OutputPort for OutputPins {
    fn change(&mut self, change: OutputChange) {
        step_port::change_outputs(change);
    }

    fn levels(&self) -> u8 {
        let outputs = PROFILE.synchronised.iter().enumerate();
        outputs.fold(0, |levels, (index, output)| {
            levels | u8::from(output.is_on()) << index
        })
    }
}
