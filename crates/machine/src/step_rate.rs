//! Settings that ask for more than the board makes, and the values that would work: steps in a
//! second, and how soon after each other they become faster.
//!
//! Settings are accepted one by one, since senders restore them so. A value is refused only if
//! no values of the other settings could make it work ([`StepTiming::limits`]). Motion is capped at
//! the rate and the acceleration that all settings together allow. A jerk needs no cap: the higher
//! it is, the more a ramp is as without one.

use crate::protocol::message::Capped;
use crate::settings::table::{AxisSetting, Setting};
use crate::settings::values::{Key, Settings};
use crate::step_timing::StepTiming;
use leadscrew_gcode::Number;

/// Returns the largest rate of an axis (`$110` and up) that its steps/mm and `$0` allow, rounded
/// down to 0.01 mm/min.
pub fn largest_rate<const AXES: usize>(
    settings: &Settings<AXES>,
    timing: &StepTiming,
    motors: usize,
    axis: usize,
) -> Capped {
    let pulse_us = u8::try_from(settings.whole(Setting::StepPulse)).unwrap_or(u8::MAX);
    let steps = settings.get(Key::Axis(AxisSetting::StepsPerMm, axis));
    let rate = i64::from(timing.highest_rate(pulse_us, motors));
    // From steps/s and 10⁻⁹ steps/mm to 0.01 mm/min:
    //
    //     60 · 100 · 10⁹ · rate / steps
    //
    // The product is at most 60 · 10¹¹ · 5·10⁵ < 2⁶³.
    let hundredths = rate * 60 * 100 * ONE / steps.nanos().max(1);
    Capped {
        number: Key::Axis(AxisSetting::MaxRate, axis).number(),
        most: Number::from_nanos(hundredths.saturating_mul(ONE / 100)),
    }
}

/// The highest acceleration of a motor, steps/s²: from rest its first step takes 63 µs, and the main
/// loop has that time to hand over the next segment. With 1.6 · 10⁹ the motor outran the main loop
/// (ALARM:3).
const STEPS_PER_S2: i64 = 500_000_000;

/// Returns the largest acceleration of an axis (`$120` and up) that its steps/mm allow, rounded down
/// to 0.1 mm/s².
pub fn largest_acceleration<const AXES: usize>(settings: &Settings<AXES>, axis: usize) -> Capped {
    let steps = settings.get(Key::Axis(AxisSetting::StepsPerMm, axis));
    // From steps/s² and 10⁻⁹ steps/mm to 0.1 mm/s²; the product is 5·10¹⁸ < 2⁶³.
    let tenths = STEPS_PER_S2 * 10 * ONE / steps.nanos().max(1);
    Capped {
        number: Key::Axis(AxisSetting::Acceleration, axis).number(),
        most: Number::from_nanos(tenths.saturating_mul(ONE / 10)),
    }
}

/// Returns the caps on the rate and on the acceleration of an axis, as far as they are capped.
pub fn capped<const AXES: usize>(
    settings: &Settings<AXES>,
    timing: &StepTiming,
    motors: usize,
    axis: usize,
) -> impl Iterator<Item = Capped> {
    let over = |of, largest: Capped| {
        let asked = settings.get(Key::Axis(of, axis));
        (asked > largest.most).then_some(largest)
    };
    let rate = largest_rate(settings, timing, motors, axis);
    let acceleration = largest_acceleration(settings, axis);
    [
        over(AxisSetting::MaxRate, rate),
        over(AxisSetting::Acceleration, acceleration),
    ]
    .into_iter()
    .flatten()
}

/// Returns the largest value that would work in place of a value of `key` that was refused for its
/// step rate.
pub fn instead<const AXES: usize>(
    settings: &Settings<AXES>,
    timing: &StepTiming,
    motors: usize,
    key: Key,
) -> Option<Capped> {
    match key {
        Key::Axis(AxisSetting::MaxRate, axis) => Some(largest_rate(settings, timing, motors, axis)),
        // With this scale the axis still makes 1 mm/s.
        Key::Axis(AxisSetting::StepsPerMm, _) => Some(Capped {
            number: key.number(),
            most: Number::from_nanos(i64::from(timing.limits(motors).highest_rate) * ONE),
        }),
        Key::Machine(_) | Key::Axis(_, _) => None,
    }
}

