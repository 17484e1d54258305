//! Ticks that are armed too late, and a compare register that matches again during a rest. Whatever
//! delays a tick, motion goes on, and no tick comes twice.
use super::Figures;
use crate::{
    bench::{ensure, micros_between, Bench, Failure},
    firmware::{Build, Firmware},
    pins::STEP_IRQ,
    steps::{net, Step},
};
use leadscrew_f407emu::Exception;

/// The compare register of the step timer.
const TIM2_CCR1: u32 = 0x4000_0034;
/// The times for which the core stands still before a store to the compare register, in cycles: up
/// to twice the time to the next tick.
const DELAYS: [u64; 5] = [400, 2_000, 4_000, 9_000, 17_000];
/// 20 000 steps/s: a step every 8400 cycles.
const SETTINGS: &str = "$0=3\n$32=1\n$30=1000\n$100=250\n$110=4800\n$120=2000\n$701=0\n";
const PROGRAM: &str = "G91M4S500\nG1X20F4800\n";
/// Steps of the program.
const MOVED: [i64; 3] = [5000, 0, 0];
/// The times after the lines were sent at which the next tick is delayed, s: in the ramp and in the
/// cruise.
const INSTANTS: [f64; 3] = [0.02, 0.1, 0.2];
/// The longest time that the job takes, s. A lost tick comes again only after 51 s, when the timer
/// has wrapped around.
const JOB: f64 = 0.6;

/// Delays a tick by `cycles`. Returns the longest time between two steps around it, µs.
fn delayed(build: &Build, instant: f64, cycles: u64) -> Result<f64, Failure> {
    let mut bench = Bench::boot(build)?;
    bench.ignore_power();
    bench.commands(SETTINGS)?;
    bench.pins.clear();
    bench.send(PROGRAM);
    bench.run_for(instant)?;
    let planted = bench.machine.cycle();
    let tick = Exception::irq(STEP_IRQ);
    bench.machine.stall_before(tick, TIM2_CCR1, cycles);
    bench.run_for(JOB)?;
    ensure(!bench.machine.is_stall_planted(), || {
        "no tick was armed".into()
    })?;
    let steps = &bench.pins.steps;
    let moved = net(steps);
    ensure(moved == MOVED, || {
        format!("{moved:?} steps, not {MOVED:?}: a tick was lost")
    })?;
    let edges: Vec<u64> = steps.iter().map(Step::edge).collect();
    let pairs = edges.windows(2).filter(|pair| pair[1] > planted);
    let gaps = pairs.map(|pair| micros_between(pair[0], pair[1]));
    Ok(gaps.take(1000).fold(0.0, f64::max))
}

/// The core stands still before a tick is armed: no step may be lost.
pub(crate) fn late_arm(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    for cycles in DELAYS {
        let mut longest = 0f64;
        for instant in INSTANTS {
            let gap = delayed(firmware.build("usual")?, instant, cycles);
            let gap = gap.map_err(|Failure(words)| {
                Failure(format!(
                    "a tick {cycles} cycles late, after {instant} s: {words}"
                ))
            })?;
            longest = longest.max(gap);
        }
        figures.add(
            format!("a tick {cycles} cycles late"),
            format!("{longest:.0} us between two steps at most"),
        );
    }
    Ok(figures)
}

/// A rest so long that the step timer wraps around and matches its compare register again, s.
const REST: f64 = 52.0;
const LINE: &str = "G91G1X1F600\n";
/// Steps of the line.
const LINE_STEPS: [i64; 3] = [250, 0, 0];
/// The longest time that the line takes, s.
const LINE_TIME: f64 = 0.5;
/// The time by which the first interval may differ, µs.
const SAME: f64 = 0.5;

/// The time between the first two steps of a line that starts from rest, µs.
fn first_interval(bench: &mut Bench) -> Result<f64, Failure> {
    bench.pins.clear();
    bench.send(LINE);
    bench.run_for(LINE_TIME)?;
    let moved = net(&bench.pins.steps);
    ensure(moved == LINE_STEPS, || {
        format!("{moved:?} steps, not {LINE_STEPS:?}")
    })?;
    let edges: Vec<u64> = bench.pins.steps.iter().map(Step::edge).take(2).collect();
    Ok(micros_between(edges[0], edges[1]))
}

/// Rests for longer than the step timer takes to wrap around. The next line must begin with the
/// same interval as the line before the rest.
pub(crate) fn long_rest(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut bench = Bench::boot(firmware.build("usual")?)?;
    bench.ignore_power();
    bench.commands(SETTINGS)?;
    let before = first_interval(&mut bench)?;
    bench.run_for(REST)?;
    let after = first_interval(&mut bench)
        .map_err(|Failure(words)| Failure(format!("after {REST} s of rest: {words}")))?;
    let mut figures = Figures::default();
    figures.add(
        "first interval",
        format!("{before:.1} us, after {REST} s of rest {after:.1} us"),
    );
    ensure((after - before).abs() <= SAME, || figures.to_string())?;
    Ok(figures)
}
