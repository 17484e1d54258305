//! `leadscrew import drill`.

use super::super::said::aside;
use super::super::setting_args::{machine, SettingArgs};
use super::super::{unusable, Unusable};
use super::output::{read, shown, write};
use super::OutputArgs;
use clap::{Args, ValueEnum};
use leadscrew_files::is_stdout;
use leadscrew_import::drill::{jobs, DrillJob, Mirror, Options};
use leadscrew_import::excellon::{self, Digits, Known, Units, Zeros};
use leadscrew_import::Mm;
use leadscrew_jobs::{board_options, board_speeds};
use leadscrew_sim::profile::DrillTable;
use std::path::{Path, PathBuf};

/// Options of `import drill`. Lengths are mm, feeds mm/min.
#[derive(Args, Debug)]
pub(in super::super) struct DrillArgs {
    /// Excellon files of one board; `-` reads standard input.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    output: OutputArgs,
    /// Z of a hole's bottom, such as -1.8; needed if `[drill]` of the machine file has none.
    #[arg(long, value_name = "Z", allow_hyphen_values = true)]
    depth: Option<Mm>,
    /// Z between holes; 2 unless `[drill]` of the machine file has another one.
    #[arg(long, value_name = "Z", allow_hyphen_values = true)]
    clearance: Option<Mm>,
    /// How fast bits go down; needed if `[drill]` of the machine file has none.
    #[arg(long, value_name = "MM/MIN")]
    feed: Option<Mm>,
    /// How fast slots and routes are milled; without it as `[drill]` of the machine file says, or
    /// else as fast as --feed.
    #[arg(long, value_name = "MM/MIN")]
    mill_feed: Option<Mm>,
    /// The deepest that is drilled or milled in one go.
    #[arg(long, value_name = "MM")]
    peck: Option<Mm>,
    /// Take feeds (F) and speeds (S) of tools from the files if they have them.
    #[arg(long)]
    tool_feeds: bool,
    /// How fast the spindle turns, 0 if it is switched by hand; without it as fast as $30 allows.
    #[arg(long, value_name = "RPM")]
    spindle: Option<u32>,
    /// Drill the board from its other side: coordinates of this axis change their sign.
    #[arg(long, value_name = "AXIS")]
    mirror: Option<MirrorArg>,
    /// Where X0 Y0 is: the file's zero, or the lower left corner of the holes.
    #[arg(long, value_name = "WHERE", default_value = "file")]
    origin: OriginArg,
    /// Diameters of the bits that there are; each tool becomes the nearest.
    #[arg(long, value_name = "MM,MM", value_delimiter = ',')]
    bits: Vec<Mm>,
    /// How slots (G85) are made: drilled as a row of holes, or milled.
    #[arg(long, value_name = "HOW", default_value = "drill")]
    slots: SlotsArg,
    /// One job with M6 between tools, or a file for each tool.
    #[arg(long, value_name = "HOW", default_value = "m6")]
    tools: ToolsArg,
    /// Write canned cycles, G81 and with --peck G83, for machines that know them.
    #[arg(long)]
    cycles: bool,
    /// The unit of the files, if they do not say.
    #[arg(long, value_name = "UNIT")]
    units: Option<UnitsArg>,
    /// How many digits are in front of and behind the point in numbers that are written without it,
    /// such as 2.4, if the files do not say.
    #[arg(long, value_name = "DIGITS")]
    format: Option<Digits>,
    /// The zeros that numbers keep, if the files do not say: lz leading, tz trailing.
    #[arg(long, value_name = "WHICH")]
    zeros: Option<ZerosArg>,
    #[command(flatten)]
    machine: SettingArgs,
}

#[derive(Clone, Copy, ValueEnum, Debug)]
enum MirrorArg {
    X,
    Y,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum, Debug)]
enum OriginArg {
    File,
    Corner,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum, Debug)]
enum SlotsArg {
    Drill,
    Mill,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum, Debug)]
enum ToolsArg {
    M6,
    Files,
}

#[derive(Clone, Copy, ValueEnum, Debug)]
enum UnitsArg {
    Inch,
    Mm,
}

#[derive(Clone, Copy, ValueEnum, Debug)]
enum ZerosArg {
    Lz,
    Tz,
}

/// Makes the job of a board; returns whether all files were understood.
///
/// # Errors
/// If an option or a file cannot be used.
pub(super) fn run(args: &DrillArgs) -> Result<bool, Unusable> {
    let machine = machine(&args.machine)?;
    let options = options(args, &machine.file.drill)?;
    let mut drawings = Vec::new();
    for name in &args.files {
        let text = read(name)?;
        drawings.extend(shown(name, &text, excellon::read(&text, &known(args))));
    }
    if drawings.len() < args.files.len() {
        return Ok(false);
    }
    if !args.output.quiet {
        for (name, drawing) in args.files.iter().zip(&drawings) {
            let notes = drawing.notes.iter();
            notes.for_each(|note| aside(format!("note: {}: {note}", leadscrew_files::shown(name))));
        }
    }
    let jobs = jobs(&drawings, &options, &board_speeds(&machine)).map_err(unusable)?;
    let path = &args.output.output;
    if args.tools == ToolsArg::Files && is_stdout(path) {
        return Err(unusable("--tools files needs -o JOB.nc"));
    }
    let inputs: Vec<&Path> = args.files.iter().map(PathBuf::as_path).collect();
    for DrillJob { bit, job } in jobs {
        let path = bit.map_or_else(|| path.clone(), |bit| named(path, bit));
        write(&job, &path, &inputs, &args.output)?;
    }
    Ok(true)
}

/// The name of the file for one bit: `JOB.nc` becomes `JOB-T2.nc` for bit 2.
fn named(path: &Path, bit: u32) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let end = path
        .extension()
        .map(|end| format!(".{}", end.to_string_lossy()));
    path.with_file_name(format!("{stem}-T{bit}{}", end.unwrap_or_default()))
}

fn known(args: &DrillArgs) -> Known {
    Known {
        units: args.units.map(|units| match units {
            UnitsArg::Inch => Units::Inch,
            UnitsArg::Mm => Units::Mm,
        }),
        digits: args.format,
        zeros: args.zeros.map(|zeros| match zeros {
            ZerosArg::Lz => Zeros::Leading,
            ZerosArg::Tz => Zeros::Trailing,
        }),
    }
}

/// The options. The machine file gives the values that the command line leaves out.
///
/// # Errors
/// Neither the command line nor the machine file gives a depth or a feed.
fn options(args: &DrillArgs, file: &DrillTable) -> Result<Options, Unusable> {
    let by_file = board_options(file, args.depth, args.feed).map_err(unusable)?;
    Ok(Options {
        clearance: args.clearance.unwrap_or(by_file.clearance),
        mill_feed: args.mill_feed.or(by_file.mill_feed),
        peck: args.peck.or(by_file.peck),
        tool_feeds: args.tool_feeds,
        spindle: args.spindle,
        mirror: args.mirror.map(|axis| match axis {
            MirrorArg::X => Mirror::X,
            MirrorArg::Y => Mirror::Y,
        }),
        from_corner: args.origin == OriginArg::Corner,
        bits: args.bits.clone(),
        mills_slots: args.slots == SlotsArg::Mill,
        job_a_bit: args.tools == ToolsArg::Files,
        cycles: args.cycles,
        ..by_file
    })
}
