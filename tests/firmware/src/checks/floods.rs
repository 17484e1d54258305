//! One serial line is flooded while the other one is used.
use super::{
    stopping::{moving, INTERVAL_US},
    Figures,
};
use crate::{
    bench::{cycles, ensure, fail, micros_between, Bench, Failure, Flood},
    compare, desk,
    firmware::Build,
    job::Job,
    pins::CYCLES_PER_COUNT,
    steps::{jitter, Step},
    stream::Stream,
};
use leadscrew_sim::Rate;

/// The bytes and lines that may come as fast as a line takes them: bytes that act at once, lines
/// that are answered, refused or have to wait for the job, and lines that never end.
const KINDS: [(&str, &[u8]); 16] = [
    ("?", b"?"),
    ("feed override", b"\x91"),
    ("spindle override", b"\x9A\x9B"),
    ("jog cancel", b"\x85"),
    ("cycle start", b"~"),
    ("letters of two bytes", "ä".as_bytes()),
    ("line ends", b"\n"),
    ("both line ends", b"\r\n"),
    ("comments", b"(a comment)\n"),
    ("nonsense", b"]@%=nonsense,,\n"),
    ("a line without an end", b"X1"),
    ("G-code", b"G1X1F100\n"),
    ("jogs", b"$J=G91X1F100\n"),
    ("lists of settings", b"$$\n"),
    ("lists of offsets", b"$#\n"),
    ("a setting, and ?", b"?$100=250\n?"),
];

/// The longest time from `!` on one line to the first longer interval between steps while the other
/// line is flooded, µs.
const HOLD_US: f64 = 5_000.0;
/// The flood goes on for so long before and after `!`, s.
const FLOOD_SECONDS: f64 = 20e-3;
/// The time between two looks, s.
const LOOK_SECONDS: f64 = 0.5e-3;
/// The longest time from the last answer to the last step, s.
const LAST_SECONDS: f64 = 0.3;
/// The most by which an interval in the cruise, or the time of a job, may be off, as a share.
const TOLERANCE: f64 = 0.01;
/// The most by which step edges may be off the schedule, cycles: as for the check `together`.
const JITTER: u32 = 42;

/// Lets time pass while a line is flooded.
fn run(bench: &mut Bench) -> Result<(), Failure> {
    (0..(FLOOD_SECONDS / LOOK_SECONDS) as u32).try_for_each(|_| bench.run_for(LOOK_SECONDS))
}

/// The edge of the first step after `cycle` that the next one follows later than in the cruise.
fn slower(bench: &Bench, cycle: u64) -> Option<u64> {
    let mut pairs = bench.pins.steps.windows(2);
    let longer = pairs.find(|pair| {
        let counts = pair[1].due - pair[0].due;
        let interval = micros_between(0, counts * CYCLES_PER_COUNT);
        pair[0].edge() > cycle && interval > (1.0 + TOLERANCE) * INTERVAL_US
    });
    longer.map(|pair| pair[0].edge())
}

/// The cruise of `bench` goes on undisturbed while a line is flooded, until `!` comes on the other
/// one. Returns the time from then until motion is slower, µs.
fn hold(bench: &Bench, flood: Flood) -> Result<f64, Failure> {
    let mut bench = bench.clone();
    let began = bench.machine.cycle();
    bench.flood(flood);
    run(&mut bench)?;
    bench.send("!");
    let sent = bench.machine.cycle();
    run(&mut bench)?;
    match slower(&bench, began) {
        Some(edge) if edge > sent => Ok(micros_between(sent, edge)),
        Some(edge) => fail(format!(
            "motion is slower {:.0} us after the flood began",
            micros_between(began, edge)
        )),
        None => fail("no hold"),
    }
}

/// The first move of a job, 60 ms.
const FIRST: &str = "G91G1X5F9000\n";

/// The steps of X in the whole job, whose last line moves X alone.
const X_STEPS: usize = (5 * 250) + 61 * 50;

/// The places of the steps of X.
fn x_steps(steps: &[Step]) -> impl Iterator<Item = usize> + '_ {
    let steps = steps.iter().enumerate();
    steps.filter_map(|(place, step)| (step.motors & 1 != 0).then_some(place))
}

/// A zigzag of short lines, 2 ms each. No override makes it faster than its axes are.
fn zigzag() -> Job {
    let lines = (0..61).map(|line| format!("X0.2Y0.0{}\n", line % 3));
    let axes = "$100=250\n$101=250\n$110=6000\n$111=6000\n$120=4000\n$121=4000\n";
    let settings = format!("$0=5\n$701=0\n{axes}");
    Job::new("zigzag", &settings, &lines.collect::<String>())
}

/// A job is streamed over one line while the other one is flooded, and takes no longer. Returns the
/// ratio of the times.
fn stream(bench: &Bench, flood: Flood, job: &Job) -> Result<f64, Failure> {
    let mut bench = bench.clone();
    bench.command(FIRST.trim_end())?;
    bench.flood(flood);
    Stream::new(&job.program).send_all(&mut bench)?;
    let program = format!("{FIRST}{}", job.program);
    let planned = desk::plan(&job.settings, &program, Rate::NeverWaits)?;
    let end = bench.machine.cycle() + cycles(LAST_SECONDS);
    while x_steps(&bench.pins.steps).count() < X_STEPS && bench.machine.cycle() < end {
        bench.run_for(LOOK_SECONDS)?;
    }
    // Behind the job the flood may move the machine.
    let last = x_steps(&bench.pins.steps).nth(X_STEPS - 1);
    let Some(last) = last else {
        return fail(format!("{} steps", x_steps(&bench.pins.steps).count()));
    };
    let steps = &bench.pins.steps[..=last];
    let ratio = compare::in_path(steps, &planned, TOLERANCE)?;
    let jitter = jitter(steps);
    ensure(jitter <= JITTER, || format!("jitter {jitter} cycles"))?;
    Ok(ratio)
}

/// Floods each line with each kind of bytes while the other one stops a motion, and runs a job.
pub(super) fn floods(build: &Build, figures: &mut Figures) -> Result<(), Failure> {
    let job = zigzag();
    for (over_usb, name) in [
        (false, "the serial line, at 2 Mbaud"),
        (true, "USB, as fast as packets go"),
    ] {
        let mut cruise = moving(build, 0.4)?;
        cruise.plug_usb()?;
        let mut rest = Bench::boot(build)?;
        rest.plug_usb()?;
        rest.commands(&job.settings)?;
        rest.pins.clear();
        if over_usb {
            cruise.use_serial();
            rest.use_serial();
        }
        let mut worst = (0.0_f64, 1.0_f64);
        for (kind, bytes) in KINDS {
            let flood = Flood { over_usb, bytes };
            let of = |failure| Failure(format!("a flood of {kind} on {name}: {failure}"));
            let micros = hold(&cruise, flood).map_err(of)?;
            ensure(micros <= HOLD_US, || {
                format!("a flood of {kind} on {name}: ! acts after {micros:.0} us")
            })?;
            let ratio = stream(&rest, flood, &job).map_err(of)?;
            worst = (worst.0.max(micros), worst.1.max(ratio));
        }
        figures.add(
            format!("{} floods on {name}", KINDS.len()),
            format!(
                "! on the other line acts within {:.0} us; a job there takes {:+.3} % of its time at most",
                worst.0,
                100.0 * (worst.1 - 1.0)
            ),
        );
    }
    Ok(())
}
