//! `leadscrew import rp`, `rows` and `print`.

use super::super::Unusable;
use super::output::{read, shown, write};
use super::OutputArgs;
use clap::{value_parser, Args};
use leadscrew_import::{print, rows, rp, Faults, Job, Mm};
use std::path::{Path, PathBuf};

/// Options of `import rp`.
#[derive(Args, Debug)]
pub(in super::super) struct RpArgs {
    /// The file of RP code; `-` reads standard input.
    file: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
    /// Feed of X and Y, mm/min.
    #[arg(long, value_name = "MM/MIN", default_value = "1005", value_parser = above_zero)]
    feed: Mm,
    /// Feed of Z, mm/min.
    #[arg(long, value_name = "MM/MIN", default_value = "192", value_parser = above_zero)]
    lift: Mm,
    /// The line that switches the extruder on.
    #[arg(long, value_name = "LINE", default_value = "M3 S1000")]
    on: String,
    /// The line that switches the extruder off.
    #[arg(long, value_name = "LINE", default_value = "M5")]
    off: String,
    /// Rows are distances from the point before, not positions.
    #[arg(long)]
    incremental: bool,
    /// Heat the nozzle to this temperature, and wait for it (M104, M109).
    #[arg(long, value_name = "CELSIUS", value_parser = value_parser!(u16).range(1..=500))]
    nozzle: Option<u16>,
    /// Heat the bed to this temperature, and wait for it (M140, M190).
    #[arg(long, value_name = "CELSIUS", value_parser = value_parser!(u16).range(1..=300))]
    bed: Option<u16>,
}

/// Options of `import rows`.
#[derive(Args, Debug)]
pub(in super::super) struct RowsArgs {
    /// The file of rows; `-` reads standard input.
    file: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
    /// Length of the rows' unit, mm.
    #[arg(long, value_name = "MM", default_value = "1", value_parser = above_zero)]
    scale: Mm,
    /// Feed along the rows, mm/min.
    #[arg(long, value_name = "MM/MIN", default_value = "600", value_parser = above_zero)]
    feed: Mm,
    /// Feed down, mm/min.
    #[arg(long, value_name = "MM/MIN", default_value = "200", value_parser = above_zero)]
    plunge: Mm,
    /// How far the tool is lifted between cuts, mm.
    #[arg(long, value_name = "MM", default_value = "2", value_parser = above_zero)]
    lift: Mm,
    /// Speed of the spindle; 0 for a spindle that is switched by hand.
    #[arg(long, value_name = "RPM", default_value = "1000")]
    spindle: u32,
    /// Move the tool down and up between two switches (M3, M5), in place of Z.
    #[arg(long)]
    switches: bool,
}

/// Options of `import print`.
#[derive(Args, Debug)]
pub(in super::super) struct PrintArgs {
    /// The printer's file; `-` reads standard input.
    file: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
    /// The tool's place after homing, in the file's coordinates; G92 sets them after each $H.
    #[arg(long, value_name = "X,Y,Z", value_parser = home, allow_hyphen_values = true)]
    home: Option<[Mm; 3]>,
}

/// Reads a length or a feed above zero.
fn above_zero(text: &str) -> Result<Mm, String> {
    match text.parse()? {
        mm if mm > Mm::ZERO => Ok(mm),
        _ => Err("expected a number above 0".to_owned()),
    }
}

/// Reads three coordinates.
fn home(text: &str) -> Result<[Mm; 3], String> {
    let places: Result<Vec<Mm>, String> = text.split(',').map(str::parse).collect();
    let three = <[Mm; 3]>::try_from(places?);
    three.map_err(|_| "expected three lengths, such as 2,2,2".to_owned())
}

/// Imports RP code.
pub(super) fn rp(args: &RpArgs) -> Result<bool, Unusable> {
    let options = rp_options(args);
    convert(&args.file, &args.output, |text| rp::job(text, &options))
}

fn rp_options(args: &RpArgs) -> rp::Options {
    rp::Options {
        feed: args.feed,
        lift: args.lift,
        on: args.on.clone(),
        off: args.off.clone(),
        is_incremental: args.incremental,
        nozzle: args.nozzle,
        bed: args.bed,
    }
}

/// Imports an engraver's rows.
pub(super) fn rows(args: &RowsArgs) -> Result<bool, Unusable> {
    let options = rows_options(args);
    convert(&args.file, &args.output, |text| rows::job(text, &options))
}

fn rows_options(args: &RowsArgs) -> rows::Options {
    rows::Options {
        scale: args.scale,
        feed: args.feed,
        plunge: args.plunge,
        lift: args.lift,
        spindle: args.spindle,
        has_switches: args.switches,
    }
}

/// Imports a printer's file.
pub(super) fn print(args: &PrintArgs) -> Result<bool, Unusable> {
    let options = print::Options { home: args.home };
    convert(&args.file, &args.output, |text| print::job(text, &options))
}

fn convert(
    name: &Path,
    output: &OutputArgs,
    job: impl Fn(&str) -> Result<Job, Faults>,
) -> Result<bool, Unusable> {
    let text = read(name)?;
    let Some(job) = shown(name, &text, job(&text)) else {
        return Ok(false);
    };
    write(&job, &output.output, &[name], output)?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Defaults<T: Args> {
        #[command(flatten)]
        of: T,
    }

    fn defaults<T: Args>() -> T {
        Defaults::<T>::parse_from(["import", "-"]).of
    }

    #[test]
    fn a_file_that_is_taken_as_it_is_has_the_options_of_the_command() {
        assert_eq!(rp_options(&defaults()), rp::Options::default());
        assert_eq!(rows_options(&defaults()), rows::Options::default());
        assert_eq!(defaults::<PrintArgs>().home, print::Options::default().home);
    }
}
