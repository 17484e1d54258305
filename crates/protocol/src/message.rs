//! `[MSG:…]` lines, which the machine sends unasked.
//!
//! The texts up to `Sleeping` are Grbl's, to the letter: senders look for some of them.

use super::decimal::Decimal;
use core::fmt;
use leadscrew_gcode::Number;

/// A message; displayed as the whole line, without its line end. At most 70 characters: a text of
/// the board has 64 at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Message {
    /// After ALARM:1 and 2: nothing but 0x18 helps.
    ResetToContinue,
    /// After a reset into a locked machine.
    Locked,
    /// After `$X` unlocked the machine.
    Unlocked,
    /// `$C` switched check mode on.
    CheckEnabled,
    /// `$C` switched check mode off.
    CheckDisabled,
    /// The safety door opened.
    CheckDoor,
    /// A limit switch is active at a reset, or keeps a program or a jog from beginning.
    CheckLimits,
    /// The reset input is active: nothing unlocks the machine.
    ResetHeld,
    /// A text of the board: why it can move nothing, or whether it took its description.
    Board(&'static str),
    /// Something that heats, turns or burns went off, since its sender may be gone.
    WentOff(WentOff),
    /// M2 or M30.
    ProgramEnd,
    /// `$RST=`.
    RestoringDefaults,
    /// Spindle or laser goes back on after a stop.
    RestoringSpindle,
    /// `$SLP`.
    Sleeping,
    /// Motion was to begin or to go on, and the board's step interrupt took no segment for 100 ms.
    NoStepInterrupt,
    /// Stored values are damaged: defaults are in force.
    SettingsLost,
    /// A setting asks for more than the board can make, with the values that would work.
    Capped(Capped),
}

/// A setting that asks for more than can be made, and the values that would work.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Capped {
    /// The setting: `$100`, `$110`, `$120` and up.
    pub number: u16,
    /// The largest value that works with the other settings as they are, rounded down.
    pub most: Number,
}

impl Capped {
    /// Returns true if it is an acceleration, `$120` and up; otherwise it is about the rate of
    /// steps.
    pub const fn is_acceleration(&self) -> bool {
        self.number / 10 == 12
    }
}

/// The load that went off although no line said so, the reason, and the setting that has the time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct WentOff {
    /// Its name: "Laser".
    pub what: &'static str,
    /// The reason: "its sender is silent".
    pub why: &'static str,
    /// The number of the setting.
    pub setting: u16,
}

impl Message {
    /// Returns the text between `[MSG:` and `]`, or its beginning.
    const fn text(self) -> &'static str {
        match self {
            Self::ResetToContinue => "Reset to continue",
            Self::Locked => "'$H'|'$X' to unlock",
            Self::Unlocked => "Caution: Unlocked",
            Self::CheckEnabled => "Enabled",
            Self::CheckDisabled => "Disabled",
            Self::CheckDoor => "Check Door",
            Self::CheckLimits => "Check Limits",
            Self::ResetHeld => "Reset input is active, release it to unlock",
            Self::Board(text) => text,
            Self::WentOff(off) => off.what,
            Self::ProgramEnd => "Pgm End",
            Self::RestoringDefaults => "Restoring defaults",
            Self::RestoringSpindle => "Restoring spindle",
            Self::Sleeping => "Sleeping",
            Self::NoStepInterrupt => "The step interrupt does not come: nothing moves",
            Self::SettingsLost => "Stored values lost, defaults in force: check them, then $X",
            Self::Capped(capped) if capped.is_acceleration() => "Acceleration",
            Self::Capped(_) => "Step rate",
        }
    }
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("[MSG:")?;
        f.write_str(self.text())?;
        if let Self::Capped(Capped { number, most }) = self {
            write!(
                f,
                ": ${number} can be {} at most",
                Decimal::millimetres(*most)
            )?;
        }
        if let Self::WentOff(WentOff { why, setting, .. }) = self {
            write!(f, " off, {why} (${setting})")?;
        }
        f.write_str("]")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_gcode::Number;
    use std::string::ToString;

    #[test]
    fn grbl_s_messages_are_grbl_s() {
        let cases = [
            (Message::ResetToContinue, "[MSG:Reset to continue]"),
            (Message::Locked, "[MSG:'$H'|'$X' to unlock]"),
            (Message::Unlocked, "[MSG:Caution: Unlocked]"),
            (Message::CheckEnabled, "[MSG:Enabled]"),
            (Message::CheckDisabled, "[MSG:Disabled]"),
            (Message::CheckDoor, "[MSG:Check Door]"),
            (Message::CheckLimits, "[MSG:Check Limits]"),
            (Message::ProgramEnd, "[MSG:Pgm End]"),
            (Message::RestoringDefaults, "[MSG:Restoring defaults]"),
            (Message::RestoringSpindle, "[MSG:Restoring spindle]"),
            (Message::Sleeping, "[MSG:Sleeping]"),
        ];
        for (message, line) in cases {
            assert_eq!(message.to_string(), line);
        }
    }

    #[test]
    fn our_own_messages_hold_no_answer() {
        let capped = Message::Capped(Capped {
            number: 110,
            most: Number::from_int(21_818),
        });
        assert_eq!(
            capped.to_string(),
            "[MSG:Step rate: $110 can be 21818.000 at most]"
        );
        for message in [capped, Message::SettingsLost, Message::NoStepInterrupt] {
            let line = message.to_string().to_ascii_lowercase();
            assert!(!line.contains("ok") && !line.contains("error"), "{line}");
            assert!(line.len() <= 68, "{line}");
        }
    }
}
