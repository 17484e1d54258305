//! Soft limits: no target outside the travel of a homed machine (`$20`, `$130` and up).

use crate::config::{extruder, AxisKind};
use leadscrew_planner::Coordinate;

/// Whether a target lies within the travel: from `top − travel` to `top` on each axis, ends
/// included, exactly. `top` is 0 as in Grbl, or [`crate::home::tops`].
///
/// An axis without travel is never within, as in Grbl, unless it stays at 0. An extruder always is:
/// filament has no end.
pub fn allow<const AXES: usize>(
    target: &[Coordinate; AXES],
    top: &[Coordinate; AXES],
    travel: &[Coordinate; AXES],
    axes: &[AxisKind; AXES],
) -> bool {
    let extruder = extruder(axes);
    let mut targets = target.iter().zip(top.iter().zip(travel)).enumerate();
    targets.all(|(axis, (at, (top, travel)))| {
        extruder == Some(axis) || at <= top && *at >= *top - *travel
    })
}

/// Ends a jog from `from` at the travel: each axis goes no farther than there, and none goes back.
pub fn clip<const AXES: usize>(
    target: &mut [Coordinate; AXES],
    from: &[Coordinate; AXES],
    top: &[Coordinate; AXES],
    travel: &[Coordinate; AXES],
    axes: &[AxisKind; AXES],
) {
    let extruder = extruder(axes);
    let ends = from.iter().zip(top.iter().zip(travel));
    for (axis, (target, (from, (top, travel)))) in target.iter_mut().zip(ends).enumerate() {
        if extruder != Some(axis) {
            let (up, down) = (*top.max(from), (*top - *travel).min(*from));
            *target = (*target).clamp(down, up);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_the_travel_are_allowed_and_nothing_beyond() {
        let mm = |mm: f32| Coordinate::from_mm(mm).unwrap();
        let travel = [mm(20.0), mm(10.0)];
        let top = [Coordinate::ZERO; 2];
        let axes = [AxisKind::Linear; 2];
        let within = |target: [Coordinate; 2]| allow(&target, &top, &travel, &axes);
        assert!(within([mm(0.0), mm(-10.0)]));
        assert!(within([mm(-20.0), mm(0.0)]));
        let beyond = Coordinate::from_nanos(1);
        assert!(!within([beyond, mm(0.0)]));
        assert!(!within([mm(0.0), mm(-10.0) - beyond]));
        let raised = [mm(20.0), mm(15.0)];
        let within = |target: [Coordinate; 2]| allow(&target, &raised, &travel, &axes);
        assert!(within([mm(0.0), mm(15.0)]) && within([mm(20.0), mm(5.0)]));
        assert!(!within([mm(0.0), mm(4.0)]) && !within([mm(-1.0), mm(15.0)]));
    }

    #[test]
    fn a_jog_is_clipped_axis_by_axis_and_never_turned_round() {
        let mm = |mm: f32| Coordinate::from_mm(mm).unwrap();
        let (top, travel) = ([mm(0.0); 2], [mm(20.0); 2]);
        for (from, target, clipped) in [
            ([-5.0, -5.0], [-50.0, -7.0], [-20.0, -7.0]),
            ([-5.0, -5.0], [3.0, 9.0], [0.0, 0.0]),
            ([4.0, -30.0], [8.0, -40.0], [4.0, -30.0]),
            ([4.0, -30.0], [-40.0, 40.0], [-20.0, 0.0]),
        ] {
            let mut target = target.map(mm);
            clip(
                &mut target,
                &from.map(mm),
                &top,
                &travel,
                &[AxisKind::Linear; 2],
            );
            assert_eq!(target, clipped.map(mm));
        }
    }

    #[test]
    fn filament_has_no_end() {
        let travel = [Coordinate::from_mm(20.0).unwrap(); 4];
        let mut axes = [AxisKind::Linear; 4];
        let target = [0.0, -20.0, 0.0, 5000.0].map(|mm| Coordinate::from_mm(mm).unwrap());
        let top = [Coordinate::ZERO; 4];
        assert!(!allow(&target, &top, &travel, &axes));
        axes[3] = AxisKind::Extruder;
        assert!(allow(&target, &top, &travel, &axes));
    }
}
