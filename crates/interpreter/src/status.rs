//! The answer to a refused line: `error:N`.
//!
//! The numbers are GRBL's; 52, a value out of range, is grblHAL's. From 200 on they are our own.

use crate::codes;
use core::fmt;

codes! {
    /// The reason why a line was refused.
    Status {
        ExpectedLetter = 1, "A word must begin with a letter",
            "The line has a byte where a letter from A to Z was expected. Check it for a second point in a number or for a character that G-code does not use.";
        BadNumber = 2, "A number is missing or badly written",
            "A letter, `$` or `=` must be followed by a number such as 10, -0.5 or .25. There are no exponents and only one sign.";
        InvalidStatement = 3, "This `$` command does not exist",
            "The command is unknown, has text behind it that does not belong there, or names a setting that this machine does not have. Send `$` for the list.";
        NegativeValue = 4, "The value may not be negative",
            "Settings and the words F, N, P, S and T take zero or more.";
        HomingDisabled = 5, "Homing is switched off",
            "Set `$22=1` on a machine with limit switches before homing it.";
        StepPulseTooShort = 6, "The step pulse is too short",
            "The shortest is 1 us, or Grbl's 3 us on a machine that answers as Grbl does. Set `$0` to what the motor drivers ask for.";
        StoreUnreadable = 7, "Stored values were lost, defaults are in force",
            "What was stored did not pass its checksum, as after a power loss while writing or after an update; or the memory did not take a change. Restore the settings from a backup and check the offsets.";
        NotIdle = 8, "The command has to wait until the machine is idle",
            "Let the motion end, leave check mode, or unlock the machine, then send the command again.";
        Locked = 9, "G-code is locked while jogging or after a fault",
            "Home the machine with `$H`, or unlock it with `$X` if its position is known to be right. After a jog, wait until it has ended.";
        SoftLimitsNeedHoming = 10, "Soft limits need homing",
            "Only a homed machine knows where its travel ends. Set `$22=1` first, then `$20=1`.";
        LineTooLong = 11, "The line is too long",
            "Blanks and comments do not count. Split the line, or make the sender write fewer decimals. Nothing of the line was executed.";
        StepRateTooHigh = 12, "The step rate would be too high",
            "Steps per millimetre times maximum rate exceed what this board can do. Lower one of the two.";
        DoorOpen = 13, "The safety door is open",
            "Close the door, then send the command again.";
        StoredLineTooLong = 14, "The line is too long to be stored",
            "A startup line or build information has to fit its place in the store. Shorten it.";
        JogOutOfTravel = 15, "The jog would leave the travel",
            "The target lies beyond the soft limits. Nothing was moved.";
        InvalidJog = 16, "A jog takes only axis words, F, G20, G21, G53, G90 and G91",
            "Leave out motion modes, M-words and other G-words: a jog never changes the modal state.";
        LaserNeedsPower = 17, "Laser mode needs a variable power output",
            "This machine has no output whose power can be changed. Leave `$32` at 0.";
        UnsupportedCommand = 20, "The command is not supported",
            "This G, M or other word is unknown to this machine. Choose the GRBL post-processor in the CAM program.";
        ModalGroupTwice = 21, "Two commands of one modal group",
            "Words of one group, such as G90 and G91, exclude each other. Put them on separate lines.";
        FeedUndefined = 22, "The feed rate is not set",
            "Give an F word above zero before or with the first feed motion. In G93 and in jogs every line needs its own.";
        NotWhole = 23, "The command needs a whole number",
            "This G or M word has a fraction that means nothing, or is out of range.";
        AxisWordConflict = 24, "Two commands on the line want the axis words",
            "The axis words of a line belong to one command only. Split the line.";
        WordTwice = 25, "A word is repeated",
            "Each letter but G and M may stand on a line once.";
        NoAxisWords = 26, "Axis words are missing",
            "This command needs at least one of the axis letters, for an arc one in its plane.";
        InvalidLineNumber = 27, "The line number is too large",
            "N takes 0 to 10000000.";
        MissingWord = 28, "The command needs another word",
            "G4 needs P, G10 P and L. The first line of a canned cycle needs R and its depth, G82, G86 and G89 need P, G73 and G83 need Q; these words stay until cycle, plane or G90 and G91 change.";
        UnsupportedSystem = 29, "The coordinate system does not exist",
            "There are six of them, G54 to G59: P1 to P6. A machine with LinuxCNC's words has three more, G59.1 to G59.3: P7 to P9.";
        MachineCoordinatesNeedStraight = 30, "G53 needs G0 or G1",
            "Machine coordinates work with straight motion only. Write G0 or G1 before G53.";
        AxisWordsUnused = 31, "Axis words without a command for them",
            "In G80 no motion mode is active. Give the line a G0, G1, G2 or G3.";
        NoAxisWordsInPlane = 32, "The arc has no axis word in its plane",
            "Give at least one end coordinate in the plane that G17, G18 or G19 has selected.";
        InvalidTarget = 33, "The target of the motion is invalid",
            "The ends of the arc lie on different radii, an arc by radius ends where it begins, a probe has nowhere to go, or a move has more steps than can be counted: divide it.";
        ArcRadiusTooSmall = 34, "The radius is too small for the arc",
            "The end is farther than two radii away. Check R and the end coordinates.";
        ArcCentreMissing = 35, "The arc has no centre in its plane",
            "Give R, or the offsets I, J, K of the selected plane.";
        UnusedWords = 36, "Words were left over",
            "The line has value words that none of its commands takes.";
        ToolLengthAxis = 37, "G43.1 takes Z alone",
            "Dynamic tool length offset works on the tool axis only.";
        ToolTooLarge = 38, "The tool number is too large",
            "T takes 0 to 255; on a machine that changes tools, 0 to 4294967295.";
        OutOfRange = 52, "The value is out of range",
            "The setting does not take this value, or the target is farther away than the machine can count. In a canned cycle L takes 1 to 10000, and Q a depth above 0 that makes no more than 10000 pecks. Nothing was changed.";
        CycleBelowBottom = 200, "R lies below the bottom of the hole",
            "A canned cycle feeds from R down to its depth. Check the signs of R and of the depth, and whether G90 or G91 is in force.";
        CycleInverseTime = 201, "Canned cycles do not work in G93",
            "A cycle has several moves, G93 gives the time of one. Put G94 and a feed rate before it.";
        CycleNeedsSpindle = 202, "G86 needs a turning spindle",
            "G86 stops the spindle at the bottom and starts it again. Put M3 or M4 with a speed above zero before it.";
        NoSuchTool = 203, "The tool is not in the table of tool lengths",
            "G43 H and G10 L1 P take the tools that have a length: 1 to 16, settings 881 to 896. A higher number can be changed to with T and M6; without a length of its own leave G43 out, or measure after each change.";
        NothingKept = 204, "M72 has no modes to put in force again",
            "M70 keeps them, M71 and a reset forget them, and M72 uses them up. Put M70 before it.";
        NeedsProgram = 205, "Only a whole program can call, repeat or choose",
            "O words, M98, M99 and G65 need all lines of their program at once. Run the file from leadscrew's page, which sends the plain lines that it comes to.";
        Calculates = 206, "The line has a parameter or an expression",
            "Put options.expressions = true into the machine file, where the chip has room for it; or run the file from leadscrew's page, which sends the plain lines that it comes to.";
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}

impl core::error::Error for Status {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn numbers_are_those_of_grbl_one_more_and_our_own() {
        let numbers: Vec<_> = Status::ALL.iter().map(|code| code.number()).collect();
        let expected: Vec<_> = (1..=17)
            .chain(20..=38)
            .chain([52, 200, 201, 202, 203, 204, 205, 206])
            .collect();
        assert_eq!(numbers, expected);
    }

    #[test]
    fn a_code_is_found_by_its_number() {
        assert_eq!(Status::from_number(11), Some(Status::LineTooLong));
        assert_eq!(Status::from_number(18), None);
    }
}
