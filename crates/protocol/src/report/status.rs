//! The answer to `?`.

use super::{fields, Coordinates, Units, AXIS_LETTERS};
use crate::cadence::Extra;
use crate::decimal::Decimal;
use core::fmt;
use leadscrew_gcode::Number;

/// Overrides in percent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OverridePercents {
    /// Feed, 10 to 200.
    pub feed: u8,
    /// Rapids, 25, 50 or 100.
    pub rapid: u8,
    /// Spindle, 10 to 200.
    pub spindle: u8,
}

/// The direction in which the spindle turns while its output is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Turning {
    /// Off, or on with speed 0.
    Not,
    /// M3.
    Clockwise,
    /// M4.
    Counterclockwise,
}

/// The accessories that are on: the letters of `A:`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Accessories {
    /// The spindle.
    pub spindle: Turning,
    /// True if flood coolant is on.
    pub flood: bool,
    /// True if mist coolant is on.
    pub mist: bool,
}

impl fmt::Display for Accessories {
    /// Writes `|A:` and the letters, or nothing if all is off.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let spindle = match self.spindle {
            Turning::Not => "",
            Turning::Clockwise => "S",
            Turning::Counterclockwise => "C",
        };
        let flood = if self.flood { "F" } else { "" };
        let mist = if self.mist { "M" } else { "" };
        if spindle.is_empty() && !self.flood && !self.mist {
            return Ok(());
        }
        write!(f, "|A:{spindle}{flood}{mist}")
    }
}

/// The inputs that are active: the letters of `Pn:`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pins {
    /// The probe touches.
    pub probe: bool,
    /// Limit switches, one bit an axis.
    pub limits: u8,
    /// The safety door is open.
    pub door: bool,
    /// The reset button.
    pub reset: bool,
    /// The feed hold button.
    pub hold: bool,
    /// The cycle start button.
    pub start: bool,
}

impl fmt::Display for Pins {
    /// Writes `|Pn:` and the letters, or nothing if none is active.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if *self == Self::default() {
            return Ok(());
        }
        let when = |active, letter| if active { letter } else { "" };
        write!(f, "|Pn:{}", when(self.probe, "P"))?;
        for (axis, letter) in AXIS_LETTERS.iter().enumerate().take(8) {
            if self.limits >> axis & 1 == 1 {
                write!(f, "{letter}")?;
            }
        }
        let (door, reset) = (when(self.door, "D"), when(self.reset, "R"));
        let (hold, start) = (when(self.hold, "H"), when(self.start, "S"));
        write!(f, "{door}{reset}{hold}{start}")
    }
}

/// Room for further moves and bytes, the field `Bf:`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Room {
    /// Moves that can still be planned.
    pub moves: usize,
    /// Bytes that the receive queue still takes.
    pub bytes: usize,
}

/// The answer to `?`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StatusReport<const AXES: usize> {
    /// The state with its sub-state, as Grbl spells it: `Hold:0`.
    pub state: &'static str,
    /// Machine position, mm.
    pub position: Coordinates<AXES>,
    /// All offsets added up, mm: work position is machine position less this.
    pub work_offset: Coordinates<AXES>,
    /// `$10`: see [`Self::MACHINE_POSITION`] and the constants after it.
    pub mask: u8,
    /// Room for further moves and bytes.
    pub room: Room,
    /// Line of the move under way, if it is reported.
    pub line_number: Option<u32>,
    /// Time to finish the queued moves, s, if it is reported.
    pub time_left: Option<Number>,
    /// Actual feed, mm/min.
    pub feed: Number,
    /// Spindle speed with the override, in the unit of `S`; for a laser, the `S` of the power that
    /// is put out. 0 when off.
    pub speed: Number,
    /// Active inputs.
    pub pins: Pins,
    /// Overrides.
    pub overrides: OverridePercents,
    /// The accessories that are on.
    pub accessories: Accessories,
    /// The occasional fields of this report.
    pub extra: Extra,
    /// Unit of lengths and feeds.
    pub units: Units<AXES>,
}

