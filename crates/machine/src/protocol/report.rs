//! Answers to `?`, `$#`, `$G`, `$I`, `$N` and `$`: snapshots of plain values that are displayed as one line each, without
//! its end.
//!
//! A list such as `$#` is one line at a time, so that a status report can go between two lines and never inside one, and
//! nobody has to hold a whole list. No line is longer than [`MAX_LINE`].

use super::cadence::Extra;
use super::decimal::Decimal;
use core::fmt;
use leadscrew_gcode::Number;

/// The longest line of a machine with up to six axes, in characters: a status report with the largest values in all
/// fields. Three axes and a sane machine stay below 120.
pub const MAX_LINE: usize = 320;

/// The line after power-up and each reset. An empty line goes before it.
pub const BANNER: &str = "Grbl 1.1h ['$' for help]";

/// The answer to `$`.
pub const HELP: &str = "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]";

/// Letters of the axes, in order.
pub const AXIS_LETTERS: [char; 9] = ['X', 'Y', 'Z', 'A', 'B', 'C', 'U', 'V', 'W'];

/// Machine coordinates, or offsets, of all axes.
pub type Coordinates<const AXES: usize> = [Number; AXES];

/// In which unit lengths and feeds are reported, `$13`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Units<const AXES: usize> {
    /// Inches, not millimetres.
    pub inches: bool,
    /// Which axes turn: degrees in any case.
    pub rotary: [bool; AXES],
}

impl<const AXES: usize> Units<AXES> {
    fn length(&self, value: Number) -> Decimal {
        if self.inches {
            Decimal::inches(value)
        } else {
            Decimal::millimetres(value)
        }
    }

    fn feed(&self, value: Number) -> Decimal {
        if self.inches {
            Decimal::inches_per_minute(value)
        } else {
            Decimal::whole(value)
        }
    }

    /// Writes coordinates, with commas between them.
    fn list(&self, f: &mut fmt::Formatter<'_>, values: &Coordinates<AXES>) -> fmt::Result {
        let mut comma = "";
        for (value, rotary) in values.iter().zip(self.rotary) {
            let value = if rotary {
                Decimal::millimetres(*value)
            } else {
                self.length(*value)
            };
            write!(f, "{comma}{value}")?;
            comma = ",";
        }
        Ok(())
    }
}

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

/// Which way the spindle turns while its output is on.
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

/// What is switched on: the letters of `A:`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Accessories {
    /// The spindle.
    pub spindle: Turning,
    /// Flood coolant.
    pub flood: bool,
    /// Mist coolant.
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

/// Which inputs are active: the letters of `Pn:`.
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

/// Room for more, the field `Bf:`.
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
    /// `$10`: bit 0 asks for machine position rather than work position, bit 1 for `Bf:`.
    pub mask: u8,
    /// Room for more.
    pub room: Room,
    /// Line number of the move under way, on machines that report it.
    pub line_number: Option<u32>,
    /// Actual feed, mm/min.
    pub feed: Number,
    /// Spindle speed or laser power as programmed and overridden, 0 when off.
    pub speed: Number,
    /// Active inputs.
    pub pins: Pins,
    /// Overrides.
    pub overrides: OverridePercents,
    /// What is switched on.
    pub accessories: Accessories,
    /// What this report carries now and then.
    pub extra: Extra,
    /// Unit of lengths and feeds.
    pub units: Units<AXES>,
}

impl<const AXES: usize> StatusReport<AXES> {
    const MACHINE_POSITION: u8 = 1;
    const ROOM: u8 = 2;

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
        write!(f, "<{}", self.state)?;
        self.positions(f)?;
        if self.mask & Self::ROOM != 0 {
            write!(f, "|Bf:{},{}", self.room.moves, self.room.bytes)?;
        }
        if let Some(number) = self.line_number {
            write!(f, "|Ln:{number}")?;
        }
        let (feed, speed) = (self.units.feed(self.feed), Decimal::whole(self.speed));
        write!(f, "|FS:{feed},{speed}{}", self.pins)?;
        self.extras(f)?;
        f.write_str(">")
    }
}

