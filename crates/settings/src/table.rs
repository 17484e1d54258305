//! The table of all settings: `$$`, the checks and the documents are made from it.
//!
//! Numbers up to 255 are GRBL's. Numbers from 700 on are our own; GRBL answers `error:3` to them.
//! `$$` does not print our own, because senders count its 34 rows.

use super::group::Group;
use leadscrew_gcode::Number;
use leadscrew_protocol::system_command::OWN;

/// The values that a setting takes and the way it is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kind {
    /// One bit an axis or motor: 0 to 255; a fraction is cut.
    AxisMask,
    /// One bit an option: 0 to 255; a fraction is cut. The text has the names of the options from
    /// the lowest bit on, with commas between.
    Bits(&'static str),
    /// Off at 0, on at any other of 0 to 255; a fraction is cut.
    Switch,
    /// A whole number up to this; a fraction is cut.
    Whole {
        /// The largest value.
        max: u32,
    },
    /// An exact decimal, printed with 0 or 3 decimals.
    Decimal {
        /// Decimals in print, 0 or 3.
        places: u8,
        /// True if 0 is allowed.
        zero: bool,
    },
    /// An exact decimal to either side of 0, printed with 3 decimals.
    Signed {
        /// The largest absolute value.
        most: u32,
    },
}

/// Printed with 3 decimals, zero or more.
const DECIMAL: Kind = Kind::Decimal {
    places: 3,
    zero: true,
};
/// Printed with 3 decimals, more than zero.
const POSITIVE: Kind = Kind::Decimal {
    places: 3,
    zero: false,
};
/// Printed without decimals, zero or more.
const ROUNDED: Kind = Kind::Decimal {
    places: 0,
    zero: true,
};

/// One byte in GRBL.
const BYTE: Kind = Kind::Whole { max: 255 };
/// Seconds, up to eleven days.
const SECONDS: Kind = Kind::Whole { max: 1_000_000 };
/// A number of two bytes.
const WORD: Kind = Kind::Whole { max: 65_535 };

/// A setting of the machine, or a setting that each axis has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// The number after the `$`; the number for the first axis if each axis has the setting.
    pub number: u16,
    /// A short name.
    pub name: &'static str,
    /// The unit of its value, empty for none.
    pub unit: &'static str,
    /// Its effect, in one sentence; its name in a build without the feature `descriptions`.
    pub description: &'static str,
    /// The group of settings to which it belongs.
    pub group: Group,
    /// The values that it takes.
    pub kind: Kind,
    /// Its value in a new machine.
    pub default: Number,
    /// True if `$$` prints it.
    pub listed: bool,
}

/// A [`Row`] as it lies in flash: what follows from something else is left out, and rows share their
/// units and kinds. Code that makes rows takes 40 bytes for each.
struct Written {
    number: u16,
    name: &'static str,
    unit: &'static &'static str,
    #[cfg(feature = "descriptions")]
    description: &'static str,
    group: Group,
    kind: &'static Kind,
    /// The default, in 10⁻³.
    default: i32,
}

impl Written {
    #[inline(never)]
    const fn row(&self) -> Row {
        Row {
            number: self.number,
            name: self.name,
            unit: self.unit,
            #[cfg(feature = "descriptions")]
            description: self.description,
            #[cfg(not(feature = "descriptions"))]
            description: self.name,
            group: self.group,
            kind: *self.kind,
            default: Number::from_nanos(self.default as i64 * 1_000_000),
            listed: self.number < OWN,
        }
    }
}