/// Returns the caps after a change of `key`: on what depends on it, for its axis, or for each axis
/// if `key` is the step pulse.
pub fn capped_by<'a, const AXES: usize>(
    settings: &'a Settings<AXES>,
    timing: &'a StepTiming,
    motors: usize,
    key: Key,
) -> impl Iterator<Item = Capped> + 'a {
    let axes = match key {
        Key::Machine(Setting::StepPulse) => 0..settings.axis_count(),
        Key::Axis(AxisSetting::Travel, _) | Key::Machine(_) => 0..0,
        Key::Axis(_, axis) => axis..axis + 1,
    };
    let depends = move |capped: &Capped| match key {
        Key::Axis(AxisSetting::StepsPerMm, _) => true,
        Key::Axis(AxisSetting::Acceleration, _) => capped.is_acceleration(),
        Key::Axis(_, _) | Key::Machine(_) => !capped.is_acceleration(),
    };
    axes.flat_map(move |axis| capped(settings, timing, motors, axis))
        .filter(depends)
}

/// One, in 10⁻⁹.
const ONE: i64 = 1_000_000_000;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::values::Entry;
    use std::vec::Vec;

    const F407: StepTiming = StepTiming::F407;

    fn with(values: &[(u16, i32)]) -> Settings<3> {
        let mut settings = Settings::default();
        for (number, value) in values {
            let entry = Entry {
                number: *number,
                value: Number::from_int(*value),
            };
            settings.set(entry, F407.limits(3)).unwrap();
        }
        settings
    }

    #[test]
    fn no_pulse_is_refused_for_the_rate_that_it_leaves() {
        for us in 1..=255 {
            let settings = with(&[(0, us)]);
            let left = largest_rate(&settings, &F407, 3, 0).most;
            // 3906 steps/s · 60 / 250 steps/mm, in mm/min.
            assert!(left >= Number::from_nanos(937_440_000_000), "{us} us");
        }
    }

    #[test]
    fn a_rate_is_capped_by_the_pulse_that_goes_with_it() {
        let settings = with(&[(0, 10), (110, 30_000), (111, 21_000)]);
        let of = |axis| capped(&settings, &F407, 3, axis).next();
        // 90 909 steps/s · 60 / 250 steps/mm, in mm/min, rounded down.
        let most = Number::from_nanos(21_818_160_000_000);
        assert_eq!(
            [of(0), of(1), of(2)],
            [Some(Capped { number: 110, most }), None, None]
        );
        let short = with(&[(0, 1), (110, 60_000)]);
        assert_eq!(capped(&short, &F407, 3, 0).next(), None);
    }

    #[test]
    fn an_acceleration_is_capped_by_the_steps_that_go_with_it() {
        for (steps, most) in [
            (1_600, 312_500_000_000_000),
            (80, 6_250_000_000_000_000),
            (1_001, 499_500_400_000_000),
        ] {
            let settings = with(&[(100, steps), (120, 7_000_000)]);
            let number = 120;
            let most = Number::from_nanos(most);
            let found: Vec<_> = capped(&settings, &F407, 3, 0).collect();
            assert_eq!(found, [Capped { number, most }], "{steps} steps/mm");
        }
        assert_eq!(
            capped(&with(&[(100, 1_600), (120, 312_500)]), &F407, 3, 0).next(),
            None
        );
    }

    #[test]
    fn a_change_tells_what_depends_on_it_and_nothing_else() {
        let settings = with(&[(0, 10), (100, 1_600), (110, 10_000), (120, 1_000_000)]);
        for (number, told) in [
            (0, &[110][..]),
            (100, &[110, 120]),
            (110, &[110]),
            (120, &[120]),
            (101, &[]),
            (121, &[]),
            (130, &[]),
            (11, &[]),
        ] {
            let key = settings.key(number).unwrap();
            let caps = capped_by(&settings, &F407, 3, key);
            let found: Vec<_> = caps.map(|capped| capped.number).collect();
            assert_eq!(found, told, "${number}");
        }
    }

    #[test]
    fn the_largest_rate_of_the_smallest_scale_saturates() {
        let mut settings = Settings::<3>::default();
        let scale = Entry {
            number: 100,
            value: Number::from_nanos(1),
        };
        settings.set(scale, F407.limits(3)).unwrap();
        assert!(largest_rate(&settings, &F407, 3, 0).most > Number::from_int(i32::MAX));
    }
}
