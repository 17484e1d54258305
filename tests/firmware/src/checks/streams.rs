//! Jobs that are streamed while they run, with a status query ten times a second.
use super::Figures;
use crate::{
    bench::{ensure, fail, Bench, Failure},
    compare, desk,
    firmware::{Build, Firmware},
    job::Job,
    pins::{CPU_HZ, LINE},
    steps::{jitter, Step},
    stream::Stream,
};
use leadscrew_sim::Rate;
use std::{num::NonZeroU32, ops::Range};

/// Time between two status queries, s.
const POLL_SECONDS: f64 = 0.1;
/// The most by which the time of a job may be off if the line may be slower than motion: 1 %.
const TOLERANCE: f64 = 0.01;
/// Motion begins when no line has come for 0.5 s, or the queue is full. From then on a fast line
/// keeps the queue full.
const FULL_FIRST: &str = "$701=500\n";

/// Streams a job. Returns its steps.
fn run_streamed(build: &Build, job: &Job) -> Result<Vec<Step>, Failure> {
    let mut bench = Bench::boot(build)?;
    bench.ignore_power();
    bench.commands(&job.settings)?;
    bench.pins.clear();
    bench.stream(&Stream::new(&job.program).polling(POLL_SECONDS))?;
    let lost = bench.machine.uart_overruns(LINE);
    ensure(lost == 0, || format!("{lost} bytes lost"))?;
    Ok(std::mem::take(&mut bench.pins.steps))
}

/// Streams jobs and compares each with the simulator's. `hold` checks the values that must agree,
/// and answers its finding.
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
    compare_all(firmware.build("fast")?, jobs, exact)
}

pub(crate) fn short(firmware: &Firmware) -> Result<Figures, Failure> {
    let names = ["corner_090", "spiral", "inch_square", "laser_raster_m4"];
    compare_all(firmware.build("usual")?, names.map(Job::trace), same_path)
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
    compare_all(firmware.build("usual")?, names.map(Job::example), same_path)
}

pub(crate) fn fast_examples(firmware: &Firmware) -> Result<Figures, Failure> {
    let names = ["heart.nc", "pocket.nc", "raster.nc", "spiral.nc"];
    compare_all(firmware.build("fast")?, names.map(Job::example), same_path)
}

pub(crate) fn traces(firmware: &Firmware) -> Result<Figures, Failure> {
    compare_all(
        firmware.build("usual")?,
        Job::traces()?.into_iter().map(Ok),
        same_path,
    )
}

/// The time in which the sender is silent, s: for nine tenths of the reserve (`$710`).
const SILENCE: Range<f64> = 1.0..1.9;
/// The most that the silence may cost, as a share of the job's time; and the least that it must
/// cost with a reserve of 0.1 s, s.
const LONGER: f64 = 1e-3;
const MISSED: f64 = 0.1;

/// Short moves round corners. Blanks make the lines so long that ten of them, less than 0.1 s of
/// motion, fill the receive buffer.
fn contour() -> String {
    let moves = (0..500).map(|line| {
        let angle = (f64::from(line) * 0.05).sin() * 1.2;
        let (x, y) = (0.4 * angle.cos(), 0.4 * angle.sin());
        format!("{:100}\n", format!("X{x:.3}Y{y:.3}"))
    });
    format!("G91G1F5000\n{}", moves.collect::<String>())
}

/// The time from the first step to the last, s. Each axis brakes within 0.2 s.
fn duration(build: &Build, reserve: &str, silence: Range<f64>) -> Result<f64, Failure> {
    let mut bench = Bench::boot(build)?;
    bench.commands(&format!(
        "$110=6000\n$111=6000\n$120=500\n$121=500\n$122=500\n{reserve}"
    ))?;
    bench.pins.clear();
    bench.stream(&Stream::new(&contour()).silent(silence))?;
    let ends = (bench.pins.steps.first(), bench.pins.steps.last());
    let (Some(first), Some(last)) = ends else {
        return fail("nothing moves");
    };
    Ok((last.edge() - first.edge()) as f64 / CPU_HZ as f64)
}

/// A sender that falls silent costs no time, unless it is silent for longer than the reserve.
pub(crate) fn silent_sender(firmware: &Firmware) -> Result<Figures, Failure> {
    let build = firmware.build("fast")?;
    let smooth = duration(build, "", 0.0..0.0)?;
    let silent = duration(build, "", SILENCE)?;
    let little = duration(build, "$710=0.1\n", SILENCE)?;
    let mut figures = Figures::default();
    figures.add(
        "500 moves",
        format!("{smooth:.4} s, with 0.9 s of silence {silent:.4} s, with a reserve of 0.1 s {little:.4} s"),
    );
    let right = silent - smooth <= LONGER * smooth && little - smooth >= MISSED;
    ensure(right, || figures.to_string())?;
    Ok(figures)
}
