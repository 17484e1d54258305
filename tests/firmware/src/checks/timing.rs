//! The exactness and the speed of the step interrupt.
use super::{
    interrupts::{middle_and_most, Interrupts, TICK},
    Figures,
};
use crate::{
    bench::{ensure, fail, Bench, Failure},
    claims::{self, Row},
    firmware::{Build, Firmware},
    pins::{CPU_HZ, CYCLES_PER_COUNT, STEP_IRQ},
    steps::{jitter, net, Step},
    stream::Stream,
};
use leadscrew_f407emu::Exception;

/// The most by which a step edge may be off the timer's schedule, cycles.
const JITTER: u32 = 40;
/// The time by which a pulse may be longer than its setting, µs.
const PROLONGED_US: f64 = 1.0;
/// The longest time that a tick which loads a segment may take from entry to exit, cycles.
/// `StepTiming` allows more at the start of a line, for boards with pins on several ports.
pub(super) const LOADING: u64 = 480;
/// The largest share of ticks that may take longer than [`TICK`] because they load a segment, per
/// cent.
const LOADS_PERCENT: usize = 5;

/// The longest time between two step events of these jobs, s. The first one from rest comes after
/// sqrt(2 s/a) = 1.4 ms, with 1/250 mm and the least acceleration, 2000 mm/s²; at most one stop
/// lies between. A lost tick would leave a gap of 51 s.
const LONGEST_GAP: f64 = 0.01;

/// Three motors at 250 steps/mm and up to `rate` steps/s, with the acceleration in mm/s² and the
/// pulse width in µs.
pub(super) fn settings(pulse_us: u32, rate: f64, acceleration: u32) -> String {
    let feed = rate / 250.0 * 60.0;
    let axis = |axis: u32| {
        format!(
            "${}=250\n${}={feed:.0}\n${}={acceleration}\n",
            100 + axis,
            110 + axis,
            120 + axis
        )
    };
    format!(
        "$0={pulse_us}\n$32=1\n$30=1000\n$701=0\n{}{}{}",
        axis(0),
        axis(1),
        axis(2)
    )
}

/// Runs a program while comments keep the line busy and a status query comes ten times a second.
fn run_busy(build: &Build, settings: &str, program: &str) -> Result<Bench, Failure> {
    let mut bench = Bench::boot(build)?;
    bench.cold();
    bench.ignore_power();
    bench.commands(settings)?;
    bench.pins.clear();
    bench.machine.clear_records();
    let traffic = "(nothing but traffic)\n".repeat(600);
    bench.stream(&Stream::new(&format!("{program}{traffic}")).polling(0.1))?;
    Ok(bench)
}

/// Pulse widths in µs, each with a rate that leaves time for it, steps/s.
const RATIOS: [(u32, f64); 4] = [
    (3, 166_000.0),
    (5, 125_000.0),
    (10, 76_000.0),
    (20, 42_000.0),
];
/// A move of three motors at 250 steps/mm that never step at the same rate; and its end in steps
/// and in a report.
const MOVE: &str = "G91M4S500\nG1X300Y211Z97F99999\n";
const MOVED: [i64; 3] = [75_000, 52_750, 24_250];
const REPORTED: &str = "MPos:300.000,211.000,97.000|";

/// For each of some pulse widths: all rates from rest up to the highest for that width, and back.
pub(crate) fn jitter_at_every_ratio(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    for (pulse_us, rate) in RATIOS {
        let mut bench = run_busy(
            firmware.build("usual")?,
            &settings(pulse_us, rate, 4000),
            MOVE,
        )?;
        describe_edges(&bench, pulse_us, &mut figures);
        let held = ensure_exact(&mut bench, pulse_us);
        held.map_err(|Failure(words)| Failure(format!("{words}\n{figures}")))?;
    }
    Ok(figures)
}

fn micros(cycles: u64) -> f64 {
    cycles as f64 * 1e6 / CPU_HZ as f64
}

fn describe_edges(bench: &Bench, pulse_us: u32, figures: &mut Figures) {
    let (steps, extremes) = (&bench.pins.steps, bench.pins.extremes);
    let latencies = || steps.iter().map(|step| step.latency);
    figures.add(
        format!("pulse {pulse_us} us, up to {:.0} steps/s", fastest(steps)),
        format!(
            "{} step events, latency {} to {} cycles, jitter {}, {} late, pulses of {:.2} to {:.2} us, low for {:.2} us at least",
            steps.len(),
            latencies().min().unwrap_or(0),
            latencies().max().unwrap_or(0),
            jitter(steps),
            steps.iter().filter(|step| step.late).count(),
            micros(extremes.pulse),
            micros(extremes.longest_pulse),
            micros(extremes.low),
        ),
    );
}

