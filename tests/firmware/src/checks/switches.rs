//! The inputs, driven at the pins: which levels are accepted, when, and what they cause.
use super::{
    power_loss::fill,
    stopping::{last_step, moving, power_off, INTERVAL_US, STEPS},
    Figures,
};
use crate::{
    bench::{cycles, ensure, micros_between, Bench, Failure},
    firmware::{Build, Fault, Firmware},
    pins::{DOOR, FILTER_SECONDS, HOLD, LIMIT, POWER, RESET, START},
    steps::net,
};
use leadscrew_f407emu::Pin;

/// The longest time from the end of the filter's time to the last step edge, µs.
const STEPS_US: f64 = 10.0;
/// The longest time from the end of the filter's time to laser off, µs.
const LASER_US: f64 = 2.5;
/// The time by which an edge is noted later if a tick that loads a segment delays its interrupt,
/// µs: 532 cycles at most.
const LOAD_US: f64 = 3.2;
/// The number of edges that may fall on such a tick: a segment is loaded once in a millisecond,
/// which takes some 2 µs.
const AT_LOAD: usize = 1;
/// The filter's time in µs.
const FILTER_US: f64 = FILTER_SECONDS * 1e6;
/// The filter's clock counts microseconds, so that its time ends within one count, µs. All other
/// times are measured from that end, which is a match of the filter's timer.
const COUNT_US: f64 = 1.5;
/// The number of edges that are tried, 20.3 µs apart: each falls on another place between two steps
/// and between two counts.
const EDGES: usize = 60;
const BETWEEN: u64 = 3_413;

/// The effects of an edge of a stopping input, µs after the end of the filter's time.
#[derive(Clone, Copy)]
struct Stopped {
    /// The time between the end of [`FILTER_US`] after the edge and the end of the filter's time,
    /// µs.
    settled: f64,
    last_step: f64,
    laser_off: f64,
}

/// Closes a switch in full motion. The machine must then say `words`.
fn stop_by(mut bench: Bench, pin: Pin, words: &str) -> Result<Stopped, Failure> {
    bench.heard();
    let edge = bench.set(pin, false);
    let nominal = edge + cycles(FILTER_SECONDS);
    bench.pins.settled.clear();
    bench.hear_until(0.1, |line| line == words)?;
    bench.run_for(0.02)?;
    let mut ends = bench.pins.settled.iter().filter(|end| **end > edge);
    let believed = *ends
        .next()
        .ok_or_else(|| Failure("the filter's time never ends".into()))?;
    Ok(Stopped {
        settled: micros_between(nominal, believed),
        last_step: micros_between(believed, last_step(&bench)),
        laser_off: micros_between(believed, power_off(&bench)?),
    })
}

/// Closes `pins` in turn at many instants.
fn stop_at_many(firmware: &Firmware, pins: &[Pin], words: &str) -> Result<Figures, Failure> {
    let mut base = moving(firmware.build("usual")?, 0.22)?;
    base.cold();
    let mut all = Vec::new();
    for pin in pins.iter().cycle().take(EDGES) {
        base.run_to(base.machine.cycle() + BETWEEN)?;
        all.push(stop_by(base.clone(), *pin, words)?);
    }
    let steps = || all.iter().map(|stopped| stopped.last_step);
    let laser = || all.iter().map(|stopped| stopped.laser_off);
    let (first, last) = (
        steps().fold(f64::MAX, f64::min),
        steps().fold(f64::MIN, f64::max),
    );
    let (bright, dark) = (
        laser().fold(f64::MAX, f64::min),
        laser().fold(f64::MIN, f64::max),
    );
    let settled = || all.iter().map(|stopped| stopped.settled);
    let (soonest, latest) = (
        settled().fold(f64::MAX, f64::min),
        settled().fold(f64::MIN, f64::max),
    );
    let mut figures = Figures::default();
    figures.add(
        format!("{EDGES} edges, the filter's time ends after {FILTER_US} us and"),
        format!("{soonest:.2} to {latest:.2} us"),
    );
    figures.add(
        "after that end",
        format!("last step edge {first:.2} to {last:.2} us, laser off {bright:.2} to {dark:.2} us"),
    );
    ensure(last <= STEPS_US && dark <= LASER_US, || {
        format!("too late\n{figures}")
    })?;
    let noted_late = settled().filter(|end| *end > COUNT_US).count();
    ensure(
        soonest >= -COUNT_US && latest <= COUNT_US + LOAD_US && noted_late <= AT_LOAD,
        || format!("the filter's time is another\n{figures}"),
    )?;
    ensure(first >= -INTERVAL_US && bright >= 0.0, || {
        format!("believed too early\n{figures}")
    })?;
    Ok(figures)
}

