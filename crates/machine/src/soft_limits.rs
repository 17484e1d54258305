//! Soft limits: no target outside the travel of a homed machine (`$20`, `$130` and up).

use leadscrew_planner::Coordinate;

/// Whether a target lies within the travel: from `−travel` to 0 on each axis, ends included, exactly.
///
/// An axis without travel is never within, as in Grbl, unless it stays at 0.
pub fn allow<const AXES: usize>(target: &[Coordinate; AXES], travel: &[Coordinate; AXES]) -> bool {
    target
        .iter()
        .zip(travel)
        .all(|(at, travel)| *at <= Coordinate::ZERO && *at >= Coordinate::ZERO - *travel)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_the_travel_are_allowed_and_nothing_beyond() {
        let mm = |mm: f32| Coordinate::from_mm(mm);
        let travel = [mm(20.0), mm(10.0)];
        assert!(allow(&[mm(0.0), mm(-10.0)], &travel));
        assert!(allow(&[mm(-20.0), mm(0.0)], &travel));
        let beyond = Coordinate::from_nanos(1);
        assert!(!allow(&[beyond, mm(0.0)], &travel));
        assert!(!allow(&[mm(0.0), mm(-10.0) - beyond], &travel));
    }
}
