//! `leadscrew calibrate`: steps per mm from a measured move.

use super::said::{aside, say};
use super::setting_args::{machine, SettingArgs};
use super::{unusable, Unusable};
use clap::Args;
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
/// Where the machine lacks the axis, a length is not above 0, or the machine refuses the result.
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
    say(format!("${number}={value}"))?;
    Ok(true)
}