/// Sets the preload bit in the mode register of the laser's channel (TIM4_CCMR1), so that a new
/// compare value takes effect only at the end of a period. The manual does not say whether it does
/// so in PWM without preload.
const AT_THE_PERIODS_END: Fault = Fault {
    register: 0x4000_0818,
    tamper: |word| Some(word | 1 << 3),
};

pub(crate) fn limit_switches(firmware: &Firmware) -> Result<Figures, Failure> {
    let figures = stop_at_many(firmware, &LIMIT, "ALARM:1")?;
    stop_at_many(&firmware.with(AT_THE_PERIODS_END), &LIMIT, "ALARM:1")?;
    let mut bench = moving(firmware.build("usual")?, 0.1)?;
    bench.set(LIMIT[1], false);
    bench.hear_until(0.1, |line| line == "ALARM:1")?;
    let status = bench.status()?;
    ensure(
        status.starts_with("<Alarm|") && status.contains("|Pn:Y"),
        || status.clone(),
    )?;
    Ok(figures)
}

pub(crate) fn reset_button(firmware: &Firmware) -> Result<Figures, Failure> {
    stop_at_many(firmware, &[RESET], "ALARM:3")
}

/// A laser that may be lit at rest; limit switches stop it.
const LASER: &str = "$21=1\n$32=1\n$30=1000\n$707=0\n$120=4000\n";

/// Brings a laser under M3 to rest, lit.
fn lit_at_rest(mut bench: Bench) -> Result<Bench, Failure> {
    bench.commands("G91M3S1000\nG1X1F3000\n")?;
    bench.wait_for("Idle", 2.0)?;
    ensure(bench.machine.level(POWER), || "the laser is off".into())?;
    Ok(bench)
}

/// A switch closes while a sector is erased, when the laser is off anyway: it must stay off.
fn dark_after_erasing(build: &Build) -> Result<(), Failure> {
    let mut bench = Bench::boot(build)?;
    bench.commands(LASER)?;
    let (mut bench, line) = fill(bench)?;
    // The other sector was blank; from now on it has to be erased before use.
    bench.command(&line)?;
    let (bench, line) = fill(bench)?;
    let mut bench = lit_at_rest(bench)?;
    bench.machine.clear_records();
    let mut alone = bench.clone();
    alone.command(&line)?;
    let operations = alone.machine.flash_operations();
    let erase = operations.iter().find(|operation| operation.erases);
    let erase = erase.ok_or_else(|| Failure("nothing is erased".into()))?;
    let (begin, end) = (erase.begin, erase.end);
    ensure(alone.machine.level(POWER), || {
        "the laser does not come back".into()
    })?;
    for pin in [RESET, LIMIT[0]] {
        let mut bench = bench.clone();
        bench.send(format!("{line}\n"));
        bench.run_to(begin.midpoint(end))?;
        ensure(!bench.machine.level(POWER), || "lit in an erase".into())?;
        bench.pins.clear();
        bench.set(pin, false);
        bench.run_to(end + cycles(0.05))?;
        let lit = bench.pins.others.iter().any(|edge| edge.pin == POWER);
        ensure(!lit, || format!("{pin}: the laser is lit after the erase"))?;
    }
    Ok(())
}

/// The reset button and a limit switch at rest: the laser must be off before the main loop acts.
pub(crate) fn at_rest(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let mut bench = Bench::boot(firmware.build("usual")?)?;
    bench.commands(LASER)?;
    let base = lit_at_rest(bench)?;
    for (pin, words) in [
        (RESET, "[MSG:Reset input is active, release it to unlock]"),
        (LIMIT[0], "ALARM:1"),
    ] {
        let stopped = stop_by(base.clone(), pin, words)?;
        let off = stopped.laser_off;
        ensure((0.0..=LASER_US).contains(&off), || {
            format!("{pin}: dark {off:.2} us after the filter's time")
        })?;
        figures.add(
            pin,
            format!("laser off {off:.2} us after the filter's time"),
        );
    }
    dark_after_erasing(firmware.build("fast")?)?;
    Ok(figures)
}

