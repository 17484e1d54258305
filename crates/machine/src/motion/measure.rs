//! The length of which F is the speed, if not all axes are lengths: NIST RS274/NGC 2.1.2.5, and an
//! extruder.
//!
//! ```text
//!   G1 X30 Y40 E10 F3000     50 mm at 3000 mm/min: one second. The path of all four axes has
//!                            51 mm, and is planned at 3059 mm/min.
//!   G1 X10 A36 F600          10 mm at 600 mm/min: one second, and A turns meanwhile
//!   G1 A36 F600              no length: A turns at 600 degrees/min, in G20 too
//!   G1 E-2 F1800             no other axis moves: E moves at the feed
//! ```

use crate::config::AxisKind;

/// The measure of a motion: what its F counts.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Measure {
    /// The length of the path of all axes, divided by the length that F counts; at least 1.
    pub(crate) stretch: f32,
    /// True if F counts degrees.
    pub(crate) is_turn: bool,
}

impl Measure {
    /// F counts the whole path, in mm.
    const PATH: Self = Self {
        stretch: 1.0,
        is_turn: false,
    };

    /// The measure of a motion in which each axis goes this way, mm or degrees.
    pub(crate) fn of<const AXES: usize>(kinds: &[AxisKind; AXES], ways: &[f32; AXES]) -> Self {
        let (mut length, mut turn, mut filament) = (0.0, 0.0, 0.0);
        for (kind, way) in kinds.iter().zip(ways) {
            match kind {
                AxisKind::Linear | AxisKind::Absent => length += way * way,
                AxisKind::Rotary => turn += way * way,
                AxisKind::Extruder => filament += way * way,
            }
        }
        let is_turn = length == 0.0 && turn > 0.0;
        let (counted, rest) = match is_turn {
            true => (turn, filament),
            false => (length, turn + filament),
        };
        match counted > 0.0 {
            true => Self {
                stretch: libm::sqrtf(1.0 + rest / counted),
                is_turn,
            },
            false => Self::PATH,
        }
    }
}

/// Returns true if all axes are lengths of the path: then F counts the whole path.
pub(crate) fn is_plain<const AXES: usize>(kinds: &[AxisKind; AXES]) -> bool {
    let mixed = |kind: &AxisKind| matches!(kind, AxisKind::Rotary | AxisKind::Extruder);
    !kinds.iter().any(mixed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use AxisKind::{Extruder, Linear, Rotary};

    /// The stretch of a motion of X, Y, A, B and E, and whether it is a turn.
    fn measured(ways: [f32; 5]) -> (f32, bool) {
        let kinds = [Linear, Linear, Rotary, Rotary, Extruder];
        let Measure { stretch, is_turn } = Measure::of(&kinds, &ways);
        ((stretch * 1e3).round() / 1e3, is_turn)
    }

    #[test]
    fn lengths_come_before_turns_and_turns_before_filament() {
        assert_eq!(measured([3.0, 4.0, 0.0, 0.0, 0.0]), (1.0, false));
        assert_eq!(measured([3.0, 4.0, 12.0, 0.0, 0.0]), (2.6, false));
        assert_eq!(measured([3.0, 4.0, 0.0, 0.0, -12.0]), (2.6, false));
        assert_eq!(measured([0.0, 0.0, 36.0, 0.0, 0.0]), (1.0, true));
        assert_eq!(measured([0.0, 0.0, -3.0, 4.0, 12.0]), (2.6, true));
        assert_eq!(measured([0.0, 0.0, 0.0, 0.0, 5.0]), (1.0, false));
        assert_eq!(measured([0.0; 5]), (1.0, false));
    }
}
