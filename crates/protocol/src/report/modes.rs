//! The answer to `$G`.

use super::Units;
use crate::decimal::Decimal;
use core::fmt;
use leadscrew_gcode::Number;

/// The answer to `$G`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModesReport {
    /// Motion mode, as in `G38.2`: 0, 1, 2, 3, 38.2 to 38.5, 73, 80 to 83, 85, 86, 89.
    pub motion: Number,
    /// The work coordinate system in force, 54 to 59.
    pub coordinate_system: u8,
    /// The plane of arcs, 17 to 19.
    pub plane: u8,
    /// The unit of lengths, 20 or 21.
    pub units: u8,
    /// The distance mode, 90 or 91.
    pub distance: u8,
    /// The feed mode, 93 or 94.
    pub feed_mode: u8,
    /// G99 is in force. Grbl has neither G98 nor G99: G98, the usual one, is not shown.
    pub back_to_r: bool,
    /// 3, 4 or 5.
    pub spindle: u8,
    /// M7 is in force.
    pub mist: bool,
    /// M8 is in force.
    pub flood: bool,
    /// M56 is in force: parking is allowed, on machines with parking override control.
    pub parking: bool,
    /// 82 or 83, on a machine with an extruder.
    pub extrusion: Option<u8>,
    /// Tool of the last line.
    pub tool: u32,
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
        write!(
            f,
            "[GC:G{motion} G{coordinate_system} G{plane} G{units} G{distance} G{feed_mode}"
        )?;
        if self.back_to_r {
            f.write_str(" G99")?;
        }
        write!(f, " M{spindle}")?;
        f.write_str(match (self.mist, self.flood) {
            (false, false) => " M9",
            (true, false) => " M7",
            (false, true) => " M8",
            (true, true) => " M7 M8",
        })?;
        if self.parking {
            f.write_str(" M56")?;
        }
        if let Some(extrusion) = self.extrusion {
            write!(f, " M{extrusion}")?;
        }
        let units = Units {
            inches: self.inches,
            axes: [],
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

#[cfg(test)]
mod tests {
    use super::super::samples::number;
    use super::*;
    use std::string::ToString;

    fn modes() -> ModesReport {
        ModesReport {
            motion: number("0"),
            coordinate_system: 54,
            plane: 17,
            units: 21,
            distance: 90,
            feed_mode: 94,
            back_to_r: false,
            extrusion: None,
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
            back_to_r: true,
            extrusion: Some(83),
            spindle: 3,
            parking: true,
            tool: 255,
            feed: number("2.5"),
            speed: number("12345.6"),
            ..modes()
        };
        assert_eq!(
            other.to_string(),
            "[GC:G38.2 G59 G17 G21 G90 G94 G99 M3 M9 M56 M83 T255 F3 S12346]"
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
}
