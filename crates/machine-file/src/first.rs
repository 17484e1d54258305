//! The first settings of a new machine, as its file gives them: numbers and values.

use super::named::Named;
use super::{Axis, End, Positive, Profile, MOST_AXES};
use leadscrew_gcode::Number;
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::protocol::status::Status;
use leadscrew_machine::settings::table::{AxisSetting, Kind, Setting};
use leadscrew_machine::settings::values::{Entry, Key, Settings, StepLimits};
use leadscrew_stepper::MotorMask;
use std::ops::RangeInclusive;
use toml::Spanned;

/// The values that a setting can hold at all.
const VALUES: RangeInclusive<f64> = -9e9..=9e9;

/// The number of times that all settings are tried: some are refused until another one is set.
const PASSES: usize = 2;

impl Profile {
    /// Returns the first settings of this machine that differ from a stock Grbl's, in the order in
    /// which they take effect.
    pub fn first_settings(&self) -> Vec<Entry> {
        self.named_settings().iter().map(entry).collect()
    }

    /// The first setting that the machine refuses, and why.
    pub(super) fn refused_setting(&self) -> Option<(Named, String)> {
        let all = self.named_settings();
        if let Some(named) = all.iter().find(|named| !VALUES.contains(&named.value)) {
            let expected = "expected a number between -9e9 and 9e9".to_owned();
            return Some((named.clone(), expected));
        }
        let axes = self.axis_count();
        let mut settings = Settings::<MOST_AXES>::new(&[]);
        let limit = MachineConfig::<MOST_AXES>::new().step_timing.limits(axes);
        let mut refused = None;
        for _ in 0..PASSES {
            let mut results = all.iter().map(|named| {
                let known = Key::from_number(named.number, axes).ok_or(Status::InvalidStatement);
                let result = known.and_then(|_| settings.set(entry(named), limit));
                result.err().map(|status| (named.clone(), status))
            });
            refused = results.by_ref().fold(None, Option::or);
        }
        refused.map(|(named, status)| {
            let key = Key::from_number(named.number, axes);
            let message = key.map_or(status.text().to_owned(), |key| in_words(status, key, limit));
            (named, message)
        })
    }

    /// All settings of the file: those that follow from switches and axes, then names, then
    /// numbers.
    fn named_settings(&self) -> Vec<Named> {
        let mut all = self.masks();
        for (number, (axis, letter)) in self.all_axes().zip(self.letters()).enumerate() {
            all.extend(of_axis(axis, number as u16, letter.to_ascii_lowercase()));
        }
        all.extend(self.motors.named());
        all.extend(self.bounds.named());
        all.extend(self.path.named());
        all.extend(self.spindle.named());
        all.extend(self.laser.named());
        all.extend(self.dead_man.named());
        all.extend(self.reports.named());
        all.extend(self.streaming.named());
        all.extend(self.homing.named());
        all.extend(self.settings.iter().map(|(number, value)| Named {
            key: format!("settings.${}", number.0),
            number: number.0,
            value: *value.get_ref(),
            at: value.span().start,
        }));
        all
    }

    /// The motors whose direction is reversed.
    pub fn reversed(&self) -> MotorMask {
        let axes = self.all_axes().map(|axis| axis.reversed);
        let second = self.second_motor.as_ref().map(|second| second.reversed);
        let motors = axes.chain(second).enumerate();
        let bits = motors.fold(0, |mask, (motor, is)| mask | u8::from(is) << motor);
        MotorMask::from_bits(bits)
    }

