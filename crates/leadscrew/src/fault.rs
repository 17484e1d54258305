//! The parts of a board that can fail, and the words for the operator.

/// A part of the board that failed. The machine stops, says which part it is, and stays locked
/// until power goes off and on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Fault {
    /// A step or a direction pin could not be set.
    StepPin,
    /// The laser's power could not be set.
    Laser,
    /// A switch could not be read.
    Switch,
    /// The pin of the drivers, the spindle or the coolant, or the spindle's power could not be set.
    Output,
}

impl Fault {
    /// All faults, in the order of their numbers.
    pub(crate) const ALL: [Self; 4] = [Self::StepPin, Self::Laser, Self::Switch, Self::Output];

    /// Returns the text for the operator, 64 characters at most.
    pub const fn text(self) -> &'static str {
        match self {
            Self::StepPin => "A step or direction pin failed: mend it, then power off and on",
            Self::Laser => "The laser's PWM failed: mend it, then power off and on",
            Self::Switch => "A switch cannot be read: mend it, then power off and on",
            Self::Output => "A driver, spindle or coolant pin failed: mend it, power off, on",
        }
    }
}

impl core::fmt::Display for Fault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.text())
    }
}

impl core::error::Error for Fault {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_fault_has_the_place_of_its_number_and_a_text_that_fits_a_message() {
        for (place, fault) in Fault::ALL.into_iter().enumerate() {
            assert_eq!(fault as usize, place);
            assert!(fault.text().len() <= 64, "{fault}");
        }
    }
}
