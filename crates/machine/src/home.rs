//! Where an axis is once it has been homed, and where its travel ends.

use crate::settings::table::{AxisSetting, Setting};
use crate::settings::values::{Key, Settings};
use leadscrew_gcode::Number;
use leadscrew_planner::Coordinate;

/// The ends of an axis's travel, machine position.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Bounds {
    /// The end towards minus.
    pub low: Coordinate,
    /// The end towards plus.
    pub high: Coordinate,
}

impl Bounds {
    /// Returns the machine position of a homed axis: `pull_off` away from its switch, which is at
    /// the low end if the axis homes in the `negative` direction.
    pub fn place(self, pull_off: Coordinate, negative: bool) -> Coordinate {
        match negative {
            true => self.low + pull_off,
            false => self.high - pull_off,
        }
    }
}

/// Returns the ends of each axis's travel: from minus `travel` to 0 as in Grbl, or so that the
/// switch is at the place that `$719` and `$740` say. No end is beyond `reach`, and no `travel` may
/// be longer than it.
pub fn bounds<const AXES: usize>(
    settings: &Settings<AXES>,
    travel: &[Coordinate; AXES],
    reach: &[Coordinate; AXES],
) -> [Bounds; AXES] {
    let zero = Coordinate::ZERO;
    let mut bounds = [Bounds {
        low: zero,
        high: zero,
    }; AXES];
    let axes = bounds.iter_mut().zip(travel.iter().zip(reach)).enumerate();
    for (axis, (bounds, (travel, reach))) in axes {
        let high = top(settings, axis, *travel).max(*travel - *reach);
        bounds.high = high.min(*reach);
        bounds.low = bounds.high - *travel;
    }
    bounds
}

/// The upper end of an axis's travel.
#[inline(never)] // inlined, an image with a record takes 300 bytes more
fn top<const AXES: usize>(
    settings: &Settings<AXES>,
    axis: usize,
    travel: Coordinate,
) -> Coordinate {
    let has = |mask| settings.mask(mask) >> axis & 1 == 1;
    if !has(Setting::OwnHomes) {
        return Coordinate::ZERO;
    }
    let place = coordinate(settings.get(Key::Axis(AxisSetting::HomePlace, axis)));
    match has(Setting::HomingDirection) {
        true => place + travel,
        false => place,
    }
}

/// A setting of one axis's homing; `common` if the axis has none of its own.
#[inline(never)]
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
    use crate::settings::values::Entry;

    fn mm(mm: f32) -> Coordinate {
        Coordinate::from_mm(mm).unwrap()
    }

    /// The ends of the travel of an axis of 200 mm with these settings.
    fn ends_of(settings: &[(u16, i32)]) -> Bounds {
        let mut all = Settings::<1>::new(&[]);
        for (number, value) in settings {
            let value = Number::from_int(*value);
            assert!(all.load(Entry {
                number: *number,
                value
            }));
        }
        bounds(&all, &[mm(200.0)], &[mm(300.0)])[0]
    }

    #[test]
    fn a_homed_axis_is_a_pull_off_inside_its_travel() {
        let stock = ends_of(&[(740, 50)]);
        assert_eq!([stock.low, stock.high], [mm(-200.0), mm(0.0)]);
        assert_eq!(stock.place(mm(1.5), false), mm(-1.5));
        assert_eq!(stock.place(mm(1.5), true), mm(-198.5));
    }

    #[test]
    fn the_travel_begins_at_the_place_of_the_switch_and_ends_within_reach() {
        for (settings, low) in [
            (&[(719, 1), (740, 50)], -150.0),
            (&[(719, 1), (740, -120)], -300.0),
            (&[(719, 1), (740, 1_000_000)], 100.0),
        ] {
            let ends = ends_of(settings);
            assert_eq!([ends.low, ends.high], [mm(low), mm(low + 200.0)]);
        }
        for (place, low) in [(0, 0.0), (-50, -50.0), (150, 100.0), (-400, -300.0)] {
            let ends = ends_of(&[(23, 1), (719, 1), (740, place)]);
            assert_eq!([ends.low, ends.high], [mm(low), mm(low + 200.0)]);
        }
    }
}
