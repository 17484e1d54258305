//! `leadscrew run`: streams a file through the machine's own serial protocol and tells what came of it.

use super::args::JobArgs;
use super::input::{self, Job};
use super::report::{title, OtherRule, Report};
use super::said::say;
use super::setting_args::{as_defaults, say_capped, settings, AXES};
use super::stream::Stream;
use super::watchers::{OutputError, Sketch, StepList, WaveformFile};
use super::{unusable, Unusable};
use crate::link::Rate;
use crate::output::picture::{draw, Caption};
use leadscrew_gcode::Number;
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::outputs::spindle::SpindleScale;
use leadscrew_machine::settings::table::{AxisSetting, Setting};
use leadscrew_machine::settings::values::{Entry, Settings};
use std::time::Instant;

/// Runs the job; answers whether it met neither an error nor an alarm.
///
/// # Errors
/// Where an option or the input cannot be used, or an output not be written.
pub(super) fn run(args: &JobArgs) -> Result<bool, Unusable> {
    let begin = Instant::now();
    let mut config = MachineConfig::<AXES>::new();
    let settings = settings(&args.machine, &config)?;
    config.defaults = as_defaults(&settings);
    if !args.quiet {
        say_capped(&settings, &config.step_timing);
    }
    let job = input::open(&args.file).map_err(unusable)?;
    let outputs = Outputs::create(args, &settings).map_err(unusable)?;
    let mut report = simulate(args, &config, &settings, job, outputs)?;
    if report.is_clean() && !args.json && !args.quiet {
        report.other_rule = other_rule(args, &config, &settings);
    }
    report.wall_seconds = begin.elapsed().as_secs_f64();
    tell(args, &report)?;
    Ok(report.is_clean())
}

/// How long motion takes by the other corner rule; `None` where the job cannot be read once more. Nothing is told of it.
fn other_rule(
    args: &JobArgs,
    config: &MachineConfig<AXES>,
    settings: &Settings<AXES>,
) -> Option<OtherRule> {
    let is_grbl = !settings.is_on(Setting::GrblCorners);
    let mut other = settings.clone();
    let loaded = other.load(Entry {
        number: Setting::GrblCorners.row().number,
        value: Number::from_int(is_grbl.into()),
    });
    let is_file = std::fs::metadata(&args.file).is_ok_and(|file| file.is_file());
    let job = input::open(&args.file).ok().filter(|_| is_file && loaded)?;
    let stream = Stream {
        config: MachineConfig {
            defaults: as_defaults(&other),
            ..*config
        },
        settings: &other,
        rate: args.baud.map_or(Rate::NeverWaits, Rate::Baud),
        keep_going: args.keep_going,
        quiet: true,
        feed_percent: 100,
    };
    let done = stream.run(job, ()).ok()?;
    Some(OtherRule {
        is_grbl,
        motion_seconds: done.outcome.motion_seconds,
    })
}

/// All that watches a run.
struct Outputs {
    steps: Option<StepList>,
    vcd: Option<WaveformFile>,
    sketch: Sketch,
}

impl Outputs {
    fn create(args: &JobArgs, settings: &Settings<AXES>) -> Result<Self, OutputError> {
        let scale = SpindleScale {
            max: settings.value(Setting::MaxSpeed).to_f32(),
            min: settings.value(Setting::MinSpeed).to_f32(),
        };
        let steps = args
            .steps
            .as_deref()
            .map(|path| StepList::create(path, scale))
            .transpose()?;
        let vcd = args
            .vcd
            .as_deref()
            .map(|path| WaveformFile::create(path, AXES))
            .transpose()?;
        if let Some(path) = &args.svg {
            OutputError::probe(path)?;
        }
        let mm_per_step = steps_per_mm(settings).map(f64::recip).to_vec();
        Ok(Self {
            steps,
            vcd,
            sketch: Sketch::new(mm_per_step, args.svg.is_some()),
        })
    }
}

fn steps_per_mm(settings: &Settings<AXES>) -> [f64; AXES] {
    settings
        .axes(AxisSetting::StepsPerMm)
        .map(|steps| steps.nanos() as f64 / 1e9)
}

fn simulate(
    args: &JobArgs,
    config: &MachineConfig<AXES>,
    settings: &Settings<AXES>,
    job: Job,
    outputs: Outputs,
) -> Result<Report<AXES>, Unusable> {
    let file = job.name.clone();
    let stream = Stream {
        config: *config,
        settings,
        rate: args.baud.map_or(Rate::NeverWaits, Rate::Baud),
        keep_going: args.keep_going,
        quiet: args.quiet,
        feed_percent: 100,
    };
    let observer = ((outputs.steps, outputs.vcd), outputs.sketch);
    let done = stream.run(job, observer)?;
    let ((steps, vcd), sketch) = done.observer;
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
        outcome: done.outcome,
        steps_per_mm: steps_per_mm(settings),
        cut_mm: sketch.path.cut_mm(),
        travel_mm: sketch.path.travel_mm(),
        baud: args.baud,
        other_rule: None,
        wall_seconds: 0.0,
    };
    draw_picture(args, settings, &sketch, &report).map_err(unusable)?;
    Ok(report)
}

fn draw_picture(
    args: &JobArgs,
    settings: &Settings<AXES>,
    sketch: &Sketch,
    report: &Report<AXES>,
) -> Result<(), OutputError> {
    let (Some(path), Some(speed)) = (&args.svg, &sketch.speed) else {
        return Ok(());
    };
    let caption = Caption {
        title: title(&report.file),
        summary: report.caption(),
        full_power_s: f64::from(settings.value(Setting::MaxSpeed).to_f32()),
    };
    OutputError::in_file(path, svg::save(path, &draw(&sketch.path, speed, &caption)))
}

fn tell(args: &JobArgs, report: &Report<AXES>) -> Result<(), Unusable> {
    if args.json {
        say(report.json())
    } else if !args.quiet {
        say(report)
    } else {
        Ok(())
    }
}