    /// Settings with one bit for each axis or motor, and the level of the limit switches.
    fn masks(&self) -> Vec<Named> {
        let bits = |is: fn(&Axis) -> bool| {
            let axes = self.all_axes().enumerate();
            axes.fold(0, |mask, (axis, of)| mask | u8::from(is(of)) << axis)
        };
        let masks = [
            (Setting::StepInvert, bits(|axis| axis.step_inverted)),
            (Setting::DirectionInvert, self.reversed().bits()),
            (Setting::HomingDirection, bits(|axis| axis.home == End::Low)),
            (Setting::OwnHomes, bits(|axis| axis.home_place_mm.is_some())),
            (
                Setting::LimitInvert,
                u8::from(self.switches.normally_closed),
            ),
        ];
        let given = masks.into_iter().filter(|(_, mask)| *mask != 0);
        let named = |(setting, mask): (Setting, u8)| Named {
            key: "axes".to_owned(),
            number: setting.row().number,
            value: f64::from(mask),
            at: 0,
        };
        given.map(named).collect()
    }
}

/// Why a setting was refused, with the values that it takes.
fn in_words(status: Status, key: Key, limits: StepLimits) -> String {
    let text = status.text();
    if !matches!(status, Status::OutOfRange | Status::NegativeValue) {
        return text.to_owned();
    }
    let row = key.row();
    let values = match row.kind {
        Kind::Switch => "0 or 1".to_owned(),
        Kind::AxisMask | Kind::Bits(_) => "0 to 255".to_owned(),
        Kind::Whole { max } if key == Key::Machine(Setting::StepPulse) => {
            format!("{} to {max}", limits.shortest_pulse_us)
        }
        Kind::Whole { max } => format!("0 to {max}"),
        Kind::Decimal { zero: true, .. } => "0 or more".to_owned(),
        Kind::Decimal { zero: false, .. } => "more than 0".to_owned(),
        Kind::Signed { most } => format!("-{most} to {most}"),
    };
    let unit = match row.unit {
        "" | "mask" => String::new(),
        unit => format!(" {unit}"),
    };
    format!("{text}: expected {values}{unit}")
}

/// The settings in the table of an axis.
fn of_axis(axis: &Axis, number: u16, letter: char) -> impl Iterator<Item = Named> + use<'_> {
    let values: [(&str, AxisSetting, &Option<Spanned<Positive>>); 7] = [
        ("steps_per_mm", AxisSetting::StepsPerMm, &axis.steps_per_mm),
        ("travel", AxisSetting::Travel, &axis.travel),
        ("rate_mm_min", AxisSetting::MaxRate, &axis.rate_mm_min),
        (
            "acceleration_mm_s2",
            AxisSetting::Acceleration,
            &axis.acceleration_mm_s2,
        ),
        (
            "home_pull_off_mm",
            AxisSetting::PullOff,
            &axis.home_pull_off_mm,
        ),
        (
            "home_seek_mm_min",
            AxisSetting::HomeSeek,
            &axis.home_seek_mm_min,
        ),
        (
            "home_feed_mm_min",
            AxisSetting::HomeFeed,
            &axis.home_feed_mm_min,
        ),
    ];
    let named = move |key: &str, setting: AxisSetting, value: f64, at: usize| Named {
        key: format!("axes.{letter}.{key}"),
        number: setting.row().number + number,
        value,
        at,
    };
    let place = axis.home_place_mm.as_ref().map(|place| {
        let (mm, at) = (place.get_ref().mm(), place.span().start);
        named("home_place_mm", AxisSetting::HomePlace, mm, at)
    });
    let values = values.into_iter().filter_map(move |(key, setting, value)| {
        let value = value.as_ref()?;
        Some(named(
            key,
            setting,
            value.get_ref().get(),
            value.span().start,
        ))
    });
    values.chain(place)
}

