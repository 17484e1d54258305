//! `leadscrew calibrate`: steps per mm from a measured move.

use super::said::say;
use super::setting_args::{machine, SettingArgs};
use super::{unusable, Unusable};
use clap::{Args, ValueEnum};
use leadscrew_import::calibrate::steps_per_mm;
use leadscrew_import::Mm;
use leadscrew_machine::settings::table::AxisSetting;
use leadscrew_machine::settings::values::Key;

/// Options of `calibrate`.
#[derive(Args, Debug)]
pub(super) struct CalibrateArgs {
    /// The axis.
    axis: AxisArg,
    /// How far it was told to go, mm.
    #[arg(long, value_name = "MM")]
    commanded: Mm,
    /// How far it went, mm.
    #[arg(long, value_name = "MM")]
    measured: Mm,
    #[command(flatten)]
    machine: SettingArgs,
}

#[derive(Clone, Copy, ValueEnum, Debug)]
enum AxisArg {
    X,
    Y,
    Z,
}

/// Prints the setting with which an axis moves as far as it is told.
///
/// # Errors
/// Where a length is not above 0 or the result is no setting.
pub(super) fn calibrate(args: &CalibrateArgs) -> Result<bool, Unusable> {
    let machine = machine(&args.machine)?;
    let axis = args.axis as usize;
    let key = Key::Axis(AxisSetting::StepsPerMm, axis);
    let now = machine.settings.get(key);
    let steps = steps_per_mm(now, args.commanded, args.measured).map_err(unusable)?;
    eprintln!(
        "{now} steps/mm made {} mm of {} mm",
        args.measured, args.commanded
    );
    say(format!("${}={steps}", key.number()))?;
    Ok(true)
}