macro_rules! rows {
    ($(#[$meta:meta])* $name:ident {
        $($(#[$built:meta])? $variant:ident = $number:literal, $group:ident, $kind:expr, $default:literal, $title:literal, $unit:literal, $description:literal;)*
    }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub enum $name {
            $($(#[$built])? #[doc = concat!("`$", $number, "`, ", $title, ". ", $description)] $variant,)*
        }

        impl $name {
            /// All of them, by rising number: `ALL[x as usize] == x`.
            pub const ALL: &'static [Self] = &[$($(#[$built])? Self::$variant),*];

            /// Returns the row. The table writes defaults in 10⁻³, the row has the exact number.
            pub const fn row(self) -> Row {
                self.written().row()
            }

            const fn written(self) -> &'static Written {
                match self {
                    $($(#[$built])? Self::$variant => &Written {
                        number: $number,
                        name: $title,
                        unit: &$unit,
                        #[cfg(feature = "descriptions")]
                        description: $description,
                        group: Group::$group,
                        kind: &$kind,
                        default: $default,
                    },)*
                }
            }
        }
    };
}

rows! {
    /// Settings that the machine has once. Defaults are in thousandths.
    Setting {
        StepPulse = 0, Motors, BYTE, 10_000, "Step pulse", "us",
            "Length of a step pulse. The board says how short it may be; 3 in Grbl.";
        IdleDelay = 1, Motors, BYTE, 25_000, "Motor idle delay", "ms",
            "Motors stay enabled for so long after motion; 255 keeps them enabled.";
        StepInvert = 2, Motors, Kind::AxisMask, 0, "Step invert", "mask",
            "Inverts the step outputs, one bit a motor.";
        DirectionInvert = 3, Motors, Kind::AxisMask, 0, "Direction invert", "mask",
            "Reverses motors, one bit a motor.";
        EnableInvert = 4, Motors, Kind::Switch, 0, "Enable invert", "",
            "Inverts the motor enable output.";
        LimitInvert = 5, Switches, Kind::Switch, 0, "Limit switch invert", "",
            "Takes the limit inputs as active when high.";
        ProbeInvert = 6, Switches, Kind::Switch, 0, "Probe invert", "",
            "Takes the probe input as active when high.";
        ReportMask = 10, Reports, Kind::Bits("Machine position,Buffers,Line number,Time to finish"), 1_000, "Status report fields", "mask",
            "1 reports machine position instead of work position, 2 adds the free buffers, 4 the line (Ln:), 8 the time to finish (Fin: s).";
        JunctionDeviation = 11, Motion, DECIMAL, 10, "Junction deviation", "mm",
            "How far a circle that touches both moves may cut a corner: higher is faster through corners.";
        ArcTolerance = 12, Motion, POSITIVE, 2, "Arc tolerance", "mm",
            "How far the chords of an arc may stray from it.";
        Inches = 13, Reports, Kind::Switch, 0, "Report inches", "",
            "Reports positions and feeds in inches.";
        SoftLimits = 20, Switches, Kind::Switch, 0, "Soft limits", "",
            "Refuses motion beyond the travel; needs homing.";
        HardLimits = 21, Switches, Kind::Switch, 0, "Hard limits", "",
            "Stops at once when a limit switch is hit.";
        Homing = 22, Homing, Kind::Switch, 0, "Homing", "",
            "Locks the machine at power-up until it is homed.";
        HomingDirection = 23, Homing, Kind::AxisMask, 0, "Homing direction invert", "mask",
            "Homes these axes towards their negative end, one bit an axis.";
        HomingFeed = 24, Homing, DECIMAL, 25_000, "Homing locate feed", "mm/min",
            "Slow speed that locates the switch.";
        HomingSeek = 25, Homing, DECIMAL, 500_000, "Homing search seek", "mm/min",
            "Fast speed that searches for the switch.";
        HomingDebounce = 26, Homing, WORD, 250_000, "Homing switch debounce", "ms",
            "Pause between the phases of homing.";
        HomingPullOff = 27, Homing, DECIMAL, 1_000, "Homing pull-off", "mm",
            "Way off the switch after homing.";
        MaxSpeed = 30, Tool, ROUNDED, 1_000_000, "Maximum spindle speed", "1/min",
            "The speed or laser power S that gives full output.";
        MinSpeed = 31, Tool, ROUNDED, 0, "Minimum spindle speed", "1/min",
            "The speed or laser power S that gives the least output.";
        Laser = 32, Tool, Kind::Switch, 0, "Laser mode", "",
            "Changes power in motion, without stops, and switches it off in rapids.";
        FaultTexts = 700, Reports, Kind::Switch, 0, "Faults in words", "",
            "Sends a message with the reason before each refused line and after each fault.";
        StartSilence = 701, Streaming, WORD, 0, "Start silence", "ms",
            "Motion starts when no line has come for so long or enough moves wait; 0 starts as Grbl, when no line waits, with 15 moves or after 5 ms.";
        SecondMotorOffset = 702, Homing, Kind::Signed { most: 25 }, 0, "Second motor offset", "mm",
            "How far the second motor of an axis goes on after its switch when homing squares the axis; back if negative.";
        #[cfg(feature = "rasters")]
        LaserLead = 703, Tool, Kind::Whole { max: leadscrew_planner::LONGEST_LEAD }, 0, "Laser lead", "us",
            "Changes a laser's power so long before the motion that it belongs to: the delay with which the laser switches.";
        #[cfg(feature = "curves")]
        GrblCorners = 704, Motion, Kind::Switch, 0, "Grbl's corner rule", "",
            "Bounds speed by junction deviation alone, as Grbl does: quicker round arcs and curves, at more than their acceleration.";
        #[cfg(feature = "jerk")]
        Jerk = 705, Motion, ROUNDED, 0, "Jerk", "mm/s3",
            "How fast the acceleration along the path may change; 0 for no limit.";
        SwitchFilter = 706, Switches, Kind::Whole { max: 10_000 }, 200_000, "Switch filter", "us",
            "How long a switch keeps a new level before it counts: longer than the spikes of a spindle's cable.";
        LaserPatience = 707, Tool, DECIMAL, 2_000, "Laser dead-man", "s",
            "A laser that is lit at rest goes dark when its sender has been silent for so long; 0 for never.";
        #[cfg(feature = "jerk")]
        Resonance = 708, Motion, DECIMAL, 0, "Resonance", "Hz",
            "Motion along the path does not set off a vibration of this frequency, from 10 Hz on; 0 for none.";
        DirectionSetup = 709, Motors, Kind::Whole { max: 100 }, 1_000, "Direction set-up", "us",
            "How long before a step its direction is there at least, as the driver asks for.";
        StallReserve = 710, Streaming, DECIMAL, 1_000, "Stall reserve", "s",
            "A sender may stall for so long in motion: lines wait for their answers while more than this, braking and 15 moves are queued; 0 queues as many as fit.";
        #[cfg(feature = "cycles")]
        PeckClearance = 711, Motion, DECIMAL, 254, "Peck clearance", "mm",
            "How far G73 goes back after a peck, and how far above the last bottom G83 begins to feed again.";
        SpinUp = 712, Tool, DECIMAL, 4_000, "Spindle spin-up", "s",
            "After a hold in which 0x9E has stopped the spindle, motion waits for so long until it is up to speed; 0 for no wait.";
        ArcMismatch = 713, Motion, DECIMAL, 5, "Arc mismatch", "mm",
            "How much farther from an arc's centre one end may be than the other. Beyond 0.005 mm and 0.1 % of the radius the centre is moved to fit.";
        ArcMismatchShare = 714, Motion, DECIMAL, 100, "Arc mismatch share", "%",
            "The same as a share of the radius, up to 0.5 mm.";
        JogsEnd = 715, Switches, Kind::Switch, 0, "Jogs end at travel", "",
            "With soft limits, a jog beyond the travel ends there; 0 refuses it.";
        SpindleRunUp = 716, Tool, DECIMAL, 0, "Spindle run-up", "s",
            "After M3 or M4 starts or reverses a spindle, the program waits for so long.";
        SpindleRunUpBySpeed = 717, Tool, DECIMAL, 0, "Spindle run-up by speed", "s",
            "The program waits for so long for each 1000/min by which M3, M4 or S changes the speed.";
        SpindleRunDown = 718, Tool, DECIMAL, 0, "Spindle run-down", "s",
            "After M5, and before a spindle is reversed, the program waits for so long.";
        OwnHomes = 719, Homing, Kind::AxisMask, 0, "Home place set", "mask",
            "These axes have their switch at the machine position of $740 and up; others as in Grbl.";
        SpindleSilence = 720, Silence, SECONDS, 0, "Spindle dead-man", "s",
            "Stops a spindle that turns at rest, in a hold, when its sender has been silent for so long; 0 for never.";
        CoolantSilence = 721, Silence, SECONDS, 0, "Coolant dead-man", "s",
            "Shuts coolant that is on at rest, in a hold, when its sender has been silent for so long; 0 for never.";
        HeatSilence = 722, Silence, SECONDS, 300_000, "Heaters dead-man", "s",
            "Heaters that are on at rest go off when their sender has been silent for so long; 0 for never.";
        OutputsSilence = 723, Silence, SECONDS, 0, "Outputs dead-man", "s",
            "Switches outputs off that are on at rest, in a hold, when their sender has been silent for so long; 0 for never.";
        LaserUnfed = 724, Silence, SECONDS, 60_000, "Laser without G-code", "s",
            "As $707, when no G-code has come for so long; 0 for never.";
        SpindleUnfed = 725, Silence, SECONDS, 600_000, "Spindle without G-code", "s",
            "As $720, when no G-code has come for so long; 0 for never.";
        CoolantUnfed = 726, Silence, SECONDS, 600_000, "Coolant without G-code", "s",
            "As $721, when no G-code has come for so long; 0 for never.";
        HeatUnfed = 727, Silence, SECONDS, 1_800_000, "Heaters without G-code", "s",
            "As $722, when no G-code has come for so long; 0 for never.";
        OutputsUnfed = 728, Silence, SECONDS, 600_000, "Outputs without G-code", "s",
            "As $723, when no G-code has come for so long; 0 for never.";
    }
}

rows! {
    /// Settings of each axis: the number of the first axis, and those after it. Defaults are in
    /// thousandths.
    AxisSetting {
        StepsPerMm = 100, Axes, POSITIVE, 250_000, "Steps per millimetre", "step/mm",
            "Motor steps for a millimetre, or a degree.";
        MaxRate = 110, Axes, POSITIVE, 500_000, "Maximum rate", "mm/min",
            "Fastest motion of the axis, and its speed in rapids.";
        Acceleration = 120, Axes, POSITIVE, 10_000, "Acceleration", "mm/s2",
            "How quickly the axis changes speed.";
        Travel = 130, Axes, DECIMAL, 200_000, "Travel", "mm",
            "How far the axis goes from its home, for soft limits and homing.";
        HomePlace = 740, Axes, Kind::Signed { most: 1_000_000 }, 0, "Home place", "mm",
            "Machine position of the switch, where $719 has the axis.";
        PullOff = 750, Axes, DECIMAL, 0, "Pull-off", "mm",
            "Way off the switch after homing; 0 for $27.";
        HomeSeek = 760, Axes, DECIMAL, 0, "Home search seek", "mm/min",
            "Speed that searches for the switch; 0 for $25.";
        HomeFeed = 770, Axes, DECIMAL, 0, "Home locate feed", "mm/min",
            "Speed that locates the switch; 0 for $24.";
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn all() -> Vec<Row> {
        let scalars = Setting::ALL.iter().map(|setting| setting.row());
        scalars
            .chain(AxisSetting::ALL.iter().map(|setting| setting.row()))
            .collect()
    }

    #[test]
    fn a_setting_s_place_in_the_table_is_its_discriminant() {
        assert!(Setting::ALL
            .iter()
            .enumerate()
            .all(|(place, setting)| *setting as usize == place));
        assert!(AxisSetting::ALL
            .iter()
            .enumerate()
            .all(|(place, setting)| *setting as usize == place));
    }

    #[test]
    fn numbers_are_unique_and_groups_of_axes_ten_apart_or_more() {
        let mut numbers: Vec<u16> = all().iter().map(|row| row.number).collect();
        numbers.sort_unstable();
        assert!(numbers.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(AxisSetting::ALL
            .windows(2)
            .all(|pair| pair[1].row().number - pair[0].row().number >= 10));
    }

    #[test]
    fn only_our_own_settings_are_hidden() {
        for row in all() {
            assert_eq!(row.listed, row.number < 256, "${}", row.number);
        }
    }

    #[test]
    fn every_row_is_described_without_words_that_senders_take_for_answers() {
        for row in all() {
            assert!(
                !row.name.is_empty() && row.description.ends_with('.'),
                "${}",
                row.number
            );
            let words = std::format!("{} {}", row.name, row.description).to_ascii_lowercase();
            assert!(
                !words.contains("ok") && !words.contains("error"),
                "${}",
                row.number
            );
        }
    }
}
