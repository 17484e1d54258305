//! `leadscrew resume`: the rest of a job that was broken off.

use super::import::OutputArgs;
use super::input;
use super::said::{aside, put};
use super::setting_args::{machine, SettingArgs};
use super::{unusable, Unusable};
use clap::Args;
use leadscrew_files::{is_input, is_stdout, Output};
use leadscrew_gcode::{leading_number, Number};
use leadscrew_jobs::{rest_of, Ask};
use leadscrew_planner::Coordinate;
use std::io::Write;
use std::path::PathBuf;

/// Options of `resume`.
#[derive(Args, Debug)]
pub(super) struct ResumeArgs {
    /// The job; `-` reads standard input.
    file: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    machine: SettingArgs,
    /// The first line that is run, from 1. A sender that numbers lines shows it as `Ln:`.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    line: u64,
    /// How high the tool goes on its way there, Z in work coordinates, mm. Without this option it
    /// goes as high as the job has been.
    #[arg(long, value_name = "MM", allow_hyphen_values = true, value_parser = number)]
    clearance: Option<Number>,
    /// The time for the spindle to speed up, s. A laser needs none.
    #[arg(long, value_name = "SECONDS", default_value = "3", value_parser = seconds)]
    spin_up: Number,
    /// The job's start, in work coordinates, mm. Needed if the job counts from there (G91, G92).
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = place)]
    start: Option<[Coordinate; 3]>,
}

/// Reads a decimal of at most 6 digits before the point.
fn number(text: &str) -> Result<Number, String> {
    let most = Number::from_int(999_999);
    match leading_number(text.trim().as_bytes()) {
        Ok((number, [])) if number <= most && number.nanos() >= -most.nanos() => Ok(number),
        Ok(_) | Err(_) => Err(format!("expected a number such as 12.5, found {text}")),
    }
}

fn seconds(text: &str) -> Result<Number, String> {
    number(text)
        .ok()
        .filter(|seconds| (0..=3600).contains(&seconds.trunc()) && seconds.nanos() >= 0)
        .ok_or_else(|| format!("expected seconds from 0 to 3600, found {text}"))
}

fn place(text: &str) -> Result<[Coordinate; 3], String> {
    let parts: Vec<_> = text.split(',').map(number).collect::<Result<_, _>>()?;
    let place: [Number; 3] = parts
        .try_into()
        .map_err(|_| "expected X,Y,Z in mm, such as 12.5,3,0".to_owned())?;
    Ok(place.map(|mm| Coordinate::from_nanos(mm.nanos())))
}

/// Writes the rest of a job; returns whether it could.
///
/// # Errors
/// If an option, the machine or the file cannot be used, or the job cannot be begun there.
pub(super) fn resume(args: &ResumeArgs) -> Result<bool, Unusable> {
    let machine = machine(&args.machine)?;
    let job = input::open(&args.file).map_err(unusable)?;
    let name = job.name.clone();
    let ask = Ask {
        line: args.line,
        clearance: args.clearance.map(|mm| Coordinate::from_nanos(mm.nanos())),
        spin_up: args.spin_up,
        start: args.start,
    };
    let rest = rest_of(&machine, &name, job.text, &ask)
        .map_err(|error| unusable(format!("{name}: cannot be read: {error}")))?;
    let rest = match rest {
        Ok(rest) => rest,
        Err(error) => {
            aside(format!("{name}:{}: {error}", args.line));
            return Ok(false);
        }
    };
    if !args.output.quiet {
        let preamble = rest.preamble.join("\n  ");
        aside(format!(
            "{name} from line {}, after\n  {preamble}",
            args.line
        ));
    }
    let mut text = rest.preamble.join("\n").into_bytes();
    for line in &rest.lines {
        text.push(b'\n');
        text.extend(line);
    }
    text.push(b'\n');
    let path = &args.output.output;
    if is_stdout(path) {
        put(&text)?;
        return Ok(true);
    }
    if is_input(path, &args.machine.inputs(&args.file)) {
        let shown = leadscrew_files::shown(path);
        return Err(unusable(format!(
            "{shown}: is a file that is read; the rest needs another name"
        )));
    }
    let output = Output::create(path).map_err(unusable)?;
    let written = output.pen().write_all(&text);
    output.complete(written).map_err(unusable)?;
    Ok(true)
}
