//! The reason why the machine locked itself: `ALARM:N`. The numbers are GRBL's.

use core::fmt;
use leadscrew_interpreter::codes;

codes! {
    /// The reason why the machine locked itself.
    Alarm {
        HardLimit = 1, "A limit switch was hit",
            "The machine stopped at once and may have lost steps. Reset it, move clear of the switch, and home again.";
        SoftLimit = 2, "The target lies outside the travel",
            "The machine stopped on its path and still knows its position. Reset it, unlock it, and check the origin of the job.";
        AbortedMotion = 3, "Reset while moving",
            "Stopping without a ramp may have lost steps. Home again before you go on.";
        ProbeContactTooEarly = 4, "The probe was not in its starting state",
            "Before the motion the probe already was in the state that it should reach. Check its wiring and `$6`.";
        ProbeNoContact = 5, "The probe made no contact",
            "The motion ended without a change of the probe. Start closer to the work or probe farther.";
        HomingReset = 6, "Homing was reset",
            "A reset came while the machine was homing. Home again.";
        HomingDoor = 7, "The door was opened while homing",
            "Close the safety door and home again.";
        HomingPullOff = 8, "The switch stayed active after pulling off",
            "Increase the pull-off distance `$27` and check the wiring of the switch.";
        HomingApproach = 9, "No limit switch was found",
            "The search reached one and a half times the travel without a contact. Check `$130` and up, `$23`, `$5` and the wiring.";
        HomingDualApproach = 10, "The second motor of the axis found no switch",
            "One motor went on too far without its switch after the other one had met its own. Check both switches, and square the axis by hand.";
    }
}

impl Alarm {
    /// Returns true if only a reset leads out of this alarm: the machine may be standing in a
    /// switch or be about to leave its travel.
    pub const fn needs_reset(self) -> bool {
        matches!(self, Self::HardLimit | Self::SoftLimit)
    }
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}

impl core::error::Error for Alarm {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn numbers_are_those_of_grbl() {
        assert!(Alarm::ALL.iter().map(|code| code.number()).eq(1..=10));
        assert_eq!(Alarm::from_number(11), None);
    }

    #[test]
    fn only_limits_need_a_reset() {
        let need: Vec<_> = Alarm::ALL
            .iter()
            .filter(|code| code.needs_reset())
            .collect();
        assert_eq!(need, [&Alarm::HardLimit, &Alarm::SoftLimit]);
    }
}
