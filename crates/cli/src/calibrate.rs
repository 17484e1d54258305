//! `leadscrew calibrate`: steps per mm from a measured move.

use super::said::{aside, say};
use super::setting_args::{machine, SettingArgs};
use super::{unusable, Unusable};
use clap::Args;
use leadscrew_gcode::Number;
use leadscrew_import::calibrate::steps_per_mm;
use leadscrew_import::Mm;
use leadscrew_jobs::TIMING;
use leadscrew_machine::settings::table::AxisSetting;
use leadscrew_machine::settings::values::{Entry, Key};

/// Options of `calibrate`.
#[derive(Args, Debug)]
pub(super) struct CalibrateArgs {
    /// The axis: x, y, z, or another one of the machine's file.
    axis: char,
    /// How far it was told to go, mm.
    #[arg(long, value_name = "MM")]
    commanded: Mm,
    /// How far it went, mm.
    #[arg(long, value_name = "MM")]
    measured: Mm,
    #[command(flatten)]
    machine: SettingArgs,
}

/// Prints the setting with which an axis moves as far as it is told.
///
/// # Errors
/// If the machine lacks the axis, a length is not above 0, or the machine refuses the result.
pub(super) fn calibrate(args: &CalibrateArgs) -> Result<bool, Unusable> {
    let machine = machine(&args.machine)?;
    let letter = args.axis.to_ascii_uppercase();
    let letters = machine.file.letters();
    let axis = letters.iter().position(|one| *one == letter);
    let axis = axis.ok_or_else(|| {
        let has: Vec<String> = letters.iter().map(char::to_string).collect();
        unusable(format!(
            "the machine has no axis {letter}, but {}",
            has.join(", ")
        ))
    })?;
    let key = Key::Axis(AxisSetting::StepsPerMm, axis);
    let now = machine.settings.get(key);
    let value = steps_per_mm(now, args.commanded, args.measured).map_err(unusable)?;
    let number = key.number();
    let limits = TIMING.limits(machine.axes());
    let taken = machine
        .settings
        .clone()
        .set(Entry { number, value }, limits);
    taken.map_err(|status| {
        let (error, text) = (status.number(), status.text());
        unusable(format!("${number}={value}: error:{error}: {text}"))
    })?;
    aside(format!(
        "{now} steps/mm made {} mm of {} mm",
        args.measured, args.commanded
    ));
    if let Some(note) = doubt(now, value) {
        aside(note);
    }
    say(format!("${number}={value}"))?;
    Ok(true)
}

/// A note about a setting that changes by more than wear and tolerances explain.
fn doubt(now: Number, new: Number) -> Option<String> {
    let times = new.nanos() as f64 / (now.nanos() as f64).max(1.0);
    let is_likely = (1.0 / LIKELY..=LIKELY).contains(&times);
    let note = format!(
        "note: the setting changes {times:.2}-fold. Are both lengths mm? Do the driver's microsteps \
         and the belt or screw agree with the setting?"
    );
    (!is_likely).then_some(note)
}

/// The most by which a setting changes that was right once.
const LIKELY: f64 = 1.5;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_that_no_wear_explains_is_doubted() {
        let told = |now, new| doubt(Number::from_int(now), Number::from_int(new));
        assert_eq!(told(250, 252), None);
        assert_eq!(told(250, 200), None);
        assert!(told(250, 2500).is_some_and(|note| note.contains("10.00-fold")));
        assert!(told(250, 125).is_some_and(|note| note.contains("0.50-fold")));
    }
}