/// Checks that every edge is where it should be, that none is missing, and that the machine has
/// counted what the drivers have seen.
fn ensure_exact(bench: &mut Bench, pulse_us: u32) -> Result<(), Failure> {
    let (steps, extremes) = (&bench.pins.steps, bench.pins.extremes);
    ensure_no_gap(steps)?;
    ensure(jitter(steps) <= JITTER, || {
        format!("more than {JITTER} cycles of jitter")
    })?;
    let moved = net(steps);
    ensure(moved == MOVED, || format!("{moved:?} steps, not {MOVED:?}"))?;
    ensure(micros(extremes.pulse) >= f64::from(pulse_us), || {
        "a pulse is too short".into()
    })?;
    let most = f64::from(pulse_us) + PROLONGED_US;
    ensure(micros(extremes.longest_pulse) <= most, || {
        format!("a pulse is longer than {most} us")
    })?;
    let status = bench.status()?;
    ensure(status.contains(REPORTED), || status.clone())
}

/// The highest rate, measured over eight step events, steps/s.
pub(super) fn fastest(steps: &[Step]) -> f64 {
    let spans = steps.windows(9).map(|window| window[8].due - window[0].due);
    let shortest = spans.min().unwrap_or(u64::MAX).max(1);
    8.0 * CPU_HZ as f64 / (shortest * CYCLES_PER_COUNT) as f64
}

/// The longest time between two step events, s.
fn longest_gap(steps: &[Step]) -> f64 {
    let gaps = steps.windows(2).map(|pair| pair[1].edge() - pair[0].edge());
    gaps.max().unwrap_or(0) as f64 / CPU_HZ as f64
}

/// Checks that no two step events are further apart than [`LONGEST_GAP`].
pub(super) fn ensure_no_gap(steps: &[Step]) -> Result<(), Failure> {
    let gap = longest_gap(steps);
    ensure(gap <= LONGEST_GAP, || {
        format!("no step event for {gap:.4} s: a tick was lost")
    })
}

/// The longest service of the step interrupt so far, cycles.
pub(super) fn longest_tick(bench: &Bench) -> u64 {
    bench.machine.profile(Exception::irq(STEP_IRQ)).max
}

/// The width of the pulses that [`busy_with_three_motors`] makes, µs.
pub(super) const PULSE_US: u32 = 3;

/// Runs three axes together up to 100 000 steps/s and back, with cold caches and power that
/// changes at every tick.
pub(super) fn busy_with_three_motors(build: &Build) -> Result<Bench, Failure> {
    let mut bench = Bench::boot(build)?;
    bench.cold();
    bench.ignore_power();
    bench.commands(&settings(PULSE_US, 100_000.0, 2000))?;
    bench.pins.clear();
    bench.machine.clear_records();
    bench.machine.record_services();
    bench.stream(&Stream::new(
        "G91M4S1000\nG1X20Y20Z20F99999\nG1X-20Y-20Z-20\n",
    ))?;
    Ok(bench)
}

/// Measures the step interrupts with all motors; the interrupts and their figures.
pub(super) fn measure(build: &Build) -> Result<(Interrupts, Figures), Failure> {
    let bench = busy_with_three_motors(build)?;
    let interrupts = Interrupts::of(&bench);
    let mut figures = Figures::default();
    let mut add = |what: &str, lengths: &[u64]| {
        let (middle, most) = middle_and_most(lengths);
        let count = lengths.len();
        figures.add(
            what,
            format!("{middle} cycles in the middle, {most} at most, {count} interrupts"),
        );
    };
    add("all motors step, entry to exit", &interrupts.stepping);
    add("a tick that loads a segment", &interrupts.loads);
    add("a pulse ends", &interrupts.ends);
    if interrupts.stepping.is_empty() {
        return fail(format!("no interrupt with all motors stepping\n{figures}"));
    }
    Ok((interrupts, figures))
}

/// The places at which the lengths of the interrupts are stated: in README.md the longest tick and
/// the longest that takes a segment; in docs/benchmarks.md also the middle ones, and the end of a
/// pulse.
const README: Row = Row {
    file: "README.md",
    last: "`cargo fw-test step-interrupt`",
    column: 2,
};
const BENCHMARKS: Row = Row {
    file: "docs/benchmarks.md",
    last: "`step-interrupt`",
    column: 2,
};

/// Checks that documents state these lengths.
fn ensure_stated(interrupts: &Interrupts) -> Result<(), Failure> {
    let [tick, load, end] = [&interrupts.stepping, &interrupts.loads, &interrupts.ends]
        .map(|lengths| middle_and_most(lengths))
        .map(|(middle, most)| (Some(middle as f64), Some(most as f64)));
    claims::ensure_stated(&README, &[tick.1, load.1])?;
    claims::ensure_stated(&BENCHMARKS, &[tick.0, tick.1, load.0, load.1, end.0])
}

/// No step interrupt may take longer than allowed, including those that load a segment.
pub(crate) fn step_interrupt(firmware: &Firmware) -> Result<Figures, Failure> {
    let (interrupts, figures) = measure(firmware.build("usual")?)?;
    let Interrupts {
        stepping, loads, ..
    } = &interrupts;
    ensure(
        loads.len() * 100 <= LOADS_PERCENT * (loads.len() + stepping.len()),
        || {
            format!("more than {LOADS_PERCENT} % of the ticks take longer than {TICK} cycles\n{figures}")
        },
    )?;
    ensure(interrupts.longest() <= LOADING, || {
        format!("more than {LOADING} cycles\n{figures}")
    })?;
    ensure_stated(&interrupts)?;
    Ok(figures)
}
