//! `leadscrew check`: finds every error of a file in one go, soft limits included, and likely
//! mistakes; nothing moves.

use super::args::CheckArgs;
use super::causes::Causes;
use super::input;
use super::report::json_text;
use super::run::full_power;
use super::said::{aside, say};
use super::setting_args::{machine, say_capped};
use super::{all_done, unusable, Unusable};
use crate::picture::{draw, Caption};
use leadscrew_files::{is_stdout, spare, Output, OutputError};
use leadscrew_jobs::{follow, read_through, title, CheckReport, Complaint, Machine};
use leadscrew_planner::Coordinate;
use leadscrew_sim::scene::Toolpath;
use std::path::Path;

/// Checks the jobs; returns whether none has an error.
///
/// # Errors
/// Where an option or an input cannot be used.
pub(super) fn check(args: &CheckArgs) -> Result<bool, Unusable> {
    let machine = machine(&args.machine)?;
    if !args.quiet {
        say_capped(&machine);
    }
    let jobs = input::jobs(&args.files).map_err(unusable)?;
    let is_one = jobs.len() == 1 && args.files.len() == 1 && !args.files[0].is_dir();
    if args.svg.is_some() && !is_one {
        return Err(unusable("--svg draws one job: name one file"));
    }
    if (args.json || args.github) && args.svg.as_deref().is_some_and(is_stdout) {
        return Err(unusable(
            "standard output takes one of --json, --github, --svg -",
        ));
    }
    let (mut reports, mut undone) = (Vec::new(), Vec::new());
    let mut clean = true;
    for job in &jobs {
        let report = match check_one(args, job, &machine) {
            Ok(report) => report,
            Err(message) => {
                undone.push(message);
                continue;
            }
        };
        clean &= report.error_count == 0;
        match args.json {
            true => reports.push(report),
            false => tell(args, &report)?,
        }
    }
    if args.json && !reports.is_empty() {
        let all: Vec<_> = reports.iter().map(CheckReport::json).collect();
        say(json_text(&all, is_one))?;
    }
    all_done(&undone)?;
    Ok(clean)
}

fn check_one(args: &CheckArgs, file: &Path, machine: &Machine) -> Result<CheckReport, Unusable> {
    spare(&args.machine.inputs(file), args.svg.as_deref().into_iter()).map_err(unusable)?;
    let svg = args.svg.as_deref().map(Output::create).transpose();
    let svg = svg.map_err(unusable)?;
    let job = input::open(file).map_err(unusable)?;
    let mut checker = follow(&job.name, machine);
    if let Some(origin) = args.origin {
        // The arguments have no other numbers.
        checker.begin_at(origin.map(|mm| Coordinate::from_mm(mm).unwrap_or_default()));
    }
    if svg.is_some() {
        checker.draw();
    }
    let (mut causes, mut shown) = (Causes::default(), Ok(()));
    let unreadable = |error| unusable(format!("{}: cannot be read: {error}", job.name));
    let report = read_through(&mut *checker, &job.name, job.text, |complaint| {
        if shown.is_ok() {
            shown = show(args, &mut causes, complaint);
        }
    })
    .map_err(unreadable)?;
    shown?;
    for rest in causes.rest(&job.name) {
        aside(rest);
    }
    if let Some(output) = svg {
        draw_picture(output, machine, checker.path(), &report).map_err(unusable)?;
    }
    Ok(report)
}

fn draw_picture(
    output: Output,
    machine: &Machine,
    path: &Toolpath,
    report: &CheckReport,
) -> Result<(), OutputError> {
    let caption = Caption {
        title: title(&report.file),
        summary: report.caption(),
        full_power_s: full_power(machine),
    };
    let written = svg::write(output.pen(), &draw(path, &[], &caption));
    output.complete(written)
}

/// Shows a complaint: for GitHub every one as an annotation, else the first of each cause.
///
/// # Errors
/// Where standard output cannot be written.
fn show(args: &CheckArgs, causes: &mut Causes, complaint: &Complaint) -> Result<(), Unusable> {
    let is_first = causes.note(complaint);
    if args.github {
        return say(complaint.annotation());
    }
    if is_first && !(args.quiet && complaint.fault.is_remark()) {
        aside(complaint);
    }
    Ok(())
}

fn tell(args: &CheckArgs, report: &CheckReport) -> Result<(), Unusable> {
    if args.quiet {
        Ok(())
    } else if args.svg.as_deref().is_some_and(is_stdout) {
        aside(report);
        Ok(())
    } else {
        say(report)
    }
}
