//! The decimals of a program's coordinates: how far their rounding may have moved a point.
//!
//! Programs write a fixed number of decimals, and many leave zeros at the end out: `1.5` may stand
//! for `1.500`. So the last lines together tell. The planner takes small turns that rounding makes
//! for a smooth curve.

use super::modal_state::Units;
use leadscrew_gcode::Number;
use leadscrew_planner::THREE_DECIMALS;

/// Half of the last decimal, mm: of 0.01 mm, 0.0001 inches and 0.001 inches. Of 0.001 mm it is
/// [`THREE_DECIMALS`], which stands for finer ones as well.
const TWO_DECIMALS: f32 = 0.005;
const FOUR_OF_AN_INCH: f32 = 0.00127;
const THREE_OF_AN_INCH: f32 = 0.0127;

/// The decimals of the last sixteen lines with coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Decimals {
    /// One bit a line, set if a coordinate has more than two decimals (in inches: three).
    fine: u16,
}

impl Decimals {
    /// Before the first line: as if the program had three decimals.
    pub(super) const UNKNOWN: Self = Self { fine: u16::MAX };

    /// Notes the coordinates of a line, in units of the program.
    ///
    /// A multiple of 10⁷ nanos, which is 0.01, is one of 2⁷. Of the numbers with three decimals the
    /// even ones are, too: sixteen lines of two such coordinates come once in 2³² lines.
    pub(super) fn note(&mut self, coordinates: &[Number], units: Units) {
        let twos = match units {
            Units::Millimetres => 1 << 7,
            Units::Inches => 1 << 6,
        };
        let bits = coordinates.iter().fold(0, |bits, one| bits | one.nanos());
        self.fine = self.fine << 1 | u16::from(bits % twos != 0);
    }

    /// Returns how far rounding may have moved a point on each axis, mm.
    pub(super) fn rounding(self, units: Units) -> f32 {
        match (units, self.fine == 0) {
            (Units::Millimetres, false) => THREE_DECIMALS,
            (Units::Millimetres, true) => TWO_DECIMALS,
            (Units::Inches, false) => FOUR_OF_AN_INCH,
            (Units::Inches, true) => THREE_OF_AN_INCH,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line of one coordinate.
    fn noted(text: &[&str], units: Units) -> f32 {
        let mut decimals = Decimals::UNKNOWN;
        for text in text {
            let (number, _) = leadscrew_gcode::leading_number(text.as_bytes()).unwrap();
            decimals.note(&[number], units);
        }
        decimals.rounding(units)
    }

    #[test]
    fn sixteen_lines_with_two_decimals_make_a_program_of_two_decimals() {
        let mm = Units::Millimetres;
        assert_eq!(noted(&["1.25"; 15], mm), 0.0005);
        assert_eq!(noted(&["-1.25"; 16], mm), 0.005);
        assert_eq!(noted(&["12345"; 16], mm), 0.005);
        let mut lines = ["1.25"; 40];
        assert_eq!(noted(&lines, mm), 0.005);
        lines[30] = "0.001";
        assert_eq!(noted(&lines, mm), 0.0005);
    }

    #[test]
    fn inches_have_a_decimal_more() {
        let inches = Units::Inches;
        assert_eq!(noted(&["0.0001"; 16], inches), 0.00127);
        assert_eq!(noted(&["0.001"; 16], inches), 0.0127);
    }

    #[test]
    fn a_single_odd_thousandth_tells_three_decimals() {
        let mm = Units::Millimetres;
        assert_eq!(noted(&["0.002"; 16], mm), 0.005);
        let mut lines = ["-0.002"; 16];
        lines[0] = "-7.003";
        assert_eq!(noted(&lines, mm), 0.0005);
    }
}
