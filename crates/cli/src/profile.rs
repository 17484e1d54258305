//! `leadscrew profile`: shows where the time of a job goes, and which settings would make it
//! faster.

use super::args::ProfileArgs;
use super::course::{Course, Text};
use super::said::{aside, say};
use super::setting_args::machine;
use super::trials::trials;
use super::{unusable, Unusable};
use crate::picture::draw_limits;
use leadscrew_files::{is_stdout, spare, Output};
use leadscrew_jobs::{limits_of, title, without_lead, ProfileReport};
use leadscrew_sim::link::Rate;
use leadscrew_sim::speed_profile::{write_csv, Recorder};
use std::path::{Path, PathBuf};

/// Profiles the job; returns whether it met neither an error nor an alarm.
///
/// # Errors
/// If an option or the input cannot be used, or an output cannot be written.
pub(super) fn profile(args: &ProfileArgs) -> Result<bool, Unusable> {
    let chosen = without_lead(&machine(&args.machine)?);
    spare(&args.machine.inputs(&args.file), named(args)).map_err(unusable)?;
    let text = Text::of(&args.file, &chosen)?;
    if !args.quiet {
        text.notes
            .iter()
            .for_each(|note| aside(format!("note: {note}")));
    }
    let [svg, csv] = outputs(args)?;
    let keeps = svg.is_some() || csv.is_some() || args.line_times;
    let course = Course {
        rate: args.baud.map_or(Rate::NeverWaits, Rate::Baud),
        keep_going: args.keep_going,
        quiet: args.quiet,
        keep_answers: keeps,
        only_times: false,
    };
    let limits = limits_of(&chosen);
    let recorder = match keeps {
        true => Recorder::new(limits),
        false => Recorder::summing(limits),
    };
    let done = course.run(&text, &chosen, 100, recorder)?;
    let mut report = ProfileReport::new(&text.name, chosen.file.letters(), done, keeps);
    report.notes.clone_from(&text.notes);
    if let Some(csv) = csv {
        let written = write_csv(csv.pen(), report.begin, &report.stretches, &report.letters);
        csv.complete(written).map_err(unusable)?;
    }
    if let Some(svg) = svg {
        let picture = draw_limits(&report.stretches, &title(&text.name), &report.caption());
        let written = svg::write(svg.pen(), &picture);
        svg.complete(written).map_err(unusable)?;
    }
    if report.is_clean() && !args.no_trials {
        report.trials = trials(&course, &text, &chosen, report.job_cycles, &report.shares);
    }
    if args.json {
        say(report.json(args.line_times))?;
    } else if !args.quiet && named(args).any(is_stdout) {
        aside(&report);
    } else if !args.quiet {
        say(&report)?;
    }
    Ok(report.is_clean())
}

/// The paths of all outputs in `args`.
fn named(args: &ProfileArgs) -> impl Iterator<Item = &Path> {
    [&args.svg, &args.csv]
        .into_iter()
        .flatten()
        .map(PathBuf::as_path)
}

/// The outputs that the user asked for: picture and stretches.
fn outputs(args: &ProfileArgs) -> Result<[Option<Output>; 2], Unusable> {
    if named(args).filter(|path| is_stdout(path)).count() + usize::from(args.json) > 1 {
        return Err(unusable(
            "standard output takes one of --json, --svg -, --csv -",
        ));
    }
    let create = |path: &Option<PathBuf>| path.as_deref().map(Output::create).transpose();
    let svg = create(&args.svg).map_err(unusable)?;
    let csv = create(&args.csv).map_err(unusable)?;
    Ok([svg, csv])
}