/// The answer to `$G`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModesReport {
    /// Motion mode, as in `G38.2`: 0, 1, 2, 3, 38.2 to 38.5, 80.
    pub motion: Number,
    /// 54 to 59.
    pub coordinate_system: u8,
    /// 17 to 19.
    pub plane: u8,
    /// 20 or 21.
    pub units: u8,
    /// 90 or 91.
    pub distance: u8,
    /// 93 or 94.
    pub feed_mode: u8,
    /// 3, 4 or 5.
    pub spindle: u8,
    /// M7 is in force.
    pub mist: bool,
    /// M8 is in force.
    pub flood: bool,
    /// M56 is in force: parking is allowed, on machines with parking override control.
    pub parking: bool,
    /// Tool of the last line.
    pub tool: u8,
    /// Programmed feed, mm/min (or 1/min in G93).
    pub feed: Number,
    /// Programmed spindle speed.
    pub speed: Number,
    /// `$13`: show the feed in inch/min.
    pub inches: bool,
}

impl fmt::Display for ModesReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            motion,
            coordinate_system,
            plane,
            units,
            distance,
            feed_mode,
            spindle,
            ..
        } = self;
        write!(f, "[GC:G{motion} G{coordinate_system} G{plane} G{units} G{distance} G{feed_mode} M{spindle}")?;
        f.write_str(match (self.mist, self.flood) {
            (false, false) => " M9",
            (true, false) => " M7",
            (false, true) => " M8",
            (true, true) => " M7 M8",
        })?;
        if self.parking {
            f.write_str(" M56")?;
        }
        let units = Units {
            inches: self.inches,
            rotary: [],
        };
        write!(
            f,
            " T{} F{} S{}]",
            self.tool,
            units.feed(self.feed),
            Decimal::whole(self.speed)
        )
    }
}

/// What `$#` shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parameters<const AXES: usize> {
    /// G54 to G59.
    pub systems: [Coordinates<AXES>; 6],
    /// G28.
    pub home: Coordinates<AXES>,
    /// G30.
    pub second_home: Coordinates<AXES>,
    /// G92.
    pub temporary: Coordinates<AXES>,
    /// Tool length offset, mm.
    pub tool_length: Number,
    /// Where the probe touched last.
    pub probed: ProbeReport<AXES>,
    /// Unit of lengths.
    pub units: Units<AXES>,
}

impl<const AXES: usize> Parameters<AXES> {
    /// How many lines `$#` has.
    pub const LINES: usize = 11;

    /// Answers a line of `$#`, from 0; `None` beyond the last.
    pub fn line(&self, index: usize) -> Option<ParameterLine<'_, AXES>> {
        const NAMES: [&str; 9] = [
            "G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30", "G92",
        ];
        let offsets = self
            .systems
            .iter()
            .chain([&self.home, &self.second_home, &self.temporary]);
        let units = &self.units;
        match (NAMES.get(index), offsets.into_iter().nth(index)) {
            (Some(name), Some(values)) => Some(ParameterLine::Offset {
                name,
                values,
                units,
            }),
            _ if index == NAMES.len() => Some(ParameterLine::ToolLength {
                length: self.tool_length,
                units,
            }),
            _ if index == NAMES.len() + 1 => Some(ParameterLine::Probe(&self.probed)),
            _ => None,
        }
    }
}

/// One line of `$#`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterLine<'a, const AXES: usize> {
    /// A coordinate system or stored position.
    Offset {
        /// Its G-word.
        name: &'static str,
        /// Its value, mm.
        values: &'a Coordinates<AXES>,
        /// Unit of lengths.
        units: &'a Units<AXES>,
    },
    /// Tool length offset.
    ToolLength {
        /// Its value, mm.
        length: Number,
        /// Unit of lengths.
        units: &'a Units<AXES>,
    },
    /// The probed position.
    Probe(&'a ProbeReport<AXES>),
}

