//! `leadscrew run`: streams a file through the machine's own serial protocol and reports the
//! result.

use super::args::{Controller, JobArgs};
use super::import::direct;
use super::input::{self, Job};
use super::playback;
use super::report::{json_text, Report};
use super::said::{aside, say};
use super::setting_args::{machine, say_capped};
use super::told::{progress_bar, teller};
use super::watchers::{Sketch, StepList, WaveformFile};
use super::{all_done, unusable, Unusable};
use crate::picture::{draw, Caption};
use leadscrew_files::{is_stdout, spare, Output, OutputError};
use leadscrew_jobs::{extents, limits_of, title, work, Machine, Stream, Time};
use leadscrew_machine::settings::table::{AxisSetting, Setting};
use leadscrew_machine::tool::SpindleScale;
use leadscrew_sim::link::Rate;
use leadscrew_sim::oven::{Failure, HeatFault};
use leadscrew_sim::powered::MOST_MOTORS;
use leadscrew_sim::profile::Belts;
use leadscrew_sim::scene::{Toolpath, Way};
use leadscrew_sim::speed_profile::{Recorder, Stretch};
use leadscrew_sim::Outcome;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Runs the jobs one after the other, each on a new machine. Returns whether none met an error or
/// an alarm.
///
/// # Errors
/// If an option or an input cannot be used, or an output cannot be written.
pub(super) fn run(args: &JobArgs) -> Result<bool, Unusable> {
    let mut machine = machine(&args.machine)?;
    machine.outputs.count = args.outputs.unwrap_or(machine.outputs.count);
    machine.heat_fault = args.heat_fault;
    if let Some(missing) = args.heat_fault.and_then(|fault| lacks(&machine, fault)) {
        return Err(unusable(format!(
            "--heat-fault: the machine has no `{missing}`"
        )));
    }
    if !args.quiet {
        say_capped(&machine);
    }
    let jobs = input::jobs(&args.files).map_err(unusable)?;
    let is_one = jobs.len() == 1 && jobs == args.files;
    if !is_one && named(args).next().is_some() {
        return Err(unusable(
            "--svg, --html, --vcd and --steps show one job: name one file",
        ));
    }
    one_for_stdout(args).map_err(unusable)?;
    let (mut reports, mut undone) = (Vec::new(), Vec::new());
    let mut clean = true;
    for file in &jobs {
        let report = match run_one(args, &machine, file) {
            Ok(report) => report,
            Err(message) => {
                undone.push(message);
                continue;
            }
        };
        clean &= report.is_clean();
        match args.json {
            true => reports.push(report),
            false => tell(args, &report)?,
        }
    }
    if args.json && !reports.is_empty() {
        let all: Vec<_> = reports.iter().map(Report::json).collect();
        say(json_text(&all, is_one))?;
    }
    all_done(&undone)?;
    Ok(clean)
}

/// The key in the machine file of the part that `fault` breaks, if the machine lacks this part.
fn lacks(machine: &Machine, fault: HeatFault) -> Option<&'static str> {
    let heaters = &machine.file.heaters;
    match fault.failure {
        Failure::External => (!heaters.fault_input).then_some("heaters.fault_input"),
        Failure::Open | Failure::Shorted | Failure::Frozen | Failure::Stuck => {
            heaters.nozzle.is_none().then_some("heaters.nozzle")
        }
    }
}

fn run_one(args: &JobArgs, machine: &Machine, file: &Path) -> Result<Report, Unusable> {
    let begin = Instant::now();
    spare(&args.machine.inputs(file), named(args)).map_err(unusable)?;
    let job = input::open(file).map_err(unusable)?;
    let (job, notes) = direct(job, machine)?;
    if !args.quiet {
        notes.iter().for_each(|note| aside(format!("note: {note}")));
    }
    let outputs = Outputs::create(args, machine).map_err(unusable)?;
    let mut report = simulate(args, machine, job, outputs)?;
    report.notes = notes;
    report.wall_seconds = begin.elapsed().as_secs_f64();
    Ok(report)
}