/// Moves a switch to `closed`, then back and so on; `micros` are the times between the edges, µs.
/// Returns the cycle of the first edge.
fn bounce(bench: &mut Bench, pin: Pin, closed: bool, micros: &[u64]) -> u64 {
    let first = bench.set(pin, closed);
    let mut edge = first;
    for (index, wait) in micros.iter().enumerate() {
        edge += wait * 168;
        bench.machine.pin_at(edge, pin, closed == (index % 2 == 1));
    }
    first
}

/// Spikes and bounces that are over before the filter's time ends, in µs. Each has an odd number of
/// edges after the first, so that the switch is open again.
const SPIKES: [&[u64]; 3] = [&[195], &[5], &[20, 20, 20, 20, 20, 20, 20, 20, 20]];
/// Pulses and bounces after which the switch is closed when the filter's time ends.
const PULSES: [&[u64]; 2] = [&[205], &[60, 60, 500, 20, 20]];

/// A switch in full motion: spikes must change nothing, pulses must lead to `state`.
fn filter_one(base: &Bench, pin: Pin, closed: bool, state: &str) -> Result<(), Failure> {
    let before = base.clone().status()?;
    let before = before.split('|').next().unwrap_or_default();
    for spike in SPIKES {
        let mut bench = base.clone();
        bounce(&mut bench, pin, closed, spike);
        bench.run_for(0.005)?;
        let status = bench.status()?;
        ensure(status.starts_with(before), || {
            format!("{pin}: a spike of {spike:?} us: {status}")
        })?;
    }
    for pulse in PULSES {
        let mut bench = base.clone();
        bounce(&mut bench, pin, closed, pulse);
        bench.run_for(0.005)?;
        let status = bench.status()?;
        ensure(status.starts_with(state), || {
            format!("{pin}: a pulse of {pulse:?} us: {status}, not {state}")
        })?;
    }
    Ok(())
}

/// Other filter times, µs, each with a spike that is shorter and a pulse that is longer. At 0 the
/// level after the edge counts.
const OTHER_TIMES: [(u32, Option<u64>, u64); 3] = [
    (0, None, 20),
    (1_000, Some(995), 1_005),
    (10_000, Some(9_995), 10_005),
];

/// The filter's time is a setting.
fn other_times(build: &Build) -> Result<(), Failure> {
    for (micros, spike, pulse) in OTHER_TIMES {
        let mut bench = Bench::boot(build)?;
        bench.commands(&format!("$706={micros}\n$21=1\n"))?;
        for (length, state) in [(spike, "<Idle"), (Some(pulse), "<Alarm")] {
            let Some(length) = length else { continue };
            let mut bench = bench.clone();
            bounce(&mut bench, LIMIT[0], false, &[length]);
            bench.run_for(0.03)?;
            let status = bench.status()?;
            ensure(status.starts_with(state), || {
                format!("$706={micros}, {length} us: {status}, not {state}")
            })?;
        }
    }
    Ok(())
}

pub(crate) fn filter(firmware: &Firmware) -> Result<Figures, Failure> {
    other_times(firmware.build("usual")?)?;
    let base = moving(firmware.build("usual")?, 0.1)?;
    for limit in LIMIT {
        filter_one(&base, limit, false, "<Alarm")?;
    }
    filter_one(&base, RESET, false, "<Alarm")?;
    filter_one(&base, HOLD, false, "<Hold")?;
    filter_one(&base, DOOR, false, "<Door")?;
    let mut held = base.clone();
    held.send("!");
    held.wait_for("Hold:0", 1.0)?;
    filter_one(&held, START, true, "<Run")?;
    let mut figures = Figures::default();
    figures.add(
        "7 inputs",
        format!(
            "{} spikes passed over, {} pulses believed",
            7 * SPIKES.len(),
            7 * PULSES.len()
        ),
    );
    Ok(figures)
}

