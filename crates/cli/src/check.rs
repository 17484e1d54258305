//! `leadscrew check`: finds every error of a file in one go, soft limits included, and likely
//! mistakes; nothing moves.

use super::args::CheckArgs;
use super::causes::Causes;
use super::cores::in_order;
use super::import::direct;
use super::input;
use super::report::json_text;
use super::run::{full_power, known_travel};
use super::said::{aside, say};
use super::setting_args::{machine, say_capped};
use super::{all_done, unusable, Unusable};
use crate::picture::{draw, Caption};
use leadscrew_files::{is_stdout, spare, Output, OutputError};
use leadscrew_jobs::{follow, read_through, time, title, work, CheckReport, Complaint, Machine};
use leadscrew_planner::Coordinate;
use leadscrew_sim::link::Rate;
use leadscrew_sim::scene::Toolpath;
use std::io;
use std::path::{Path, PathBuf};

/// Checks the jobs; returns whether none has an error.
///
/// # Errors
/// If an option or an input cannot be used.
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
    let mut take = |checked: Checked| {
        checked.told.show()?;
        match checked.report {
            Ok(report) => {
                clean &= report.error_count == 0;
                match args.json {
                    true => reports.push(report),
                    false => tell(args, &report)?,
                }
            }
            Err(message) => undone.push(unusable(message)),
        }
        Ok(())
    };
    match jobs.as_slice() {
        [job] => take(check_one(args, job, &machine, Told::AtOnce))?,
        jobs => {
            let work = |job: &PathBuf| check_one(args, job, &machine, Told::Later(Vec::new()));
            in_order(jobs, work, take)?;
        }
    }
    if args.json && !reports.is_empty() {
        let all: Vec<_> = reports.iter().map(CheckReport::json).collect();
        say(json_text(&all, is_one))?;
    }
    all_done(&undone)?;
    Ok(clean)
}

/// The result of a job, and what was said about it.
struct Checked {
    report: Result<CheckReport, String>,
    told: Told,
}

/// The words about a job while it is checked: whether they are said at once or kept.
enum Told {
    /// It is said at once.
    AtOnce,
    /// It is kept until the jobs before it are done: texts, each for standard output or not.
    Later(Vec<(bool, String)>),
}

impl Told {
    fn tell(&mut self, is_output: bool, text: String) -> Result<(), Unusable> {
        match self {
            Self::AtOnce => put_out(is_output, &text),
            Self::Later(texts) => {
                texts.push((is_output, text));
                Ok(())
            }
        }
    }

    /// Says what was kept.
    fn show(&self) -> Result<(), Unusable> {
        match self {
            Self::AtOnce => Ok(()),
            Self::Later(texts) => texts
                .iter()
                .try_for_each(|(is_output, text)| put_out(*is_output, text)),
        }
    }
}

fn put_out(is_output: bool, text: &str) -> Result<(), Unusable> {
    if is_output {
        return say(text);
    }
    aside(text);
    Ok(())
}

fn check_one(args: &CheckArgs, file: &Path, machine: &Machine, mut told: Told) -> Checked {
    let report = look_at(args, file, machine, &mut told);
    Checked {
        report: report.map_err(|error| error.to_string()),
        told,
    }
}

fn look_at(
    args: &CheckArgs,
    file: &Path,
    machine: &Machine,
    told: &mut Told,
) -> Result<CheckReport, Unusable> {
    spare(&args.machine.inputs(file), args.svg.as_deref().into_iter()).map_err(unusable)?;
    let svg = args.svg.as_deref().map(Output::create).transpose();
    let svg = svg.map_err(unusable)?;
    let job = input::open(file).map_err(unusable)?;
    let (mut job, notes) = direct(job, machine)?;
    for note in notes.iter().filter(|_| !args.quiet) {
        told.tell(false, format!("note: {note}"))?;
    }
    let text = args.time.then(|| job.keep()).transpose();
    let text = text.map_err(unusable)?;
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
    let mut report = read_through(&mut *checker, &job.name, job.text, |complaint| {
        if shown.is_ok() {
            shown = show(args, &mut causes, complaint, told);
        }
    })
    .map_err(unreadable)?;
    shown?;
    report.notes = notes;
    for rest in causes.rest(&job.name) {
        told.tell(false, rest)?;
    }
    if let Some(text) = text.filter(|_| report.error_count == 0) {
        add_times(args, machine, &text, &mut report).map_err(unreadable)?;
    }
    if let Some(output) = svg {
        draw_picture(output, machine, checker.path(), &report).map_err(unusable)?;
    }
    Ok(report)
}

/// Adds how long a job takes to its report.
fn add_times(
    args: &CheckArgs,
    machine: &Machine,
    text: &[u8],
    report: &mut CheckReport,
) -> io::Result<()> {
    report.time = Some(time(machine, Rate::NeverWaits, &report.file, text)?);
    let grbl = args
        .like
        .map(|like| like.time(machine, None, &report.file, text));
    report.grbl = grbl.transpose()?;
    Ok(())
}

fn draw_picture(
    output: Output,
    machine: &Machine,
    path: &Toolpath,
    report: &CheckReport,
) -> Result<(), OutputError> {
    let caption = Caption {
        title: title(&report.file),
        summary: report.caption(work(&machine.file)),
        work: work(&machine.file),
        full_power_s: full_power(machine),
        travel: known_travel(machine, path),
    };
    let written = svg::write(output.pen(), &draw(path, &[], &caption));
    output.complete(written)
}

/// Shows a complaint: for GitHub every one as an annotation, else the first of each cause.
///
/// # Errors
/// If standard output cannot be written.
fn show(
    args: &CheckArgs,
    causes: &mut Causes,
    complaint: &Complaint,
    told: &mut Told,
) -> Result<(), Unusable> {
    let is_first = causes.note(complaint);
    if args.github {
        return told.tell(true, complaint.annotation());
    }
    if is_first && !(args.quiet && complaint.fault.is_remark()) {
        told.tell(false, complaint.to_string())?;
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
