//! The answer to `$#`, and the result of a probing motion.

use super::{Coordinates, Units};
use core::fmt;
use leadscrew_gcode::Number;

/// The rows of `$#`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parameters<const AXES: usize> {
    /// The work offsets of G54 to G59.3, mm.
    pub systems: [Coordinates<AXES>; 9],
    /// True if the machine has G59.1 to G59.3; Grbl has not.
    pub nine: bool,
    /// The stored place of G28, machine position, mm.
    pub home: Coordinates<AXES>,
    /// The stored place of G30, machine position, mm.
    pub second_home: Coordinates<AXES>,
    /// The offset of G92, mm.
    pub temporary: Coordinates<AXES>,
    /// Tool length offset, mm.
    pub tool_length: Number,
    /// The place at which the probe touched last.
    pub probed: ProbeReport<AXES>,
    /// Unit of lengths.
    pub units: Units<AXES>,
}

impl<const AXES: usize> Parameters<AXES> {
    /// Places of the systems that Grbl has not.
    const FURTHER: core::ops::Range<usize> = 6..9;

    /// Returns the number of lines that `$#` has.
    pub const fn lines(nine: bool) -> usize {
        match nine {
            true => 14,
            false => 11,
        }
    }

    /// Returns a line of `$#`, from 0; `None` beyond the last.
    pub fn line(&self, index: usize) -> Option<ParameterLine<'_, AXES>> {
        const NAMES: [&str; 12] = [
            "G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3", "G28", "G30",
            "G92",
        ];
        let further = Self::FURTHER;
        let index = match self.nine || index < further.start {
            true => index,
            false => index + further.len(),
        };
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
    /// True if the last probing motion made contact.
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

#[cfg(test)]
mod tests {
    use super::super::samples::{number, xyz, MILLIMETRES};
    use super::*;
    use std::string::{String, ToString};
    use std::vec::Vec;

    #[test]
    fn parameters_are_eleven_lines_and_fourteen_with_nine_systems() {
        let zero = xyz("0", "0", "0");
        let probed = ProbeReport {
            position: xyz("0", "0", "-2"),
            success: true,
            units: MILLIMETRES,
        };
        let mut parameters = Parameters {
            systems: [zero; 9],
            nine: false,
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
        assert_eq!(lines.len(), Parameters::<3>::lines(false));
        let expected = [
            "[G59:5.000,6.000,0.000]",
            "[G28:1.000,0.000,0.000]",
            "[G30:0.000,0.000,0.000]",
            "[G92:-25.400,0.000,0.000]",
            "[TLO:12.700]",
            "[PRB:0.000,0.000,-2.000:1]",
        ];
        assert_eq!(lines[5..], expected);
        parameters.nine = true;
        parameters.systems[8] = xyz("7", "8", "9");
        let more: Vec<String> = (0..)
            .map_while(|index| parameters.line(index))
            .map(|line| line.to_string())
            .collect();
        assert_eq!(more.len(), Parameters::<3>::lines(true));
        assert_eq!(more[..6], lines[..6]);
        assert_eq!(more[8], "[G59.3:7.000,8.000,9.000]");
        assert_eq!(more[9..], lines[6..]);
    }
}
