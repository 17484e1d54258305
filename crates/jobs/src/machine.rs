//! The machine that a job is for: Grbl's settings, overridden by a machine file, overridden by
//! lines of settings.

use crate::settings_file::{SettingLine, SettingsError};
use leadscrew_gcode::{leading_number, Number};
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::home::{self, Bounds};
use leadscrew_machine::protocol::message::Capped;
use leadscrew_machine::protocol::status::Status;
use leadscrew_machine::settings::table::{AxisSetting, Setting};
use leadscrew_machine::settings::values::{Entry, Key, Settings};
use leadscrew_machine::step_rate;
use leadscrew_machine::step_timing::StepTiming;
use leadscrew_outputs::OutputsConfig;
use leadscrew_planner::StepsPerMm;
use leadscrew_sim::oven::HeatFault;
use leadscrew_sim::profile::{BufferSize, LookAhead, Profile, MOST_AXES};
use leadscrew_sim::scene::Tooling;
use leadscrew_sim::Fixtures;

/// A machine: its file, and its settings.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Its file; a stock Grbl without switches if the user names none.
    pub file: Profile,
    /// Its settings, including those of axes that it lacks.
    pub settings: Settings<MOST_AXES>,
    /// Its outputs that M62 to M65 switch.
    pub outputs: OutputsConfig,
    /// A failure of a heater during the run.
    pub heat_fault: Option<HeatFault>,
    /// It plans as Grbl does: no rows of a raster.
    pub(crate) is_grbl: bool,
    /// The same settings as the first settings of a new machine, with which it boots.
    first: &'static [Entry],
}

impl Machine {
    /// Returns the machine of `file`, with `lines` of settings put into effect one after the other.
    ///
    /// # Errors
    /// The first line that is refused, with its origin and GRBL's words for the refusal.
    pub fn new(file: Profile, lines: &[SettingLine]) -> Result<Self, SettingsError> {
        let mut settings = Settings::new(file.first_settings().leak());
        put(&mut settings, lines, file.axis_count())?;
        Ok(Self::of(file, settings))
    }

    /// Makes a machine with the settings of a listing by `$$`. A setting that this machine refuses
    /// keeps its default.
    pub fn from_listing(listing: &str, file: Profile) -> Self {
        let mut settings = Settings::new(&[]);
        for entry in listing.lines().filter_map(|line| entry(line).ok()) {
            settings.load(entry);
        }
        Self::of(file, settings)
    }

    /// Returns the rule that tells which feed moves are cuts.
    pub fn tooling(&self) -> Tooling {
        self.file.tooling()
    }

    fn of(file: Profile, settings: Settings<MOST_AXES>) -> Self {
        let first = as_defaults(&settings, file.axis_count());
        Self {
            outputs: file.outputs.config(),
            heat_fault: None,
            is_grbl: false,
            file,
            settings,
            first,
        }
    }

    /// Returns the same machine with other settings.
    pub fn with(&self, settings: &Settings<MOST_AXES>) -> Self {
        Self::of(self.file.clone(), settings.clone())
    }

    /// Returns the same machine with Grbl in place of this firmware: 15 moves planned ahead, 128
    /// bytes of buffer, Grbl's corner rule, no rows, and none of the settings that Grbl lacks.
    pub fn as_grbl(&self) -> Self {
        let mut file = self.file.clone();
        (file.look_ahead, file.receive_buffer) = (Some(LookAhead(15)), Some(BufferSize(128)));
        let mut settings = self.settings.clone();
        let own = [
            (Setting::GrblCorners, 1),
            (Setting::Jerk, 0),
            (Setting::Resonance, 0),
            (Setting::LaserLead, 0),
            (Setting::StartSilence, 0),
        ];
        for (setting, value) in own {
            settings.load(Entry {
                number: Key::Machine(setting).number(),
                value: Number::from_int(value),
            });
        }
        Self {
            is_grbl: true,
            outputs: self.outputs,
            ..Self::of(file, settings)
        }
    }

    /// Returns the number of its axes.
    pub fn axes(&self) -> usize {
        self.file.axis_count()
    }

    /// Returns its settings as the first settings of a new machine. They live as long as the
    /// process.
    pub fn first(&self) -> &'static [Entry] {
        self.first
    }

    /// Returns its build, with which it boots with these settings.
    pub fn config<const AXES: usize>(&self) -> MachineConfig<AXES> {
        MachineConfig {
            defaults: self.first,
            ..self.file.config()
        }
    }

    /// Returns the ends of each axis's travel, machine position.
    pub fn bounds(&self) -> Vec<Bounds> {
        let scales = self.settings.axes(AxisSetting::StepsPerMm);
        let reach = scales.map(|scale| StepsPerMm::from_nanos(scale.nanos()).coordinate(1 << 30));
        home::bounds(&self.settings, &reach)[..self.axes()].to_vec()
    }

    /// Returns the values of an axis setting, one for each axis.
    pub fn of_axes(&self, setting: AxisSetting) -> Vec<f64> {
        let all = self.settings.axes(setting);
        all[..self.axes()].iter().copied().map(plain).collect()
    }
}

/// The time that the simulated board takes to make steps.
pub const TIMING: StepTiming = StepTiming::F407;