impl<const AXES: usize> fmt::Display for ParameterLine<'_, AXES> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Offset {
                name,
                values,
                units,
            } => {
                write!(f, "[{name}:")?;
                units.list(f, values)?;
                f.write_str("]")
            }
            Self::ToolLength { length, units } => write!(f, "[TLO:{}]", units.length(*length)),
            Self::Probe(probe) => probe.fmt(f),
        }
    }
}

/// `[PRB:`: after a probing motion and in `$#`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProbeReport<const AXES: usize> {
    /// Machine position of the contact, mm.
    pub position: Coordinates<AXES>,
    /// Whether the last probing motion made contact.
    pub success: bool,
    /// Unit of lengths.
    pub units: Units<AXES>,
}

impl<const AXES: usize> fmt::Display for ProbeReport<AXES> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("[PRB:")?;
        self.units.list(f, &self.position)?;
        write!(f, ":{}]", u8::from(self.success))
    }
}

/// `[VER:`, the first line of `$I`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VersionLine<'a> {
    /// What `$I=` stored.
    pub text: &'a [u8],
}

impl fmt::Display for VersionLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[VER:1.1h.20190830:{}]", Ascii(self.text))
    }
}

/// `[OPT:`, the second line of `$I`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OptionsLine {
    /// Line numbers in status reports.
    pub line_numbers: bool,
    /// M7.
    pub mist: bool,
    /// Parking.
    pub parking: bool,
    /// `$HX`, `$HY`, `$HZ`.
    pub single_axis_homing: bool,
    /// M56.
    pub parking_override: bool,
    /// A safety door switch.
    pub door: bool,
    /// Moves that can be planned ahead.
    pub moves: usize,
    /// Bytes that the receive queue takes.
    pub bytes: usize,
}

impl fmt::Display for OptionsLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let letters = [
            (self.line_numbers, "N"),
            (self.mist, "M"),
            (self.parking, "P"),
            (self.single_axis_homing, "H"),
            (self.parking_override, "R"),
            (self.door, "+"),
        ];
        f.write_str("[OPT:V")?;
        for (_, letter) in letters.iter().filter(|(present, _)| *present) {
            f.write_str(letter)?;
        }
        write!(f, ",{},{}]", self.moves, self.bytes)
    }
}

/// A line of `$N`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StartupLine<'a> {
    /// 0 or 1.
    pub index: u8,
    /// What is stored there.
    pub line: &'a [u8],
}

impl fmt::Display for StartupLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "$N{}={}", self.index, Ascii(self.line))
    }
}

/// Filtered text: ASCII. Whatever else a damaged store may yield is left out.
struct Ascii<'a>(&'a [u8]);