/// The observers of a run.
struct Outputs {
    steps: Option<StepList>,
    vcd: Option<WaveformFile>,
    svg: Option<Output>,
    html: Option<Output>,
    sketch: Sketch,
}

/// The paths of all outputs in `args`.
fn named(args: &JobArgs) -> impl Iterator<Item = &Path> {
    let all = [&args.svg, &args.html, &args.vcd, &args.steps];
    all.into_iter().flatten().map(PathBuf::as_path)
}

/// Refuses arguments that would send several outputs to standard output.
fn one_for_stdout(args: &JobArgs) -> Result<(), &'static str> {
    let count = named(args).filter(|path| is_stdout(path)).count() + usize::from(args.json);
    match count {
        0 | 1 => Ok(()),
        _ => Err("standard output takes one of --json, --svg -, --html -, --vcd -, --steps -"),
    }
}

impl Outputs {
    fn create(args: &JobArgs, machine: &Machine) -> Result<Self, OutputError> {
        let scale = SpindleScale {
            max: machine.settings.value(Setting::MaxSpeed).to_f32(),
            min: machine.settings.value(Setting::MinSpeed).to_f32(),
        };
        let steps = args
            .steps
            .as_deref()
            .map(|path| StepList::create(path, scale))
            .transpose()?;
        let vcd = args
            .vcd
            .as_deref()
            .map(|path| {
                WaveformFile::create(path, &machine.file.motor_letters(), machine.outputs.count)
            })
            .transpose()?;
        let svg = args.svg.as_deref().map(Output::create).transpose()?;
        let html = args.html.as_deref().map(Output::create).transpose()?;
        let picture = svg.is_some() || html.is_some();
        let recorder = picture.then(|| Recorder::new(limits_of(machine)));
        Ok(Self {
            steps,
            vcd,
            sketch: Sketch::new(machine.tooling(), recorder, picture),
            svg,
            html,
        })
    }
}

fn steps_per_mm(machine: &Machine) -> Vec<f64> {
    machine.of_axes(AxisSetting::StepsPerMm)
}

fn simulate(
    args: &JobArgs,
    machine: &Machine,
    mut job: Job,
    outputs: Outputs,
) -> Result<Report, Unusable> {
    let grbl = args.like.map(|like| beside(like, args, machine, &mut job));
    let grbl = grbl.transpose()?;
    let file = job.name;
    let stream = stream(args, machine, &outputs);
    let observer = ((outputs.steps, outputs.vcd), outputs.sketch);
    let bar = progress_bar(args.quiet, job.size);
    let text = BufReader::new(bar.wrap_read(job.text));
    let done = stream.run(&file, text, observer);
    bar.finish_and_clear();
    let done = done.map_err(|error| unusable(format!("{file}: cannot be read: {error}")))?;
    let ((steps, vcd), mut sketch) = done.observer;
    sketch
        .path
        .tell_lines(|number| done.counted.line_and_tool(number));
    if let Some(steps) = steps {
        steps.finish().map_err(unusable)?;
    }
    if let Some(vcd) = vcd {
        vcd.finish().map_err(unusable)?;
    }
    let report = Report {
        file,
        lines: done.lines,
        errors: done.errors,
        error_count: done.error_count,
        alarm: done.alarm,
        warnings: done.warnings,
        warning_count: done.warning_count,
        outcome: done.outcome,
        letters: machine.file.letters(),
        turning: machine.file.turning(),
        steps_per_mm: steps_per_mm(machine),
        steps_per_rev: machine.file.steps_per_rev(),
        crossed: machine.file.kinematics == Belts::CoreXy,
        work: work(&machine.file),
        cut_mm: sketch.path.cut_mm(),
        travel_mm: sketch.path.travel_mm(),
        baud: args.baud,
        end: done.end,
        waits: done.waits,
        tools: done.tools,
        outputs: machine.outputs.count,
        extents: sketch.path.cut_bounds().map(extents),
        grbl,
        notes: Vec::new(),
        wall_seconds: 0.0,
    };
    if sketch.path.is_drawn() {
        let caption = caption(machine, &report, &sketch.path);
        let pictures = (outputs.svg, outputs.html);
        write_pictures(sketch, caption, &report.outcome, pictures).map_err(unusable)?;
    }
    Ok(report)
}

