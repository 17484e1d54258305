//! `leadscrew align`: turns and shifts a job onto a board that is not clamped straight.

use super::import::{read, shown, write, OutputArgs};
use super::said::aside;
use super::{unusable, Unusable};
use clap::Args;
use leadscrew_import::align::{job, Fit, Pair, Place};
use leadscrew_import::Mm;
use std::path::PathBuf;

/// Options of `align`.
#[derive(Args, Debug)]
pub(super) struct AlignArgs {
    /// The G-code file; `-` reads standard input.
    file: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
    /// A point of the job, mm. Give this option at least twice.
    #[arg(long = "ref", value_name = "X,Y", required = true, allow_hyphen_values = true, value_parser = place)]
    nominal: Vec<Place>,
    /// The place of that point on the board, mm. Give one for each --ref, in the same order.
    #[arg(long, value_name = "X,Y", required = true, allow_hyphen_values = true, value_parser = place)]
    measured: Vec<Place>,
    /// Scale the job as well, by the factor that fits the points best. Without this option the job
    /// is only turned and shifted.
    #[arg(long)]
    scale: bool,
}

/// A scale that differs from 1 by more than this is more likely a mistake than a property of the
/// board.
const ODD_SCALE: f64 = 0.02;

/// Reads a point such as `12.5,-3`.
fn place(text: &str) -> Result<Place, String> {
    let parts = text
        .split_once(',')
        .ok_or("expected X,Y in mm, such as 12.5,3")?;
    let mm = |part: &str| part.trim().parse::<Mm>().map(Mm::to_f64);
    Ok([mm(parts.0)?, mm(parts.1)?])
}

/// Turns and shifts a job; returns whether it could.
///
/// # Errors
/// If an option or the file cannot be used.
pub(super) fn align(args: &AlignArgs) -> Result<bool, Unusable> {
    if args.nominal.len() != args.measured.len() {
        return Err(unusable(format!(
            "{} --ref and {} --measured: each point needs both",
            args.nominal.len(),
            args.measured.len()
        )));
    }
    let pairs = args.nominal.iter().zip(&args.measured);
    let pairs: Vec<Pair> = pairs
        .map(|(nominal, measured)| Pair {
            nominal: *nominal,
            measured: *measured,
        })
        .collect();
    let fit = Fit::new(&pairs, args.scale).map_err(unusable)?;
    if !args.output.quiet {
        report(&fit, args.scale);
    }
    if fit.is_mirrored {
        return Err(unusable(
            "the points fit a mirrored board: import the job with --mirror, or exchange two --measured",
        ));
    }
    let text = read(&args.file)?;
    let Some(job) = shown(&args.file, &text, job(&text, &fit)) else {
        return Ok(false);
    };
    write(&job, &args.output.output, &[&args.file], &args.output)?;
    Ok(true)
}

fn report(fit: &Fit, applies_scale: bool) {
    let [x, y] = fit.shift();
    let applied = if applies_scale {
        "applied"
    } else {
        "not applied"
    };
    aside(format!(
        "turned {:.4} degrees, X0 Y0 to X{x:.4} Y{y:.4}",
        fit.angle.to_degrees()
    ));
    aside(format!("scale {:.6}, {applied}", fit.scale));
    let misses = fit.misses.iter().map(|miss| format!("{miss:.4}"));
    aside(format!(
        "points missed by {} mm",
        misses.collect::<Vec<_>>().join(", ")
    ));
    if (fit.scale - 1.0).abs() > ODD_SCALE {
        aside("warning: such a scale is more likely a wrong point than a board");
    }
}
