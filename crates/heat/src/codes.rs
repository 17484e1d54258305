//! Numbers of the errors and alarms, and their words.

use crate::heater::Fault;
use leadscrew_machine::extension::OwnCode;
use leadscrew_machine::protocol::status::Status;

/// Why a line was refused.
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
        explanation: "Its configuration has the highest.",
    },
    OwnCode {
        number: 222,
        text: "There is no such heater",
        explanation: "P counts heaters from 0.",
    },
];

/// The errors that lines are answered with.
pub fn errors() -> impl Iterator<Item = &'static OwnCode> {
    ERRORS.iter()
}

static ALARMS: [OwnCode; 6] = [
    OwnCode {
        number: 220,
        text: "Temperature sensor is open",
        explanation: "Its wire is broken or its plug is out. All heaters are off.",
    },
    OwnCode {
        number: 221,
        text: "Temperature sensor is shorted",
        explanation: "Its wires touch each other or the frame. All heaters are off.",
    },
    OwnCode {
        number: 222,
        text: "Temperature does not rise",
        explanation: "The sensor has fallen out of its place, or the heater has no power. All heaters are off.",
    },
    OwnCode {
        number: 223,
        text: "Temperature runs away from its target",
        explanation: "The sensor is loose, or the heater is too strong or too weak. All heaters are off.",
    },
    OwnCode {
        number: 224,
        text: "Heater does not go off",
        explanation: "Its relay or transistor is stuck. Cut the power.",
    },
    OwnCode {
        number: 225,
        text: "Fault input of the heaters",
        explanation: "Another controller or a thermal cut-out reports a fault. All heaters are off.",
    },
];

pub(crate) fn alarm(fault: Fault) -> &'static OwnCode {
    let [open, shorted, frozen, runs_away, stuck, external] = &ALARMS;
    match fault {
        Fault::SensorOpen => open,
        Fault::SensorShorted => shorted,
        Fault::SensorFrozen => frozen,
        Fault::RunsAway => runs_away,
        Fault::DoesNotCool => stuck,
        Fault::External => external,
    }
}