impl fmt::Display for Ascii<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use fmt::Write;
        self.0
            .iter()
            .filter(|byte| byte.is_ascii_graphic())
            .try_for_each(|byte| f.write_char(char::from(*byte)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::{String, ToString};
    use std::vec::Vec;

    const MILLIMETRES: Units<3> = Units {
        inches: false,
        rotary: [false; 3],
    };
    const INCHES: Units<3> = Units {
        inches: true,
        rotary: [false; 3],
    };

    fn number(text: &str) -> Number {
        leadscrew_gcode::leading_number(text.as_bytes()).unwrap().0
    }

    fn xyz(x: &str, y: &str, z: &str) -> Coordinates<3> {
        [x, y, z].map(number)
    }

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
            "<Hold:1|MPos:1.500,-2.000,0.000|Bf:15,128|Ln:20|FS:380,1000|Pn:PXZHS|WCO:5.000,0.000,-1.000>";
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
            rotary: [false, false, true],
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
                rotary: [false; 6],
            },
        };
        assert!(
            report.to_string().len() <= MAX_LINE,
            "{}",
            report.to_string().len()
        );
    }

    fn modes() -> ModesReport {
        ModesReport {
            motion: number("0"),
            coordinate_system: 54,
            plane: 17,
            units: 21,
            distance: 90,
            feed_mode: 94,
            spindle: 5,
            mist: false,
            flood: false,
            parking: false,
            tool: 0,
            feed: number("0"),
            speed: number("0"),
            inches: false,
        }
    }

    #[test]
    fn modes_are_words_one_blank_apart() {
        assert_eq!(
            modes().to_string(),
            "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]"
        );
        let other = ModesReport {
            motion: number("38.2"),
            coordinate_system: 59,
            spindle: 3,
            parking: true,
            tool: 255,
            feed: number("2.5"),
            speed: number("12345.6"),
            ..modes()
        };
        assert_eq!(
            other.to_string(),
            "[GC:G38.2 G59 G17 G21 G90 G94 M3 M9 M56 T255 F3 S12346]"
        );
    }

    #[test]
    fn coolant_is_m9_or_whichever_is_on() {
        let coolant = |mist, flood| {
            ModesReport {
                mist,
                flood,
                ..modes()
            }
            .to_string()
        };
        assert!(coolant(true, true).contains(" M5 M7 M8 T0"));
        assert!(coolant(true, false).contains(" M5 M7 T0"));
        assert!(coolant(false, true).contains(" M5 M8 T0"));
    }

    #[test]
    fn the_feed_is_shown_in_the_unit_of_reports() {
        let report = ModesReport {
            feed: number("254"),
            inches: true,
            units: 20,
            ..modes()
        };
        assert_eq!(
            report.to_string(),
            "[GC:G0 G54 G17 G20 G90 G94 M5 M9 T0 F10.0 S0]"
        );
    }

    #[test]
    fn parameters_are_eleven_lines() {
        let zero = xyz("0", "0", "0");
        let probed = ProbeReport {
            position: xyz("0", "0", "-2"),
            success: true,
            units: MILLIMETRES,
        };
        let mut parameters = Parameters {
            systems: [zero; 6],
            home: xyz("1", "0", "0"),
            second_home: zero,
            temporary: xyz("-25.4", "0", "0"),
            tool_length: number("12.7"),
            probed,
            units: MILLIMETRES,
        };
        parameters.systems[5] = xyz("5", "6", "-0.0001");
        let lines: Vec<String> = (0..)
            .map_while(|index| parameters.line(index))
            .map(|line| line.to_string())
            .collect();
        assert_eq!(lines.len(), Parameters::<3>::LINES);
        let expected = [
            "[G59:5.000,6.000,0.000]",
            "[G28:1.000,0.000,0.000]",
            "[G30:0.000,0.000,0.000]",
            "[G92:-25.400,0.000,0.000]",
            "[TLO:12.700]",
            "[PRB:0.000,0.000,-2.000:1]",
        ];
        assert_eq!(lines[5..], expected);
    }

    #[test]
    fn the_build_is_two_lines() {
        assert_eq!(
            VersionLine { text: b"" }.to_string(),
            "[VER:1.1h.20190830:]"
        );
        assert_eq!(
            VersionLine { text: b"ABC\r\xff" }.to_string(),
            "[VER:1.1h.20190830:ABC]"
        );
        let stock = OptionsLine {
            moves: 15,
            bytes: 128,
            ..OptionsLine::default()
        };
        assert_eq!(stock.to_string(), "[OPT:V,15,128]");
        let ext = OptionsLine {
            line_numbers: true,
            mist: true,
            single_axis_homing: true,
            door: true,
            moves: 14,
            ..stock
        };
        assert_eq!(ext.to_string(), "[OPT:VNMH+,14,128]");
        let park = OptionsLine {
            parking: true,
            parking_override: true,
            door: true,
            ..stock
        };
        assert_eq!(park.to_string(), "[OPT:VPR+,15,128]");
    }

    #[test]
    fn startup_lines_show_their_number() {
        assert_eq!(
            StartupLine {
                index: 1,
                line: b"G20"
            }
            .to_string(),
            "$N1=G20"
        );
    }
}
