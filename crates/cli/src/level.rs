//! `leadscrew level`: bends a job so that its depth follows a surface that is not flat.

use super::import::{read, shown, write, OutputArgs};
use super::said::aside;
use super::Unusable;
use clap::Args;
use leadscrew_import::level::{job, Map};
use leadscrew_import::Mm;
use std::path::PathBuf;

/// Options of `level`.
#[derive(Args, Debug)]
pub(super) struct LevelArgs {
    /// The G-code file; `-` reads standard input.
    file: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
    /// The heights that were probed: `X,Y,Z` in each line, work coordinates in mm, or the machine's
    /// own reports `[PRB:...]`. They make a grid.
    #[arg(long, value_name = "FILE")]
    map: PathBuf,
    /// The machine position of work zero, mm: `[PRB:...]` counts from machine zero.
    #[arg(long, value_name = "X,Y,Z", default_value = "0,0,0", allow_hyphen_values = true, value_parser = place)]
    zero: [f64; 3],
    /// How far a piece may be from the surface or from its arc, mm.
    #[arg(long, value_name = "MM", default_value = "0.005", value_parser = tolerance)]
    tolerance: f64,
}

fn place(text: &str) -> Result<[f64; 3], String> {
    let mm = |part: &str| part.trim().parse::<Mm>().map(Mm::to_f64);
    let parts: Vec<f64> = text.split(',').map(mm).collect::<Result<_, _>>()?;
    parts
        .try_into()
        .map_err(|_| "expected X,Y,Z in mm, such as -200,-150,-12.5".to_owned())
}

fn tolerance(text: &str) -> Result<f64, String> {
    let mm = text.trim().parse::<Mm>()?.to_f64();
    match (0.0005..=1.0).contains(&mm) {
        true => Ok(mm),
        false => Err(format!("expected 0.0005 to 1 mm, found {text}")),
    }
}

/// Bends a job; returns whether it could.
///
/// # Errors
/// If an option or a file cannot be used.
pub(super) fn level(args: &LevelArgs) -> Result<bool, Unusable> {
    let heights = read(&args.map)?;
    let Some(map) = shown(&args.map, &heights, Map::read(&heights, args.zero)) else {
        return Ok(false);
    };
    let text = read(&args.file)?;
    let Some(job) = shown(&args.file, &text, job(&text, &map, args.tolerance)) else {
        return Ok(false);
    };
    if !args.output.quiet {
        let [(left, right), (front, back)] = map.bounds();
        aside(format!(
            "map from X{left:.3} Y{front:.3} to X{right:.3} Y{back:.3}, {} lines; {}",
            job.lines.len(),
            map.accuracy()
        ));
    }
    let inputs = [args.file.as_path(), args.map.as_path()];
    write(&job, &args.output.output, &inputs, &args.output)?;
    Ok(true)
}