impl<const AXES: usize> StatusReport<AXES> {
    /// Bit of `$10`: machine position rather than work position.
    pub const MACHINE_POSITION: u8 = fields::MACHINE_POSITION;
    /// Bit of `$10`: `Bf:`.
    pub const ROOM: u8 = fields::ROOM;
    /// Bit of `$10`: `Ln:` for lines without an `N` word, too.
    pub const LINE: u8 = fields::LINE;
    /// Bit of `$10`: `Fin:`, the time to finish the queued moves, seconds.
    pub const TIME_LEFT: u8 = fields::TIME_LEFT;

    fn positions(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.mask & Self::MACHINE_POSITION != 0 {
            f.write_str("|MPos:")?;
            return self.units.list(f, &self.position);
        }
        f.write_str("|WPos:")?;
        let mut work = self.position;
        for (value, offset) in work.iter_mut().zip(self.work_offset) {
            *value = Number::from_nanos(value.nanos().saturating_sub(offset.nanos()));
        }
        self.units.list(f, &work)
    }

    fn extras(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.extra {
            Extra::None => Ok(()),
            Extra::WorkOffset => {
                f.write_str("|WCO:")?;
                self.units.list(f, &self.work_offset)
            }
            Extra::Overrides => {
                let OverridePercents {
                    feed,
                    rapid,
                    spindle,
                } = self.overrides;
                write!(f, "|Ov:{feed},{rapid},{spindle}{}", self.accessories)
            }
        }
    }
}

impl<const AXES: usize> fmt::Display for StatusReport<AXES> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(f, |_| Ok(()))
    }
}

