//! Where an axis is once it has been homed.

use leadscrew_planner::Coordinate;

/// Machine position of a homed axis: `pull_off` away from the switch at the end of its `travel`.
/// The switch is at 0, or at `−travel` if the axis homes in the `negative` direction.
pub fn place(travel: Coordinate, pull_off: Coordinate, negative: bool) -> Coordinate {
    match negative {
        true => pull_off - travel,
        false => Coordinate::ZERO - pull_off,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_homed_axis_is_a_pull_off_inside_its_travel() {
        let mm = |mm| Coordinate::from_mm(mm).unwrap();
        assert_eq!(place(mm(200.0), mm(1.5), false), mm(-1.5));
        assert_eq!(place(mm(200.0), mm(1.5), true), mm(-198.5));
    }
}
