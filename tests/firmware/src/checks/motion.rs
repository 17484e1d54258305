//! Jobs that are wholly queued before they start. The steps at the pins must be the same as in the
//! simulator's schedule.
use super::Figures;
use crate::{
    bench::{ensure, Bench, Failure},
    compare, desk,
    firmware::{Build, Firmware},
    job::Job,
    pins::CPU_HZ,
    steps::{jitter, net, Step},
    stream::Stream,
};
use leadscrew_sim::Rate;

/// Motion begins when no line has come for 0.5 s: after the whole job.
pub(super) const AFTER_ALL: &str = "$701=500\n";
/// The most lines of a queued job, for which the queue of planned moves has room. An arc in a job
/// makes many moves, but then few lines follow it.
const FITS: usize = 1000;

/// Runs a job on the board, sent without waiting for motion. Returns the board and the steps.
pub(super) fn run_queued(build: &Build, job: &Job) -> Result<(Bench, Vec<Step>), Failure> {
    let mut bench = Bench::boot(build)?;
    let steps = run_queued_on(&mut bench, job)?;
    Ok((bench, steps))
}

/// As [`run_queued`], on a board that is already on.
pub(super) fn run_queued_on(bench: &mut Bench, job: &Job) -> Result<Vec<Step>, Failure> {
    bench.ignore_power();
    bench.commands(&job.settings)?;
    bench.commands(AFTER_ALL)?;
    bench.pins.clear();
    bench.stream(&Stream::new(&job.program))?;
    ensure_settled(bench)?;
    Ok(std::mem::take(&mut bench.pins.steps))
}

/// The least time that a driver needs a direction before a step and after one, ns (TI DRV8825,
/// SLVSA73F: 650).
const SETTLED_NS: u64 = 650;

fn ensure_settled(bench: &Bench) -> Result<(), Failure> {
    let least = SETTLED_NS * CPU_HZ / 1_000_000_000;
    let extremes = bench.pins.extremes;
    ensure(extremes.setup.min(extremes.hold) >= least, || {
        format!("a direction changes too close to a step: {extremes:?}")
    })
}

/// Compares a queued job with the simulator's. Returns the sentence for the report.
fn compare_queued(build: &Build, job: &Job) -> Result<String, Failure> {
    let (_, steps) = run_queued(build, job)?;
    let settings = format!("{}{AFTER_ALL}", job.settings);
    let planned = desk::plan(&settings, &job.program, Rate::NeverWaits)?;
    compare::to_the_tick(&steps, &planned)?;
    Ok(format!(
        "{} step events to {:?}, jitter {} cycles",
        steps.len(),
        net::<3>(&steps),
        jitter(&steps)
    ))
}

fn compare_all(build: &Build, jobs: &[Job]) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    for job in jobs {
        let words = compare_queued(build, job);
        let words = words.map_err(|failure| Failure(format!("{}: {failure}", job.name)))?;
        figures.add(&job.name, words);
    }
    Ok(figures)
}

pub(crate) fn queued_traces(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut jobs = Job::traces()?;
    jobs.retain(|job| job.lines() < FITS);
    compare_all(firmware.build("usual")?, &jobs)
}

pub(crate) fn queued_examples(firmware: &Firmware) -> Result<Figures, Failure> {
    let names = ["heart.nc", "heart_as_printed.nc", "print_testbar.nc"];
    let jobs = names.iter().map(|name| Job::example(name));
    let mut jobs = jobs.collect::<Result<Vec<_>, _>>()?;
    jobs.push(Job::new("circle with $705", EASED, &circle()));
    compare_all(firmware.build("usual")?, &jobs)
}

/// A jerk limit: each line of a circle makes the profile anew, from the moves far ahead of it.
const EASED: &str = "$705=5000\n$110=6000\n$111=6000\n$120=500\n$121=500\n";

/// A circle of 5 mm in lines of 0.1 mm.
fn circle() -> String {
    const LINES: i32 = 314;
    let lines = (1..=LINES).map(|line| {
        let angle = std::f64::consts::TAU * f64::from(line) / f64::from(LINES);
        let [x, y] = [5.0 * angle.sin(), 5.0 * (1.0 - angle.cos())];
        format!("X{x:.3}Y{y:.3}\n")
    });
    format!("G90G1F3000\n{}", lines.collect::<String>())
}

/// Corners of 90° at which Y reverses at some 27 000 steps/s: its next step comes 36 µs later.
const ZIGZAG: &str =
    "$0=3\n$11=2\n$100=250\n$101=250\n$110=30000\n$111=30000\n$120=5000\n$121=5000\n$704=1\n";
/// The set-up times of drivers, µs.
const SETUPS: [u64; 3] = [5, 50, 90];

/// The direction must be set as long before a step as `$709` asks for, on the board as in the
/// simulator.
pub(crate) fn direction_setup(firmware: &Firmware) -> Result<Figures, Failure> {
    let program = format!("G91F20000\n{}", "G1X2Y2\nX2Y-2\n".repeat(10));
    let mut figures = Figures::default();
    for setup_us in SETUPS {
        let settings = format!("{ZIGZAG}$709={setup_us}\n");
        let job = Job::new("zigzag", &settings, &program);
        let (bench, _) = run_queued(firmware.build("usual")?, &job)?;
        let least = bench.pins.extremes.setup as f64 * 1e6 / CPU_HZ as f64;
        figures.add(
            format!("$709={setup_us}"),
            format!("{least:.2} us from a direction to a step at least"),
        );
        ensure(least >= setup_us as f64, || figures.to_string())?;
        compare_queued(firmware.build("usual")?, &job)?;
    }
    Ok(figures)
}
