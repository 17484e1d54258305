//! Where an axis is once it has been homed, and where its travel ends.

use crate::settings::table::{AxisSetting, Setting};
use crate::settings::values::{Key, Settings};
use leadscrew_gcode::Number;
use leadscrew_planner::Coordinate;

/// Machine position of a homed axis: `pull_off` away from the switch at the end of its `travel`,
/// whose upper end is `top`. The switch is there, or at the lower end if the axis homes in the
/// `negative` direction.
pub fn place(
    top: Coordinate,
    travel: Coordinate,
    pull_off: Coordinate,
    negative: bool,
) -> Coordinate {
    match negative {
        true => top - travel + pull_off,
        false => top - pull_off,
    }
}

/// The upper end of each axis's travel, machine position: 0 as in Grbl, or where `$719` and `$740`
/// have the switch.
pub fn tops<const AXES: usize>(
    settings: &Settings<AXES>,
    travel: &[Coordinate; AXES],
) -> [Coordinate; AXES] {
    let mut tops = [Coordinate::ZERO; AXES];
    let (own, negative) = (
        settings.mask(Setting::OwnHomes),
        settings.mask(Setting::HomingDirection),
    );
    for (axis, (top, travel)) in tops.iter_mut().zip(travel).enumerate() {
        if own >> axis & 1 == 1 {
            *top = coordinate(settings.get(Key::Axis(AxisSetting::HomePlace, axis)));
            if negative >> axis & 1 == 1 {
                *top = *top + *travel;
            }
        }
    }
    tops
}

/// A setting of one axis's homing; `common` where the axis has none of its own.
pub fn of_axis<const AXES: usize>(
    settings: &Settings<AXES>,
    own: AxisSetting,
    common: Setting,
    axis: usize,
) -> Number {
    let own = settings.get(Key::Axis(own, axis));
    match own == Number::from_int(0) {
        true => settings.value(common),
        false => own,
    }
}

/// How far an axis goes off its switch: `$750` and up, or `$27`.
pub fn pull_off<const AXES: usize>(settings: &Settings<AXES>, axis: usize) -> Coordinate {
    let own = of_axis(settings, AxisSetting::PullOff, Setting::HomingPullOff, axis);
    coordinate(own)
}

fn coordinate(value: Number) -> Coordinate {
    Coordinate::from_nanos(value.nanos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_homed_axis_is_a_pull_off_inside_its_travel() {
        let mm = |mm| Coordinate::from_mm(mm).unwrap();
        let zero = Coordinate::ZERO;
        assert_eq!(place(zero, mm(200.0), mm(1.5), false), mm(-1.5));
        assert_eq!(place(zero, mm(200.0), mm(1.5), true), mm(-198.5));
        assert_eq!(place(mm(200.0), mm(200.0), mm(1.5), true), mm(1.5));
    }
}
