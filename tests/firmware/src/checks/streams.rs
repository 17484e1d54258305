//! Jobs that are streamed while they run, with a status query ten times a second.
use super::Figures;
use crate::{
    bench::{Bench, Failure},
    compare, desk,
    firmware::{Build, Firmware},
    job::Job,
    pins::LINE,
    steps::{jitter, Step},
    stream::Stream,
};
use leadscrew_sim::Rate;
use std::num::NonZeroU32;

/// Time between two status queries, s.
const POLL_SECONDS: f64 = 0.1;
/// How far the time of a job may be off where its line is not faster than motion: 1 %.
const TOLERANCE: f64 = 0.01;
/// Motion begins when nothing has come for so long, or the queue is full: from then on a fast line keeps it full.
const FULL_FIRST: &str = "$701=500\n";

/// Streams a job; its steps.
fn run_streamed(build: &Build, job: &Job) -> Result<Vec<Step>, Failure> {
    let mut bench = Bench::boot(build)?;
    bench.ignore_power();
    bench.commands(&job.settings)?;
    bench.pins.clear();
    bench.stream(&Stream::new(&job.program).polling(POLL_SECONDS))?;
    let lost = bench.machine.uart_overruns(LINE);
    crate::bench::ensure(lost == 0, || format!("{lost} bytes lost"))?;
    Ok(std::mem::take(&mut bench.pins.steps))
}

/// Streams jobs and holds each against the simulator's; `hold` says what must agree, and what it found.
fn compare_all(
    build: &Build,
    jobs: impl IntoIterator<Item = Result<Job, Failure>>,
    hold: fn(&[Step], &Job, &Build) -> Result<String, Failure>,
) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    for job in jobs {
        let job = job?;
        let found = run_streamed(build, &job).and_then(|steps| {
            let found = hold(&steps, &job, build)?;
            Ok(format!("{found}, jitter {} cycles", jitter(&steps)))
        });
        figures.add(
            &job.name,
            found.map_err(|failure| Failure(format!("{}: {failure}", job.name)))?,
        );
    }
    Ok(figures)
}

fn exact(steps: &[Step], job: &Job, _: &Build) -> Result<String, Failure> {
    let planned = desk::plan(&job.settings, &job.program, Rate::NeverWaits)?;
    compare::to_the_tick(steps, &planned)?;
    Ok(format!("{} step events, to the tick", steps.len()))
}

fn same_path(steps: &[Step], job: &Job, build: &Build) -> Result<String, Failure> {
    let line = NonZeroU32::new(build.baud).map_or(Rate::NeverWaits, Rate::Baud);
    let planned = desk::plan(&job.settings, &job.program, line)?;
    let ratio = compare::in_path(steps, &planned, TOLERANCE)?;
    let words = if compare::to_the_tick(steps, &planned).is_ok() {
        "to the tick".into()
    } else {
        format!("{:+.3} % of the time", 100.0 * (ratio - 1.0))
    };
    Ok(format!("{} step events, {words}", steps.len()))
}

/// A job that starts with a full queue.
fn full_first(job: Job) -> Job {
    Job {
        settings: format!("{}{FULL_FIRST}", job.settings),
        ..job
    }
}

pub(crate) fn full_queue(firmware: &Firmware) -> Result<Figures, Failure> {
    let jobs =
        ["spiral.nc", "pocket.nc", "raster.nc"].map(|name| Job::example(name).map(full_first));
    compare_all(&firmware.fast, jobs, exact)
}

pub(crate) fn short(firmware: &Firmware) -> Result<Figures, Failure> {
    let names = ["corner_090", "spiral", "inch_square", "laser_raster_m4"];
    compare_all(&firmware.usual, names.map(Job::trace), same_path)
}

pub(crate) fn examples(firmware: &Firmware) -> Result<Figures, Failure> {
    let names = [
        "drill_dip14.nc",
        "drill_holes.nc",
        "heart.nc",
        "heart_as_printed.nc",
        "pocket.nc",
        "print_square.nc",
        "print_testbar.nc",
        "raster.nc",
        "spiral.nc",
    ];
    compare_all(&firmware.usual, names.map(Job::example), same_path)
}

pub(crate) fn fast_examples(firmware: &Firmware) -> Result<Figures, Failure> {
    let names = ["heart.nc", "pocket.nc", "raster.nc", "spiral.nc"];
    compare_all(&firmware.fast, names.map(Job::example), same_path)
}

pub(crate) fn traces(firmware: &Firmware) -> Result<Figures, Failure> {
    compare_all(
        &firmware.usual,
        Job::traces()?.into_iter().map(Ok),
        same_path,
    )
}
