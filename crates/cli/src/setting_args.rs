//! The machine's settings from the command line: Grbl's defaults, a file over them, single ones over that.

use super::args::SettingArgs;
use super::settings_file::{self, SettingLine};
use super::{unusable, Unusable};
use leadscrew_gcode::{leading_number, Number};
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::protocol::status::Status;
use leadscrew_machine::settings::table::{AxisSetting, Setting};
use leadscrew_machine::settings::values::{Entry, Key, Settings};
use leadscrew_machine::step_rate;
use leadscrew_machine::step_timing::StepTiming;

/// Axes of the machine that the command line simulates.
pub(super) const AXES: usize = 3;

/// Reads all settings and puts them into effect one after the other.
///
/// # Errors
/// The first that is no setting or is refused, with where it came from and GRBL's words for it.
pub(super) fn settings(
    args: &SettingArgs,
    config: &MachineConfig<AXES>,
) -> Result<Settings<AXES>, Unusable> {
    let mut lines = match &args.settings {
        Some(path) => settings_file::read(path).map_err(unusable)?,
        None => Vec::new(),
    };
    for option in &args.set {
        lines.push(settings_file::option(option).map_err(unusable)?);
    }
    let mut settings = Settings::new(config.defaults);
    put(&mut settings, &lines, &config.step_timing)?;
    Ok(settings)
}

/// The settings of a machine's own listing: what this machine refuses keeps its default.
pub(super) fn from_listing(listing: &str, config: &MachineConfig<AXES>) -> Settings<AXES> {
    let mut settings = Settings::new(config.defaults);
    for entry in listing.lines().filter_map(|line| entry(line).ok()) {
        settings.load(entry);
    }
    settings
}

/// The settings as a machine's own defaults, which it boots with. They live as long as the process.
pub(super) fn as_defaults(settings: &Settings<AXES>) -> &'static [Entry] {
    let entry = |key: Key| Entry {
        number: key.number(),
        value: settings.get(key),
    };
    let entries: Vec<Entry> = Settings::<AXES>::keys().map(entry).collect();
    entries.leak()
}

/// Puts `lines` into effect in their order; one that needs a later one (soft limits before homing) is tried again
/// after it.
fn put(
    settings: &mut Settings<AXES>,
    lines: &[SettingLine],
    timing: &StepTiming,
) -> Result<(), Unusable> {
    let mut postponed = Vec::new();
    for line in lines {
        match set(settings, line, timing) {
            Ok(()) => {}
            Err(Status::SoftLimitsNeedHoming) => postponed.push(line),
            Err(status) => return Err(refused(line, status, settings, timing)),
        }
    }
    for line in postponed {
        set(settings, line, timing).map_err(|status| refused(line, status, settings, timing))?;
    }
    Ok(())
}

fn set(
    settings: &mut Settings<AXES>,
    line: &SettingLine,
    timing: &StepTiming,
) -> Result<(), Status> {
    let entry = entry(&line.text)?;
    settings.set(entry, timing.limits(AXES)).map(|_| ())
}

fn entry(text: &str) -> Result<Entry, Status> {
    let (number, value) = text
        .strip_prefix('$')
        .and_then(|rest| rest.split_once('='))
        .ok_or(Status::InvalidStatement)?;
    let number = number
        .trim()
        .parse()
        .map_err(|_| Status::InvalidStatement)?;
    match leading_number(value.trim().as_bytes()) {
        Ok((value, [])) => Ok(Entry { number, value }),
        Ok((_, _)) => Err(Status::InvalidStatement),
        Err(_) => Err(Status::BadNumber),
    }
}

fn refused(
    line: &SettingLine,
    status: Status,
    settings: &Settings<AXES>,
    timing: &StepTiming,
) -> Unusable {
    let (number, text, advice) = (status.number(), status.text(), status.explanation());
    let instead = match (status, entry(&line.text)) {
        (Status::StepRateTooHigh, Ok(entry)) => instead(settings, timing, entry.number),
        _ => String::new(),
    };
    unusable(format!(
        "{}: {}: error:{number}: {text}\n  {advice}{instead}",
        line.origin, line.text
    ))
}

