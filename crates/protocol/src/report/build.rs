//! The answers to `$I` and `$N`.

use core::fmt;

/// `[VER:`, the first line of `$I`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VersionLine<'a> {
    /// The text that `$I=` stored.
    pub text: &'a [u8],
}

impl fmt::Display for VersionLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[VER:1.1h.20190830:{}]", Ascii(self.text))
    }
}

/// `[OPT:`, the second line of `$I`. Its letters come from Grbl's wiki, "Grbl v1.1 Interface".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OptionsLine {
    /// True if status reports have line numbers.
    pub line_numbers: bool,
    /// True if there is mist coolant (M7).
    pub mist: bool,
    /// Axes that share motors, as crossed belts do.
    pub crossed_belts: bool,
    /// True if the machine parks at the door.
    pub parking: bool,
    /// True if single axes may be homed: `$HX`, `$HY`, `$HZ`.
    pub single_axis_homing: bool,
    /// True if M56 controls parking.
    pub parking_override: bool,
    /// A safety door switch.
    pub door: bool,
    /// An axis with two motors, squared while homing.
    pub two_motors: bool,
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
            (self.crossed_belts, "C"),
            (self.parking, "P"),
            (self.single_axis_homing, "H"),
            (self.parking_override, "R"),
            (self.door, "+"),
            (self.two_motors, "2"),
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
    /// The number of the line, 0 or 1.
    pub index: u8,
    /// The line that is stored there.
    pub line: &'a [u8],
}

impl fmt::Display for StartupLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "$N{}={}", self.index, Ascii(self.line))
    }
}

/// Filtered text: ASCII. Other bytes, which a damaged store may yield, are left out.
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
    use std::string::ToString;

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
        let gantry = OptionsLine {
            crossed_belts: true,
            two_motors: true,
            ..ext
        };
        assert_eq!(gantry.to_string(), "[OPT:VNMCH+2,14,128]");
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
