//! The pins of the synchronised outputs (M62 to M65). The step interrupt and the machine's
//! extension change them.

use leadscrew_machine::extension::OutputChange;
use leadscrew_outputs::OutputPort;
use std::cell::Cell;
use std::rc::Rc;

/// Eight pins, low at power-up. A clone refers to the same pins.
#[derive(Clone, Debug, Default)]
pub struct OutputPins(Rc<Cell<u8>>);

impl OutputPort for OutputPins {
    fn change(&mut self, change: OutputChange) {
        self.0.set(change.applied_to(self.0.get()));
    }

    fn levels(&self) -> u8 {
        self.0.get()
    }
}