fn entry(named: &Named) -> Entry {
    let value = Number::from_nanos((named.value * 1e9).round() as i64);
    Entry {
        number: named.number,
        value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// The first settings of a machine, by number.
    fn first(text: &str) -> Vec<(u16, i64)> {
        let file = Profile::parse(Path::new("test.toml"), text).unwrap();
        let entries = file.first_settings().into_iter();
        entries
            .map(|entry| (entry.number, entry.value.nanos()))
            .collect()
    }

    #[test]
    fn names_stand_for_numbers() {
        let text = "[laser]\non = true\nlead_us = 250\n[homing]\npull_off_mm = 1.5\n";
        let wanted = [
            (32, 1_000_000_000),
            (703, 250_000_000_000),
            (27, 1_500_000_000),
        ];
        assert_eq!(first(text), wanted);
    }

    #[test]
    fn masks_are_made_of_what_each_axis_says() {
        let text = "[axes.x]\nhome = \"low\"\n[axes.z]\nreversed = true\nstep_inverted = true\n\
            [axes.y]\nreversed = true\nhome = \"low\"\n[second_motor]\naxis = \"y\"\nstart = 0\nreversed = true\n";
        let masks: Vec<_> = first(text)
            .into_iter()
            .map(|(number, nanos)| (number, nanos / 1_000_000_000))
            .collect();
        assert_eq!(masks, [(2, 0b100), (3, 0b1110), (23, 0b011)]);
    }

    #[test]
    fn an_axis_has_a_home_of_its_own() {
        let text = "[axes.y]\nhome = \"low\"\nhome_place_mm = -2.5\nhome_pull_off_mm = 3\n\
            home_seek_mm_min = 900\nhome_feed_mm_min = 60\n";
        let found: Vec<_> = first(text)
            .into_iter()
            .map(|(number, nanos)| (number, nanos / 100_000_000))
            .collect();
        let wanted = [
            (23, 20),
            (719, 20),
            (751, 30),
            (761, 9000),
            (771, 600),
            (741, -25),
        ];
        assert_eq!(found, wanted);
    }

    #[test]
    fn a_number_wins_over_a_name() {
        let text = "[laser]\nlead_us = 250\n[settings]\n\"$703\" = 100\n";
        assert_eq!(first(text).last(), Some(&(703, 100_000_000_000)));
    }

    #[test]
    fn a_refused_name_is_shown_with_its_line() {
        let wrong = |text| {
            let wrong = Profile::parse(Path::new("m.toml"), text).unwrap_err();
            wrong.to_string()
        };
        let refused = wrong("[laser]\non = true\nlead_us = 5000\n");
        assert!(
            refused.starts_with("m.toml:3: laser.lead_us: "),
            "{refused}"
        );
        let refused = wrong("[axes.y]\nsteps_per_mm = 400000\n");
        assert!(
            refused.starts_with("m.toml:2: axes.y.steps_per_mm: "),
            "{refused}"
        );
        let unknown = wrong("[laser]\nled_us = 5\n");
        assert!(
            unknown.starts_with("m.toml:2: laser.led_us: unknown field `led_us`, expected one of "),
            "{unknown}"
        );
        let gap = wrong("[axes.b]\nrotary = true\n");
        assert!(gap.contains("axes: expected axes in the order"), "{gap}");
    }

    #[test]
    fn a_setting_that_is_no_finite_number_is_refused() {
        for (key, line) in [
            ("laser.lead_us", "[laser]\nlead_us = "),
            ("motors.idle_delay_ms", "[motors]\nidle_delay_ms = "),
            ("settings.$110", "[settings]\n\"$110\" = "),
        ] {
            for value in ["nan", "-nan", "inf", "-inf", "1e300"] {
                let text = format!("{line}{value}\n");
                let wrong = Profile::parse(Path::new("m.toml"), &text).unwrap_err();
                let expected = format!("m.toml:2: {key}: expected a number between -9e9 and 9e9");
                assert_eq!(wrong.to_string(), expected, "{value}");
            }
        }
    }

    #[test]
    fn axes_beyond_z_have_settings_of_their_own() {
        let text =
            "[axes.a]\nsteps_per_mm = 10\n[axes.b]\nrate_mm_min = 700\n[axes.c]\ntravel = 360\n";
        let numbers: Vec<u16> = first(text).iter().map(|(number, _)| *number).collect();
        assert_eq!(numbers, [103, 114, 135]);
    }
}
