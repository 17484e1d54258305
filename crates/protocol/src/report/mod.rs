//! Answers to `?`, `$#`, `$G`, `$I`, `$N` and `$`: snapshots of plain values that are displayed as
//! one line each, without a line end.
//!
//! A list such as `$#` is one line at a time, so that a status report can go between two lines and
//! never inside one, and nobody has to hold a whole list. No line is longer than [`MAX_LINE`].

mod build;
pub mod fields;
mod modes;
mod parameters;
mod status;

pub use build::{OptionsLine, StartupLine, VersionLine};
pub use modes::ModesReport;
pub use parameters::{ParameterLine, Parameters, ProbeReport};
pub use status::{Accessories, OverridePercents, Pins, Room, StatusReport, Turning};

use super::decimal::Decimal;
use core::fmt;
use leadscrew_gcode::Number;
use leadscrew_interpreter::AxisKind;
use leadscrew_interpreter::MAX_WORD;

/// The longest line of a machine with up to six axes, in characters: a status report with the
/// largest values in all fields. With three axes and usual values it stays below 120.
pub const MAX_LINE: usize = 320;

/// The line after power-up and each reset. An empty line goes before it.
pub const BANNER: &str = "Grbl 1.1h ['$' for help]";

/// The answer to `$`.
pub const HELP: &str = "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]";

/// Letters of the axes, in order.
pub const AXIS_LETTERS: [char; 9] = ['X', 'Y', 'Z', 'A', 'B', 'C', 'U', 'V', 'W'];

/// Machine coordinates, or offsets, of all axes.
pub type Coordinates<const AXES: usize> = [Number; AXES];

/// The unit in which lengths and feeds are reported, `$13`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Units<const AXES: usize> {
    /// True for inches, false for millimetres.
    pub inches: bool,
    /// The kind of each axis: an axis that turns is in degrees in any case.
    pub axes: [AxisKind; AXES],
}

impl<const AXES: usize> Units<AXES> {
    /// Returns a length in the unit of reports. An offset that was limited to [`MAX_WORD`], which
    /// no motion can use, prints as Grbl prints a number that is too large.
    pub fn length(&self, value: Number) -> Decimal {
        let decimal = if self.inches {
            Decimal::inches(value)
        } else {
            Decimal::millimetres(value)
        };
        if value.nanos().unsigned_abs() < MAX_WORD.nanos().unsigned_abs() {
            decimal
        } else {
            decimal.saturated()
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
        for (value, kind) in values.iter().zip(self.axes) {
            let value = match kind {
                AxisKind::Absent => break,
                AxisKind::Rotary => Decimal::millimetres(*value),
                AxisKind::Linear | AxisKind::Extruder => self.length(*value),
            };
            write!(f, "{comma}{value}")?;
            comma = ",";
        }
        Ok(())
    }
}

#[cfg(test)]
mod samples {
    //! Values for the tests of the reports.

    use super::*;

    pub(super) const MILLIMETRES: Units<3> = Units {
        inches: false,
        axes: [AxisKind::Linear; 3],
    };
    pub(super) const INCHES: Units<3> = Units {
        inches: true,
        axes: [AxisKind::Linear; 3],
    };

    pub(super) fn number(text: &str) -> Number {
        leadscrew_gcode::leading_number(text.as_bytes()).unwrap().0
    }

    pub(super) fn xyz(x: &str, y: &str, z: &str) -> Coordinates<3> {
        [x, y, z].map(number)
    }
}
