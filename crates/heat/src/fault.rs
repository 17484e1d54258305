//! The faults of a heater, with the numbers and texts of their alarms.

use leadscrew_machine::extension::OwnCode;

/// A fault of a heater.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Fault {
    /// The sensor's wire is broken.
    SensorOpen,
    /// The sensor is shorted.
    SensorShorted,
    /// The heater is on, and its temperature does not rise.
    SensorFrozen,
    /// The temperature has reached the target, and leaves the band around it.
    RunsAway,
    /// The heater is switched off, and goes on heating.
    DoesNotCool,
    /// Another device reports a fault.
    External,
}

impl Fault {
    /// All faults.
    pub const ALL: &'static [Self] = &[
        Self::SensorOpen,
        Self::SensorShorted,
        Self::SensorFrozen,
        Self::RunsAway,
        Self::DoesNotCool,
        Self::External,
    ];

    /// Returns the fault's alarm.
    pub fn alarm(self) -> &'static OwnCode {
        let [open, shorted, frozen, runs_away, stuck, external] = &ALARMS;
        match self {
            Self::SensorOpen => open,
            Self::SensorShorted => shorted,
            Self::SensorFrozen => frozen,
            Self::RunsAway => runs_away,
            Self::DoesNotCool => stuck,
            Self::External => external,
        }
    }

    /// Returns the fault in a few words.
    pub fn text(self) -> &'static str {
        self.alarm().text
    }
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