/// The settings as the defaults of a new machine. They live as long as the process.
fn as_defaults(settings: &Settings<MOST_AXES>, axes: usize) -> &'static [Entry] {
    let of_machine = |key: &Key| Key::from_number(key.number(), axes).is_some();
    let entry = |key: Key| Entry {
        number: key.number(),
        value: settings.get(key),
    };
    let keys = Key::all(MOST_AXES).filter(of_machine);
    let entries: Vec<Entry> = keys.map(entry).collect();
    entries.leak()
}

/// Puts `lines` into effect in their order. A line that needs a later one (such as soft limits
/// before homing) is tried again after it.
fn put(
    settings: &mut Settings<MOST_AXES>,
    lines: &[SettingLine],
    axes: usize,
) -> Result<(), SettingsError> {
    let mut postponed = Vec::new();
    for line in lines {
        match set(settings, line, axes) {
            Ok(()) => {}
            Err(Status::SoftLimitsNeedHoming) => postponed.push(line),
            Err(status) => return Err(refused(line, status, settings, axes)),
        }
    }
    for line in postponed {
        set(settings, line, axes).map_err(|status| refused(line, status, settings, axes))?;
    }
    Ok(())
}

fn set(settings: &mut Settings<MOST_AXES>, line: &SettingLine, axes: usize) -> Result<(), Status> {
    let entry = entry(&line.text)?;
    Key::from_number(entry.number, axes).ok_or(Status::InvalidStatement)?;
    settings.set(entry, TIMING.limits(axes)).map(|_| ())
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
    settings: &Settings<MOST_AXES>,
    axes: usize,
) -> SettingsError {
    let (number, text, advice) = (status.number(), status.text(), status.explanation());
    let instead = match (status, entry(&line.text)) {
        (Status::StepRateTooHigh, Ok(entry)) => instead(settings, axes, entry.number),
        _ => String::new(),
    };
    SettingsError(format!(
        "{}: {}: error:{number}: {text}\n  {advice}{instead}",
        line.origin, line.text
    ))
}

/// The settings that would be accepted in place of one that was refused for its step rate.
pub(crate) fn instead<const AXES: usize>(
    settings: &Settings<AXES>,
    axes: usize,
    number: u16,
) -> String {
    let key = Key::from_number(number, axes);
    let capped = key.and_then(|key| step_rate::instead(settings, &TIMING, axes, key));
    capped.map_or_else(String::new, |capped| {
        format!(" ${number} can be {} at most.", plain(capped.most))
    })
}

/// Returns a sentence for each rate and acceleration that asks for more than the board can make; it
/// names the value that is reached.
pub fn capped(machine: &Machine) -> Vec<String> {
    capped_rates(&machine.settings, machine.axes())
}

fn capped_rates(settings: &Settings<MOST_AXES>, axes: usize) -> Vec<String> {
    let pulse = settings.whole(Setting::StepPulse);
    let rate = TIMING.highest_rate(u8::try_from(pulse).unwrap_or(u8::MAX), axes);
    let words = |capped: Capped| {
        let (number, most) = (capped.number, plain(capped.most));
        let key = settings.key(number);
        let asked = plain(key.map_or(Number::default(), |key| settings.get(key)));
        match (capped.is_acceleration(), key) {
            (true, Some(Key::Axis(_, axis))) => {
                let steps = plain(settings.get(Key::Axis(AxisSetting::StepsPerMm, axis)));
                let scale = AxisSetting::StepsPerMm.row().number as usize + axis;
                format!("${number}={asked}: {most} mm/s2 is the most with ${scale}={steps}; motion is capped there")
            }
            _ => format!("${number}={asked}: {most} mm/min is the most with $0={pulse}, {rate} steps/s; motion is capped there"),
        }
    };
    (0..axes)
        .flat_map(|axis| step_rate::capped(settings, &TIMING, axes, axis))
        .map(words)
        .collect()
}

fn plain(number: Number) -> f64 {
    number.nanos() as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings_file;

    fn settings_of(texts: &[&str]) -> Result<Settings<MOST_AXES>, String> {
        let mut settings = Settings::default();
        let lines: Vec<_> = texts
            .iter()
            .map(|text| settings_file::option(text).unwrap())
            .collect();
        put(&mut settings, &lines, 3).map_err(|error| error.to_string())?;
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
        assert_eq!(capped_rates(&settings, 3), [words]);
        let settings = settings_of(&["$101=1600", "$121=1000000"]).unwrap();
        let words = "$121=1000000: 312500 mm/s2 is the most with $101=1600; motion is capped there";
        assert_eq!(capped_rates(&settings, 3), [words]);
        let refused = settings_of(&["$110=30000000"]).unwrap_err();
        let instead = "$110 can be 21818.16 at most.";
        assert!(
            refused.contains("error:12") && refused.contains(instead),
            "{refused}"
        );
        let refused = settings_of(&["$100=400000"]).unwrap_err();
        assert!(refused.contains("$100 can be 370370 at most."), "{refused}");
    }

    #[test]
    fn a_machine_boots_with_what_was_set() {
        let settings = settings_of(&["$110=6000", "$32=1"]).unwrap();
        let booted = Settings::<MOST_AXES>::new(as_defaults(&settings, 3));
        assert!(booted == settings || booted.is_on(Setting::Laser));
        assert_eq!(
            booted.listed(21).unwrap().to_string(),
            settings.listed(21).unwrap().to_string()
        );
    }
}
