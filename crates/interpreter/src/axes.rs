//! The kinds of axes.

/// Says whether an axis is a length, an angle or filament.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AxisKind {
    /// Millimetres; inches if G20 is in force.
    #[default]
    Linear,
    /// Degrees, never inches.
    Rotary,
    /// Filament of a printer, in millimetres. Its word is E, whatever the number of the axis. Only
    /// an axis beyond the first three may be one.
    Extruder,
    /// No axis: it has no word, no setting, and no place in reports. Only axes beyond the first
    /// three may be absent, and all axes after an absent one are absent, too. So a machine that is
    /// built for four axes can answer like a machine that is built for three.
    Absent,
}

impl AxisKind {
    /// Returns the number of axes.
    pub fn count<const AXES: usize>(axes: &[Self; AXES]) -> usize {
        if AXES <= WITHOUT_EXTRUDER {
            return AXES;
        }
        let first = axes.iter().position(|kind| *kind == Self::Absent);
        first.map_or(AXES, |absent| absent.max(WITHOUT_EXTRUDER))
    }
}

/// Axes that are always there, and never an extruder: X, Y, Z. A machine that is built for no more
/// axes has no code for E or for absent axes.
pub const WITHOUT_EXTRUDER: usize = 3;

/// Returns the axis of the extruder, if there is one.
pub fn extruder<const AXES: usize>(axes: &[AxisKind; AXES]) -> Option<usize> {
    if AXES <= WITHOUT_EXTRUDER {
        return None;
    }
    let mut further = axes.iter().enumerate().skip(WITHOUT_EXTRUDER);
    further.find_map(|(axis, kind)| (*kind == AxisKind::Extruder).then_some(axis))
}
