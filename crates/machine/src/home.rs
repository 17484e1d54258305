//! The place of an axis once it has been homed, and the ends of its travel.

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
    /// No travel.
    pub const NONE: Self = Self {
        low: Coordinate::ZERO,
        high: Coordinate::ZERO,
    };

    /// Returns how far the axis goes.
    pub fn travel(self) -> Coordinate {
        self.high - self.low
    }

    /// Returns the machine position of a homed axis: `pull_off` away from its switch, which is at
    /// the low end if the axis homes in the `negative` direction.
    pub fn place(self, pull_off: Coordinate, negative: bool) -> Coordinate {
        match negative {
            true => self.low + pull_off,
            false => self.high - pull_off,
        }
    }
}

/// Returns the ends of each axis's travel, `$130` and up: it ends at 0 as in Grbl, or has its switch
/// at the place that `$719` and `$740` say. It is no longer than `reach`, and no end is beyond
/// `reach`: places whose steps cannot be counted are outside the travel, too.
pub fn bounds<const AXES: usize>(
    settings: &Settings<AXES>,
    reach: &[Coordinate; AXES],
) -> [Bounds; AXES] {
    let mut axes = 0..;
    reach.map(|reach| axis_bounds(settings, axes.next().unwrap_or(0), reach))
}

#[inline(never)] // inlined, it is there once for each axis
fn axis_bounds<const AXES: usize>(
    settings: &Settings<AXES>,
    axis: usize,
    reach: Coordinate,
) -> Bounds {
    let of = |setting| coordinate(settings.get(Key::Axis(setting, axis)));
    let has = |mask| settings.mask(mask) >> axis & 1 == 1;
    let travel = of(AxisSetting::Travel).min(reach);
    let mut high = Coordinate::ZERO;
    if has(Setting::OwnHomes) {
        high = of(AxisSetting::HomePlace);
        if has(Setting::HomingDirection) {
            high = high + travel;
        }
        high = high.max(travel - reach).min(reach);
    }
    let low = high - travel;
    Bounds { low, high }
}

/// Returns a setting of one axis's homing; `common` if the axis has none of its own.
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

/// Returns how far an axis goes off its switch: `$750` and up, or `$27`.
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
            let number = *number;
            assert!(all.load(Entry { number, value }));
        }
        bounds(&all, &[mm(300.0)])[0]
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
