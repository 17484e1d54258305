//! The machine's settings from the command line: Grbl's defaults, a file over them, single ones over that.

use super::args::SettingArgs;
use super::settings_file::{self, SettingLine};
use super::{unusable, Unusable};
use leadscrew_gcode::leading_number;
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::protocol::status::Status;
use leadscrew_machine::settings::values::{Entry, Key, Settings};

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
    put(&mut settings, &lines, config.max_step_rate)?;
    Ok(settings)
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
    max_step_rate: u32,
) -> Result<(), Unusable> {
    let mut postponed = Vec::new();
    for line in lines {
        match set(settings, line, max_step_rate) {
            Ok(()) => {}
            Err(Status::SoftLimitsNeedHoming) => postponed.push(line),
            Err(status) => return Err(refused(line, status)),
        }
    }
    for line in postponed {
        set(settings, line, max_step_rate).map_err(|status| refused(line, status))?;
    }
    Ok(())
}

fn set(settings: &mut Settings<AXES>, line: &SettingLine, rate: u32) -> Result<(), Status> {
    let entry = entry(&line.text)?;
    settings.set(entry, rate).map(|_| ())
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

fn refused(line: &SettingLine, status: Status) -> Unusable {
    let (number, text, advice) = (status.number(), status.text(), status.explanation());
    unusable(format!(
        "{}: {}: error:{number}: {text}\n  {advice}",
        line.origin, line.text
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_machine::settings::table::Setting;

    fn settings_of(texts: &[&str]) -> Result<Settings<AXES>, String> {
        let mut settings = Settings::default();
        let lines: Vec<_> = texts
            .iter()
            .map(|text| settings_file::option(text).unwrap())
            .collect();
        put(&mut settings, &lines, 250_000).map_err(|error| error.to_string())?;
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
        let message = settings_of(&["$0=1"]).unwrap_err();
        assert!(
            message.contains("--set '$0=1'") && message.contains("error:6"),
            "{message}"
        );
        assert!(settings_of(&["$999=1"]).unwrap_err().contains("error:3"));
        assert!(settings_of(&["$110=1x"]).unwrap_err().contains("error:3"));
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