/// What would work in place of a setting that was refused for its step rate.
pub(super) fn instead(settings: &Settings<AXES>, timing: &StepTiming, number: u16) -> String {
    let key = Key::from_number(number, AXES);
    let capped = key.and_then(|key| step_rate::instead(settings, timing, AXES, key));
    capped.map_or_else(String::new, |capped| {
        format!(" ${number} can be {} at most.", plain(capped.most))
    })
}

/// Says on the standard error output where motion is capped.
pub(super) fn say_capped(settings: &Settings<AXES>, timing: &StepTiming) {
    for words in capped(settings, timing) {
        eprintln!("note: {words}");
    }
}

/// Says of each rate that asks for more steps than the board can make what it comes to.
fn capped(settings: &Settings<AXES>, timing: &StepTiming) -> Vec<String> {
    let pulse = settings.whole(Setting::StepPulse);
    let rate = timing.highest_rate(u8::try_from(pulse).unwrap_or(u8::MAX), AXES);
    let words = |axis: usize| {
        let capped = step_rate::capped(settings, timing, AXES, axis)?;
        let asked = settings.get(Key::Axis(AxisSetting::MaxRate, axis));
        Some(format!(
            "${number}={asked}: {most} mm/min is the most with $0={pulse}, {rate} steps/s; motion is capped there",
            number = capped.number,
            asked = plain(asked),
            most = plain(capped.most),
        ))
    };
    (0..AXES).filter_map(words).collect()
}

fn plain(number: Number) -> f64 {
    number.nanos() as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings_of(texts: &[&str]) -> Result<Settings<AXES>, String> {
        let mut settings = Settings::default();
        let lines: Vec<_> = texts
            .iter()
            .map(|text| settings_file::option(text).unwrap())
            .collect();
        put(&mut settings, &lines, &StepTiming::F407).map_err(|error| error.to_string())?;
        Ok(settings)
    }

    #[test]
    fn soft_limits_may_stand_before_homing_as_listings_have_them() {
        let settings = settings_of(&["$20=1", "$22=1"]).unwrap();
        assert!(settings.is_on(Setting::SoftLimits));
        assert!(settings_of(&["$20=1"]).unwrap_err().contains("error:10"));
    }

    #[test]
    fn a_refused_setting_is_shown_with_its_place_and_words() {
        let message = settings_of(&["$0=0.9"]).unwrap_err();
        assert!(
            message.contains("--set '$0=0.9'") && message.contains("error:6"),
            "{message}"
        );
        assert!(settings_of(&["$999=1"]).unwrap_err().contains("error:3"));
        assert!(settings_of(&["$110=1x"]).unwrap_err().contains("error:3"));
    }

    #[test]
    fn words_name_the_largest_rate_that_would_work() {
        let settings = settings_of(&["$110=30000", "$111=20000"]).unwrap();
        let words = "$110=30000: 21818.16 mm/min is the most with $0=10, 90909 steps/s; motion is capped there";
        assert_eq!(capped(&settings, &StepTiming::F407), [words]);
        let refused = settings_of(&["$110=20000000"]).unwrap_err();
        let instead = "$110 can be 21818.16 at most.";
        assert!(
            refused.contains("error:12") && refused.contains(instead),
            "{refused}"
        );
        let refused = settings_of(&["$100=300000"]).unwrap_err();
        assert!(refused.contains("$100 can be 250000 at most."), "{refused}");
    }

    #[test]
    fn a_machine_boots_with_what_was_set() {
        let settings = settings_of(&["$110=6000", "$32=1"]).unwrap();
        let booted = Settings::<AXES>::new(as_defaults(&settings));
        assert!(booted == settings || booted.is_on(Setting::Laser));
        assert_eq!(
            booted.listed(21).unwrap().to_string(),
            settings.listed(21).unwrap().to_string()
        );
    }
}