/// Returns how the job is streamed.
fn stream<'a>(args: &JobArgs, machine: &'a Machine, outputs: &Outputs) -> Stream<'a> {
    Stream {
        machine,
        rate: args.baud.map_or(Rate::NeverWaits, Rate::Baud),
        keep_going: args.keep_going,
        feed_percent: 100,
        keep_answers: outputs.sketch.path.is_drawn(),
        warn: args.json,
        only_times: false,
        knows_place: true,
        tell: teller(args.quiet),
    }
}

/// The time that the job takes on another controller.
fn beside(
    like: Controller,
    args: &JobArgs,
    machine: &Machine,
    job: &mut Job,
) -> Result<Time, Unusable> {
    let text = job.keep().map_err(unusable)?;
    like.time(machine, args.baud, &job.name, &text)
        .map_err(|error| unusable(format!("{}: cannot be read: {error}", job.name)))
}

/// Writes the picture and the page of a job, if the user asked for them.
fn write_pictures(
    mut sketch: Sketch,
    caption: Caption,
    outcome: &Outcome<MOST_MOTORS>,
    (svg, html): (Option<Output>, Option<Output>),
) -> Result<(), OutputError> {
    let (begin, end) = (outcome.first_byte, outcome.first_byte + outcome.job_cycles);
    let speed = sketch.speed.take();
    let stretches = speed.map(|speed| speed.finish(begin, end, |line| Some(line.into())));
    let drawing = Drawing {
        caption,
        sketch: &sketch,
        stretches: stretches.unwrap_or_default(),
    };
    if let Some(output) = svg {
        drawing.write_svg(output)?;
    }
    if let Some(output) = html {
        playback::write(output, drawing.sketch, &drawing.stretches, &drawing.caption)?;
    }
    Ok(())
}

/// The S value of a laser's full power; `None` if S is a spindle's speed.
pub(super) fn full_power(machine: &Machine) -> Option<f64> {
    let settings = &machine.settings;
    let full = f64::from(settings.value(Setting::MaxSpeed).to_f32());
    settings.is_on(Setting::Laser).then_some(full)
}

fn caption(machine: &Machine, report: &Report, path: &Toolpath) -> Caption {
    Caption {
        title: title(&report.file),
        summary: report.caption(),
        work: work(&machine.file),
        full_power_s: full_power(machine),
        travel: known_travel(machine, path),
    }
}

/// The ends of the travel of X and Y, mm, for a picture of `path`; `None` if the path's place in it
/// is not known: the machine does not home, or it has not in this job.
pub(super) fn known_travel(machine: &Machine, path: &Toolpath) -> Option<[[f32; 2]; 2]> {
    let settings = &machine.settings;
    let jumps = path.moves().iter().skip(1).any(|one| one.way == Way::Jump);
    let is_placed = jumps || path.ends()[0] != [0.0; 2];
    let knows =
        settings.is_on(Setting::Homing) && (settings.is_on(Setting::SoftLimits) || is_placed);
    let bounds = machine.bounds();
    let ends = |axis: usize| [bounds[axis].low.to_mm(), bounds[axis].high.to_mm()];
    knows.then(|| [ends(0), ends(1)])
}

/// The data for pictures of a run.
struct Drawing<'a> {
    caption: Caption,
    sketch: &'a Sketch,
    stretches: Vec<Stretch>,
}

impl Drawing<'_> {
    fn write_svg(&self, output: Output) -> Result<(), OutputError> {
        let picture = draw(&self.sketch.path, &self.stretches, &self.caption);
        let written = svg::write(output.pen(), &picture);
        output.complete(written)
    }
}

fn tell(args: &JobArgs, report: &Report) -> Result<(), Unusable> {
    if args.quiet {
        Ok(())
    } else if named(args).any(is_stdout) {
        aside(report);
        Ok(())
    } else {
        say(report)
    }
}
