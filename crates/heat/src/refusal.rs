//! The reasons why a line is refused, with the numbers and texts of the errors.

use leadscrew_machine::extension::OwnCode;
use leadscrew_machine::protocol::status::Status;

/// The reason why a line was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Refusal {
    TooCold,
    OutOfRange,
    NoSuchHeater,
}

impl Refusal {
    pub(crate) fn status(self) -> Status {
        Status::Own(self.code().number)
    }

    fn code(self) -> &'static OwnCode {
        let [cold, range, heater] = &ERRORS;
        match self {
            Self::TooCold => cold,
            Self::OutOfRange => range,
            Self::NoSuchHeater => heater,
        }
    }
}

static ERRORS: [OwnCode; 3] = [
    OwnCode {
        number: 220,
        text: "Too cold to extrude",
        explanation: "Heat the nozzle first: M109 waits until it is warm.",
    },
    OwnCode {
        number: 221,
        text: "The heater does not take this temperature",
        explanation: "The highest is `most` of the heater in the machine file: 275 °C for a nozzle and 120 °C for a bed unless it says otherwise.",
    },
    OwnCode {
        number: 222,
        text: "There is no such heater",
        explanation: "P counts heaters from 0.",
    },
];

/// Returns the errors that lines are answered with.
pub fn errors() -> impl Iterator<Item = &'static OwnCode> {
    ERRORS.iter()
}
