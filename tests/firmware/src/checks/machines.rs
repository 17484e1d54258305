//! The machines of `examples/machines`, each in the build for its own file: its job at the pins against the simulator's.
use super::{motion::AFTER_ALL, Figures};
use crate::{
    bench::{ensure, Bench, Contact, Failure},
    compare, desk,
    firmware::{Build, Firmware},
    job::{self, Job},
    steps::Step,
    stream::Stream,
    wiring::{TOOL_LOWER, TOOL_UPPER},
};
use leadscrew_sim::profile::Profile;

/// The machine homes, and is locked until it has.
const UNLOCKED: &str = "$X\n";

/// Runs a job on a board that is on, wholly queued before it starts where it rests nowhere; its steps since power-up.
fn run(bench: &mut Bench, job: &Job) -> Result<Vec<Step>, Failure> {
    bench.ignore_power();
    bench.commands(&job.settings)?;
    bench.stream(&Stream::new(&job.program))?;
    Ok(std::mem::take(&mut bench.pins.steps))
}

/// The machine file of `examples/machines/NUMBER`.
fn profile(number: &str) -> Result<Profile, Failure> {
    Ok(Profile::load(&job::machine(number))?)
}

/// The second motor of Y on machine 000, `reversed`: its direction pin has the other level.
const MIRRORED: u8 = 1 << 3;

/// Machine 000 cuts its square: both motors of Y, to the tick.
fn laser(build: &Build) -> Result<String, Failure> {
    let settings = format!("{UNLOCKED}{AFTER_ALL}");
    let job = Job::new("square", &settings, &job::file("machines/000/square.nc")?);
    let steps = run(&mut Bench::boot(build)?, &job)?;
    let mut planned = desk::plan_machine(&profile("000")?, &job.settings, &job.program)?;
    for step in &mut planned {
        step.negative ^= MIRRORED;
    }
    compare::to_the_tick(&steps, &planned)?;
    let [_, y, _, second] = compare::ways(&steps);
    let back: Vec<i64> = second.iter().map(|way| -way).collect();
    ensure(y == back && !y.is_empty(), || {
        format!("the motors of Y go different ways: {y:?}, {second:?}")
    })?;
    Ok(format!("{} step events to the tick", steps.len()))
}

/// Two holes with one bit, two with another, in canned cycles.
const BOARD: &str = "G21G90\nM6T1\nM3S30\nG0Z1\nG81X3Y2Z-1.8R1F300\nX6Y4\nG80\n\
    M6T2(0.8 mm)\nM3S30\nG0Z1\nG81X5Y1Z-1.8R1F300\nX1Y1\nG80\nG0Z1\nX0Y0\nM30\n";

/// Machine 002 drills with two bits: the operator resumes each change.
fn drill(build: &Build) -> Result<String, Failure> {
    let job = Job::new("board", UNLOCKED, BOARD);
    let steps = run(&mut Bench::boot(build)?, &job)?;
    let planned = desk::plan_machine(&profile("002")?, &job.settings, &job.program)?;
    compare::same_ways(&steps, &planned)?;
    let changes = BOARD.matches("M6").count();
    Ok(format!(
        "{} step events, {changes} tool changes",
        steps.len()
    ))
}

/// A square of 5 mm, engraved, and the way back.
const SQUARE: &str = "G21G91G94\nM5\nG0X1Y1\nM3\nG1X5F600\nY5\nX-5\nY-5\nM5\nG0X-1Y-1\nM30\n";
/// Where machine 003's file has its switches, steps of 0.01 mm, and the way in which Z stops: 5 mm/s at 50 mm/s² take 0.25 mm.
const LOWER: i64 = -300;
const UPPER: i64 = 300;
const STOPS_WITHIN: i64 = 27;

/// Machine 003 engraves a square: the tool is at its lower switch for the cuts, at its upper one for the ways between.
fn engraver(build: &Build) -> Result<String, Failure> {
    let mut bench = Bench::boot(build)?;
    bench.contacts = vec![
        Contact::new(TOOL_LOWER, 2, LOWER),
        Contact::new(TOOL_UPPER, 2, UPPER),
    ];
    let steps = run(&mut bench, &Job::new("square", "", SQUARE))?;
    let planned = desk::plan_machine(&profile("003")?, "", SQUARE)?;
    let [x, y, z, _] = compare::ways(&steps);
    let [planned_x, planned_y, ..] = compare::planned_ways(&planned);
    ensure((&x, &y) == (&planned_x, &planned_y), || {
        format!("X goes {x:?}, Y {y:?}; planned {planned_x:?}, {planned_y:?}")
    })?;
    let stands = z.iter().scan(0, |at, way| {
        *at += way;
        Some(*at)
    });
    let stands: Vec<i64> = stands.collect();
    let beyond = |at: i64, switch: i64| (at - switch) * switch.signum();
    let right = |(at, switch): (&i64, i64)| (0..=STOPS_WITHIN).contains(&beyond(*at, switch));
    let switches = [UPPER, LOWER, UPPER];
    ensure(
        stands.len() == switches.len() && stands.iter().zip(switches).all(right),
        || format!("the tool stands at {stands:?}"),
    )?;
    Ok(format!("Z stands at {stands:?} steps"))
}

pub(crate) fn machines(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let [laser_build, drill_build, engraver_build] = &firmware.machines;
    for (name, done) in [
        ("000", laser(laser_build)),
        ("002", drill(drill_build)),
        ("003", engraver(engraver_build)),
    ] {
        figures.add(
            name,
            done.map_err(|Failure(words)| Failure(format!("{name}: {words}")))?,
        );
    }
    Ok(figures)
}
