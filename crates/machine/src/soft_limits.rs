//! Soft limits: no target outside the travel of a homed machine (`$20`, `$130` and up).

use crate::config::{extruder, AxisKind};
use crate::home::Bounds;
use leadscrew_planner::Coordinate;

/// Returns true if a target lies within the travel: between the ends of each axis, ends included,
/// exactly.
///
/// An axis without travel is never within, as in Grbl, unless it stays at its end. An extruder
/// always is: filament has no end.
pub fn allow<const AXES: usize>(
    target: &[Coordinate; AXES],
    ends: &[Bounds; AXES],
    axes: &[AxisKind; AXES],
) -> bool {
    let extruder = extruder(axes);
    let mut targets = target.iter().zip(ends).enumerate();
    targets.all(|(axis, (at, ends))| extruder == Some(axis) || (ends.low..=ends.high).contains(at))
}

/// Ends a jog from `from` at the travel: each axis goes no farther than there, and none goes back.
pub fn clip<const AXES: usize>(
    target: &mut [Coordinate; AXES],
    from: &[Coordinate; AXES],
    ends: &[Bounds; AXES],
    axes: &[AxisKind; AXES],
) {
    let extruder = extruder(axes);
    let ways = target.iter_mut().zip(from.iter().zip(ends)).enumerate();
    for (axis, (target, (from, ends))) in ways {
        if extruder != Some(axis) {
            *target = (*target).max(ends.low.min(*from)).min(ends.high.max(*from));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mm(mm: f32) -> Coordinate {
        Coordinate::from_mm(mm).unwrap()
    }

    fn ends(low: f32, high: f32) -> Bounds {
        let (low, high) = (mm(low), mm(high));
        Bounds { low, high }
    }

    #[test]
    fn the_ends_of_the_travel_are_allowed_and_nothing_beyond() {
        let axes = [AxisKind::Linear; 2];
        let travel = [ends(-20.0, 0.0), ends(5.0, 15.0)];
        let within = |target: [Coordinate; 2]| allow(&target, &travel, &axes);
        let beyond = Coordinate::from_nanos(1);
        assert!(within([mm(0.0), mm(5.0)]));
        assert!(within([mm(-20.0), mm(15.0)]));
        assert!(!within([beyond, mm(5.0)]));
        assert!(!within([mm(-20.0) - beyond, mm(5.0)]));
        assert!(!within([mm(0.0), mm(5.0) - beyond]));
        assert!(!within([mm(0.0), mm(15.0) + beyond]));
    }

    #[test]
    fn a_jog_is_clipped_axis_by_axis_and_never_turned_round() {
        for (from, target, clipped) in [
            ([-5.0, -5.0], [-50.0, -7.0], [-20.0, -7.0]),
            ([-5.0, -5.0], [3.0, 9.0], [0.0, 0.0]),
            ([4.0, -30.0], [8.0, -40.0], [4.0, -30.0]),
            ([4.0, -30.0], [-40.0, 40.0], [-20.0, 0.0]),
        ] {
            let mut target = target.map(mm);
            let travel = [ends(-20.0, 0.0); 2];
            clip(&mut target, &from.map(mm), &travel, &[AxisKind::Linear; 2]);
            assert_eq!(target, clipped.map(mm));
        }
    }

    #[test]
    fn filament_has_no_end() {
        let travel = [ends(-20.0, 0.0); 4];
        let mut axes = [AxisKind::Linear; 4];
        let target = [0.0, -20.0, 0.0, 5000.0].map(mm);
        assert!(!allow(&target, &travel, &axes));
        axes[3] = AxisKind::Extruder;
        assert!(allow(&target, &travel, &axes));
        let mut clipped = target;
        clip(&mut clipped, &[mm(0.0); 4], &travel, &axes);
        assert_eq!(clipped, target);
    }
}