/// The longest time from cycle start, with the door closed again, to motion, s: spindle and coolant
/// take 4 s and 1 s of it.
const RESUME_SECONDS: f64 = 8.0;

/// Presses a button for a millisecond.
fn press(bench: &mut Bench, pin: Pin, pressed: bool) -> Result<(), Failure> {
    bench.set(pin, pressed);
    bench.run_for(0.001)?;
    bench.set(pin, !pressed);
    bench.run_for(0.001)
}

/// Checks that nothing steps for 0.1 s.
fn ensure_still(bench: &mut Bench) -> Result<(), Failure> {
    let steps = bench.pins.steps.len();
    bench.run_for(0.1)?;
    ensure(bench.pins.steps.len() == steps, || "motion goes on".into())
}

/// Feed hold, cycle start and door, one after the other: the job must still be carried out to its
/// last step.
pub(crate) fn buttons(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut bench = moving(firmware.build("usual")?, 0.1)?;
    press(&mut bench, HOLD, false)?;
    bench.wait_for("Hold:0", 1.0)?;
    ensure_still(&mut bench)?;
    press(&mut bench, START, true)?;
    bench.wait_for("Run", 0.1)?;
    bench.run_for(0.1)?;
    bench.set(DOOR, false);
    bench.wait_for("Door:1", 2.0)?;
    ensure_still(&mut bench)?;
    ensure(!bench.machine.level(POWER), || {
        "the laser is on behind an open door".into()
    })?;
    press(&mut bench, START, true)?;
    bench.wait_for("Door:1", 0.1)?;
    bench.set(DOOR, true);
    bench.wait_for("Door:0", 0.1)?;
    ensure_still(&mut bench)?;
    press(&mut bench, START, true)?;
    bench.wait_for("Run", RESUME_SECONDS)?;
    ensure(bench.machine.level(POWER), || "the laser stays off".into())?;
    bench.wait_for("Idle", 5.0)?;
    let position = net(&bench.pins.steps);
    ensure(position == [STEPS, 0, 0], || {
        format!("ends at {position:?}")
    })?;
    let mut figures = Figures::default();
    figures.add(
        "hold, start, door, start",
        format!("{STEPS} steps all the same"),
    );
    press(&mut bench, RESET, false)?;
    bench.hear_banner()?;
    Ok(figures)
}

/// Noise on a line: cycles between two edges (0.3 µs), and its duration, s.
const NOISE_CYCLES: u64 = 50;
const NOISE_SECONDS: f64 = 0.02;
const NOISE_SETTINGS: &str = "$0=5\n$21=0\n$32=1\n$30=1000\n$100=250\n$110=6000\n$120=2000\n";
/// The longest time from `?` to its answer while there is noise, s: at 115200 baud a report takes 5
/// ms.
const ANSWERED_SECONDS: f64 = 0.01;

/// Noise in the MHz range on a limit switch that is not in use: the machine must answer, and motion
/// go on to its last step.
pub(crate) fn noise(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut bench = Bench::boot(firmware.build("usual")?)?;
    bench.ignore_power();
    bench.machine.watch(LIMIT[0], false);
    bench.commands(NOISE_SETTINGS)?;
    bench.pins.clear();
    bench.commands("G91M3S500\nG1X20F6000\n")?;
    bench.run_for(0.05)?;
    let begin = bench.machine.cycle() + 100;
    let edges = cycles(NOISE_SECONDS) / NOISE_CYCLES;
    for edge in 0..edges {
        bench
            .machine
            .pin_at(begin + edge * NOISE_CYCLES, LIMIT[0], edge % 2 == 1);
    }
    bench.heard();
    bench.send("?");
    bench.hear_until(ANSWERED_SECONDS, |line| line.starts_with('<'))?;
    bench.wait_for("Idle", 3.0)?;
    ensure(bench.machine.resets().is_empty(), || "a reset".into())?;
    let moved = net(&bench.pins.steps);
    ensure(moved == [5000, 0, 0], || format!("{moved:?} steps"))?;
    let mut figures = Figures::default();
    figures.add("edges of noise", edges);
    Ok(figures)
}