impl<const AXES: usize> StatusReport<AXES> {
    /// Writes the report, with the output of `others` as its last fields.
    pub fn write(
        &self,
        f: &mut fmt::Formatter<'_>,
        others: impl FnOnce(&mut fmt::Formatter<'_>) -> fmt::Result,
    ) -> fmt::Result {
        write!(f, "<{}", self.state)?;
        self.positions(f)?;
        if self.mask & Self::ROOM != 0 {
            write!(f, "|Bf:{},{}", self.room.moves, self.room.bytes)?;
        }
        if let Some(number) = self.line_number {
            write!(f, "|Ln:{number}")?;
        }
        if let Some(seconds) = self.time_left {
            write!(f, "|Fin:{}", Decimal::tenths(seconds))?;
        }
        let (feed, speed) = (self.units.feed(self.feed), Decimal::whole(self.speed));
        write!(f, "|FS:{feed},{speed}{}", self.pins)?;
        self.extras(f)?;
        others(f)?;
        f.write_str(">")
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{number, xyz, INCHES, MILLIMETRES};
    use super::super::MAX_LINE;
    use super::*;
    use leadscrew_interpreter::AxisKind;
    use std::string::ToString;

    fn idle() -> StatusReport<3> {
        StatusReport {
            state: "Idle",
            position: xyz("0", "0", "0"),
            work_offset: xyz("0", "0", "0"),
            mask: 1,
            room: Room {
                moves: 15,
                bytes: 128,
            },
            line_number: None,
            time_left: None,
            feed: number("0"),
            speed: number("0"),
            pins: Pins::default(),
            overrides: OverridePercents {
                feed: 100,
                rapid: 100,
                spindle: 100,
            },
            accessories: Accessories {
                spindle: Turning::Not,
                flood: false,
                mist: false,
            },
            extra: Extra::None,
            units: MILLIMETRES,
        }
    }

    #[test]
    fn a_plain_report_has_state_position_feed_and_speed() {
        assert_eq!(idle().to_string(), "<Idle|MPos:0.000,0.000,0.000|FS:0,0>");
    }

    #[test]
    fn the_fields_come_in_grbl_s_order() {
        let report = StatusReport {
            state: "Hold:1",
            position: xyz("1.5", "-2", "0.0004"),
            mask: 3,
            line_number: Some(20),
            time_left: Some(number("61.25")),
            feed: number("380.4"),
            speed: number("1000"),
            pins: Pins {
                probe: true,
                limits: 0b101,
                hold: true,
                start: true,
                ..Pins::default()
            },
            extra: Extra::WorkOffset,
            work_offset: xyz("5", "0", "-1"),
            ..idle()
        };
        let expected =
            "<Hold:1|MPos:1.500,-2.000,0.000|Bf:15,128|Ln:20|Fin:61.3|FS:380,1000|Pn:PXZHS|WCO:5.000,0.000,-1.000>";
        assert_eq!(report.to_string(), expected);
    }

    #[test]
    fn work_position_is_machine_position_less_the_offset() {
        let report = StatusReport {
            position: xyz("1", "2", "3"),
            work_offset: xyz("5", "-1", "0"),
            mask: 2,
            ..idle()
        };
        assert_eq!(
            report.to_string(),
            "<Idle|WPos:-4.000,3.000,3.000|Bf:15,128|FS:0,0>"
        );
    }

    #[test]
    fn accessories_come_with_the_overrides_only() {
        let accessories = Accessories {
            spindle: Turning::Counterclockwise,
            flood: true,
            mist: true,
        };
        let report = StatusReport {
            accessories,
            extra: Extra::Overrides,
            ..idle()
        };
        assert_eq!(
            report.to_string(),
            "<Idle|MPos:0.000,0.000,0.000|FS:0,0|Ov:100,100,100|A:CFM>"
        );
        let silent = StatusReport {
            extra: Extra::WorkOffset,
            ..report
        };
        assert!(!silent.to_string().contains("|A:"));
    }

    #[test]
    fn inches_have_four_decimals_and_their_feed_one() {
        let report = StatusReport {
            position: xyz("27.4", "0", "0"),
            feed: number("50"),
            units: INCHES,
            ..idle()
        };
        assert_eq!(
            report.to_string(),
            "<Idle|MPos:1.0787,0.0000,0.0000|FS:2.0,0>"
        );
    }

    #[test]
    fn degrees_never_become_inches() {
        let units = Units {
            inches: true,
            axes: [AxisKind::Linear, AxisKind::Linear, AxisKind::Rotary],
        };
        let report = StatusReport {
            position: xyz("25.4", "0", "90"),
            units,
            ..idle()
        };
        assert_eq!(
            report.to_string(),
            "<Idle|MPos:1.0000,0.0000,90.000|FS:0.0,0>"
        );
    }

    #[test]
    fn all_pins_have_their_letters_in_order() {
        let all = Pins {
            probe: true,
            limits: 0b111,
            door: true,
            reset: true,
            hold: true,
            start: true,
        };
        assert_eq!(all.to_string(), "|Pn:PXYZDRHS");
        let two = Pins {
            limits: 0b110,
            ..Pins::default()
        };
        assert_eq!(two.to_string(), "|Pn:YZ");
    }

    #[test]
    fn the_longest_report_of_six_axes_keeps_to_the_bound() {
        let report = StatusReport::<6> {
            state: "Door:2",
            position: [Number::from_nanos(-i64::MAX); 6],
            work_offset: [Number::from_nanos(-i64::MAX); 6],
            mask: 3,
            room: Room {
                moves: 65535,
                bytes: 65535,
            },
            line_number: Some(u32::MAX),
            time_left: Some(Number::MAX),
            feed: Number::MAX,
            speed: Number::MAX,
            pins: Pins {
                probe: true,
                limits: 0x3f,
                door: true,
                reset: true,
                hold: true,
                start: true,
            },
            overrides: OverridePercents {
                feed: 200,
                rapid: 100,
                spindle: 200,
            },
            accessories: Accessories {
                spindle: Turning::Clockwise,
                flood: true,
                mist: true,
            },
            extra: Extra::WorkOffset,
            units: Units {
                inches: false,
                axes: [AxisKind::Linear; 6],
            },
        };
        assert!(
            report.to_string().len() <= MAX_LINE,
            "{}",
            report.to_string().len()
        );
    }
}
