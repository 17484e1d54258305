//! Soft limits: no target outside the travel of a homed machine (`$20`, `$130` and up).

use crate::config::{extruder, AxisKind};
use leadscrew_planner::Coordinate;

/// Whether a target lies within the travel: from `−travel` to 0 on each axis, ends included,
/// exactly.
///
/// An axis without travel is never within, as in Grbl, unless it stays at 0. An extruder always is:
/// filament has no end.
pub fn allow<const AXES: usize>(
    target: &[Coordinate; AXES],
    travel: &[Coordinate; AXES],
    axes: &[AxisKind; AXES],
) -> bool {
    let extruder = extruder(axes);
    let mut targets = target.iter().zip(travel).enumerate();
    targets.all(|(axis, (at, travel))| {
        extruder == Some(axis) || *at <= Coordinate::ZERO && *at >= Coordinate::ZERO - *travel
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_the_travel_are_allowed_and_nothing_beyond() {
        let mm = |mm: f32| Coordinate::from_mm(mm).unwrap();
        let travel = [mm(20.0), mm(10.0)];
        let within = |target: [Coordinate; 2]| allow(&target, &travel, &[AxisKind::Linear; 2]);
        assert!(within([mm(0.0), mm(-10.0)]));
        assert!(within([mm(-20.0), mm(0.0)]));
        let beyond = Coordinate::from_nanos(1);
        assert!(!within([beyond, mm(0.0)]));
        assert!(!within([mm(0.0), mm(-10.0) - beyond]));
    }

    #[test]
    fn filament_has_no_end() {
        let travel = [Coordinate::from_mm(20.0).unwrap(); 4];
        let mut axes = [AxisKind::Linear; 4];
        let target = [0.0, -20.0, 0.0, 5000.0].map(|mm| Coordinate::from_mm(mm).unwrap());
        assert!(!allow(&target, &travel, &axes));
        axes[3] = AxisKind::Extruder;
        assert!(allow(&target, &travel, &axes));
    }
}
