//! The machines of `examples/machines`, each in the build for its own file. A short job at the pins
//! is compared with the simulator's, and the machine's faults are tried. `supplied.rs` has the
//! whole jobs.
use super::{
    interrupts::Interrupts,
    planting::{hear_restart, plant, FOR_EVER},
    Figures,
};
use crate::{
    bench::{cycles, ensure, is_answer, micros_between, Bench, Failure},
    compare,
    desk::{self, Planned},
    firmware::{Build, Firmware},
    job::{self, Job},
    plant::{Body, Contact},
    steps::Step,
    stream::Stream,
    windings::Phases,
    wiring::{HEATERS, HEATER_FAULT, HEATER_SUPPLY, OUTPUT, SENSORS, TOOL_LOWER, TOOL_UPPER},
};
use leadscrew_f407emu::LSI_SLOWEST_HZ;
use leadscrew_sim::profile::Profile;

/// Unlocks a machine without homing: it is locked until it has homed.
pub(super) const UNLOCKED: &str = "$X\n";
/// The work's zero is the position after homing, and motion begins when all lines are queued.
pub(super) const ZERO: &str = "G10L20P1X0Y0Z0\n$701=500\n";

/// Runs a job on a board that is on, and answers its steps. The job is queued as a whole before it
/// starts, if nothing in it waits for rest.
pub(super) fn run(bench: &mut Bench, job: &Job) -> Result<Vec<Step>, Failure> {
    bench.ignore_power();
    bench.commands(&job.settings)?;
    let before = bench.pins.steps.len();
    bench.stream(&Stream::new(&job.program))?;
    Ok(bench.pins.steps[before..].to_vec())
}

/// The longest time that homing may take here, s.
const HOMING_SECONDS: f64 = 30.0;
/// The number of steps by which a carriage may be off the place to which it pulls off.
const SLACK: i64 = 2;

/// A motor and its carriage: the signed steps to its switch at power-up, and the steps that it
/// pulls off.
pub(super) type Carriage = (usize, i64, i64);

/// Homes carriages, and checks that each ends at its pull-off.
pub(super) fn home(bench: &mut Bench, carriages: &[Carriage]) -> Result<(), Failure> {
    let limits = bench.wiring.limits;
    let contacts = carriages.iter().filter_map(|(motor, away, _)| {
        let switch = limits.get(*motor).copied().flatten()?;
        Some(Contact::new(switch, *motor, *away))
    });
    bench.plant.contacts = contacts.collect();
    bench.send("$H\n");
    let heard = bench.hear_until(HOMING_SECONDS, is_answer)?;
    let places = bench.plant.contacts.iter().map(Contact::beyond);
    let places: Vec<i64> = places.collect();
    let right = |(place, (_, _, off)): (&i64, &Carriage)| (place + off).abs() <= SLACK;
    ensure(
        heard.last().is_some_and(|line| line == "ok") && places.iter().zip(carriages).all(right),
        || format!("homing: {heard:?}, steps beyond the switches: {places:?}"),
    )
}

/// The machine file of `examples/machines/NUMBER`.
pub(super) fn profile(number: &str) -> Result<Profile, Failure> {
    Ok(Profile::load(&job::machine(number))?)
}

/// The steps of a job on a machine that has homed.
pub(super) fn plan(number: &str, job: &Job) -> Result<Vec<Planned>, Failure> {
    let before = format!("$H\n{}", job.settings);
    desk::plan_machine(&profile(number)?, &before, &job.program)
}

/// The second motor of Y on machine 000 is `reversed`: its direction pin has the opposite level.
const MIRRORED: u8 = 1 << 3;

/// Machine 000 squares its gantry and cuts its square. Both motors of Y must agree to the tick.
fn laser(build: &Build) -> Result<String, Failure> {
    let job = Job::new("square", ZERO, &job::file("machines/000/square.nc")?);
    let mut bench = Bench::boot(build)?;
    // The second motor is 1 mm askew, and turns in the opposite direction.
    home(
        &mut bench,
        &[(0, -2400, 240), (1, -1600, 240), (3, 1680, 240)],
    )?;
    let steps = run(&mut bench, &job)?;
    let mut planned = plan("000", &job)?;
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

/// Two holes with one bit and two with another, in canned cycles.
const BOARD: &str = "G21G90\nM6T1\nM3S30\nG0Z1\nG81X3Y2Z-1.8R1F300\nX6Y4\nG80\n\
    M6T2(0.8 mm)\nM3S30\nG0Z1\nG81X5Y1Z-1.8R1F300\nX1Y1\nG80\nG0Z1\nX0Y0\nM30\n";

/// Machine 002 drills with two bits, and the operator resumes after each tool change.
fn drill(build: &Build) -> Result<String, Failure> {
    let job = Job::new("board", UNLOCKED, BOARD);
    let steps = run(&mut Bench::boot(build)?, &job)?;
    let profile = profile("002")?;
    let planned = desk::plan_machine(&profile, &job.settings, &job.program)?;
    compare::same_ways(&steps, &planned)?;
    let changes = BOARD.matches("M6").count();
    Ok(format!(
        "{} step events, {changes} tool changes",
        steps.len()
    ))
}

/// A square of 5 mm is engraved, and the tool moves back.
const SQUARE: &str = "G21G91G94\nM5\nG0X1Y1\nM3\nG1X5F600\nY5\nX-5\nY-5\nM5\nG0X-1Y-1\nM30\n";
/// The switches of machine 003 in its file, in steps of 0.01 mm, and the way in which Z stops: from
/// 5 mm/s at 50 mm/s² it takes 0.25 mm.
const LOWER: i64 = -300;
const UPPER: i64 = 300;
const STOPS_WITHIN: i64 = 27;

/// Switches machine 003 on with its tool between its two switches.
pub(super) fn boot_engraver(build: &Build) -> Result<Bench, Failure> {
    let mut bench = Bench::boot(build)?;
    bench.plant.contacts = vec![
        Contact::new(TOOL_LOWER, 2, LOWER),
        Contact::new(TOOL_UPPER, 2, UPPER),
    ];
    Ok(bench)
}

/// Machine 003 engraves a square. The tool is at its lower switch for the cuts, and at its upper
/// one for the moves between.
fn engraver(build: &Build) -> Result<String, Failure> {
    let mut bench = boot_engraver(build)?;
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

/// The speeds at which the bodies of machines 001 and 004 get warm here, K/s, so that they take
/// seconds: their own heaters take minutes.
const WARMS: [f64; 2] = [25.0, 20.0];
/// The reference voltage of the Discovery's ADC, V.
const REFERENCE: f64 = 3.0;

/// The output of a thermocouple's amplifier of machine 001 by its file, as a share of the
/// reference: first the nozzle's, then the bed's.
fn nozzle_amplifier(celsius: f64) -> f64 {
    (0.00653 + 0.00994 * celsius) / REFERENCE
}

fn bed_amplifier(celsius: f64) -> f64 {
    0.010 * celsius / REFERENCE
}

/// A thermistor to ground (100 kilohms at 25 degrees, B 3950) with 4.7 kilohms to the reference
/// voltage: its voltage as a share of the reference.
fn thermistor(celsius: f64) -> f64 {
    let ohms = 100_000.0 * (3950.0 * (1.0 / (celsius + 273.15) - 1.0 / 298.15)).exp();
    ohms / (ohms + 4_700.0)
}

/// Switches on a machine with two cold heaters.
fn boot_cold(build: &Build, sensors: [fn(f64) -> f64; 2]) -> Result<Bench, Failure> {
    let mut bench = Bench::switch_on(build)?;
    let bodies =
        (0..2).map(|index| Body::new(HEATERS[index], SENSORS[index], WARMS[index], sensors[index]));
    bench.plant.bodies = bodies.collect();
    bench.hear_banner()?;
    Ok(bench)
}

/// Lines of a part: the feeder is on for the second and the fourth move.
const PART: &str =
    "G21G90\nM140S205\nM104S255\nM190S205\nM109S255\nG0X-1\nM62P0\nG1X-5Y3F900\nM63P0\n\
    G1Z0.5F180\nM62P0\nG1X0\nM63P0\nG0Y0\nM30\n";
/// An output changes when one line ends and the next begins: at most 2 µs after the edge of the
/// first line's last step.
const WITH_ITS_STEP: u64 = 336;
/// The steps before the line that feeds: 1 mm of X is 312.5 steps, rounded away from zero.
const BEFORE_FEEDING: usize = 313;

/// The carriages of machine 001.
pub(super) const PROTOTYPER: [Carriage; 3] = [(0, 3125, 313), (1, -3125, 313), (2, -625, 313)];

/// Switches machine 001 on.
pub(super) fn boot_prototyper(build: &Build) -> Result<Bench, Failure> {
    boot_cold(build, [nozzle_amplifier, bed_amplifier])
}

/// Steps of lines, which show the direction of a motor only while it steps.
fn of_lines(steps: &[Step]) -> Vec<Step> {
    let of = |step: &Step| Step {
        negative: step.negative & step.motors,
        ..*step
    };
    steps.iter().map(of).collect()
}

/// As [`of_lines`], of the simulator's steps.
fn of_lines_planned(planned: &[Planned]) -> Vec<Planned> {
    let of = |step: &Planned| Planned {
        negative: step.negative & step.motors,
        ..*step
    };
    planned.iter().map(of).collect()
}

/// The time for which the motors may have current at rest, s: `$1` is 25 ms.
const IDLE: f64 = 0.05;
/// The time between the changes of two motors' lines in one step event at most, cycles: 0.3 µs.
const MOST_SKEW: u64 = 50;

/// Checks that each store to the lines made a step to a neighbouring state of the document, or
/// switched the current, and that no current flows once the motors have rested. Returns how far
/// apart the motors of one step event were at most, cycles.
fn ensure_lines(bench: &mut Bench) -> Result<u64, Failure> {
    bench.run_for(IDLE)?;
    let (faults, phases) = (&bench.pins.faults, &bench.pins.phases);
    ensure(faults.is_empty(), || {
        format!("lines at no state that may follow, at the cycles {faults:?}")
    })?;
    ensure(
        phases.len() == 3 && phases.iter().all(Phases::is_off),
        || format!("lines at rest: {phases:?}"),
    )?;
    let skew = bench.pins.extremes.skew;
    ensure(skew <= MOST_SKEW, || {
        format!("lines of one step event are {skew} cycles apart")
    })?;
    Ok(skew)
}

/// Machine 001 heats, feeds from step to step, and is safe when a sensor breaks or the main loop
/// hangs.
fn prototyper(build: &Build) -> Result<String, Failure> {
    let mut bench = boot_prototyper(build)?;
    home(&mut bench, &PROTOTYPER)?;
    relay_sticks(&mut bench.clone())?;
    let cold = bench.say("M62P0")?;
    ensure(
        cold.last().is_some_and(|line| line.starts_with("error:")),
        || format!("feeds while it is cold: {cold:?}"),
    )?;
    let job = Job::new("part", ZERO, PART);
    bench.machine.record_services();
    let steps = run(&mut bench, &job)?;
    let longest = Interrupts::of(&bench).longest();
    compare::to_the_tick(&of_lines(&steps), &of_lines_planned(&plan("001", &job)?))?;
    let skew = ensure_lines(&mut bench)?;
    let switched = bench.pins.others.iter().filter(|edge| edge.pin == OUTPUT);
    let levels: Vec<bool> = switched.clone().map(|edge| edge.level).collect();
    ensure(levels == [true, false, true, false], || {
        format!("the feeder is switched {levels:?}")
    })?;
    let nearest = |cycle: u64| {
        let distances = steps.iter().map(|step| step.edge().abs_diff(cycle));
        distances.zip(1..).min().unwrap_or((u64::MAX, 0))
    };
    let changes: Vec<(u64, usize)> = switched.map(|edge| nearest(edge.cycle)).collect();
    let farthest = changes.iter().map(|(cycles, _)| *cycles).max().unwrap_or(0);
    let first = changes.first().map(|(_, step)| *step);
    ensure(
        farthest <= WITH_ITS_STEP && first == Some(BEFORE_FEEDING),
        || format!("the feeder changes by steps, cycles from them and their numbers: {changes:?}"),
    )?;
    let broken = sensor_breaks(&mut bench.clone())?;
    let reported = fault_is_reported(&mut bench.clone())?;
    let hung = main_loop_hangs(&mut bench)?;
    Ok(format!(
        "{} step events to the tick, the lines of one within {skew} cycles, a tick {longest} at most, the feeder {farthest} cycles from a \
         line's border; heaters off {broken:.0} ms \
         after a sensor breaks, {reported:.0} ms after a reported fault, {hung:.0} ms after the main loop hangs",
        steps.len()
    ))
}

/// Switches both heaters on.
fn warm_up(bench: &mut Bench) -> Result<(), Failure> {
    bench.commands("M104S260\nM140S210\n")?;
    bench.run_for(0.3)?;
    let on = HEATERS.map(|pin| bench.machine.level(pin));
    ensure(on == [true, true], || format!("heaters are {on:?}"))
}

/// The time from now until both heaters are off, ms.
pub(super) fn until_off(bench: &mut Bench, seconds: f64) -> Result<f64, Failure> {
    let begin = bench.machine.cycle();
    let end = begin + cycles(seconds);
    while HEATERS.iter().any(|pin| bench.machine.level(*pin)) {
        let now = bench.machine.cycle();
        ensure(now < end, || "the heaters stay on".into())?;
        bench.run_to(now + cycles(0.0005))?;
    }
    Ok(micros_between(begin, bench.machine.cycle()) / 1e3)
}

/// The wire of the nozzle's sensor breaks, and the amplifier's output goes up: within two readings
/// the alarm of that fault must come.
fn sensor_breaks(bench: &mut Bench) -> Result<f64, Failure> {
    warm_up(bench)?;
    bench.plant.bodies[0].share = |_| 1.0;
    let off = until_off(bench, 0.3)?;
    bench.hear_until(0.1, |line| line == "ALARM:220")?;
    Ok(off)
}

/// Another controller closes the input for faults.
fn fault_is_reported(bench: &mut Bench) -> Result<f64, Failure> {
    warm_up(bench)?;
    let now = bench.machine.cycle();
    bench.machine.pin_at(now + 100, HEATER_FAULT, false);
    let off = until_off(bench, 0.3)?;
    bench.hear_until(0.1, |line| line == "ALARM:225")?;
    Ok(off)
}

/// The time for which a heater may get warmer while it is off, s: twice the time that the nozzle's
/// monitor waits.
const STUCK: f64 = 40.0;

/// The relay of the cold nozzle sticks, and the nozzle slowly gets warmer: the supply must go off.
fn relay_sticks(bench: &mut Bench) -> Result<(), Failure> {
    let nozzle = &mut bench.plant.bodies[0];
    (nozzle.is_stuck, nozzle.warms) = (true, 1.0);
    let before = bench.machine.level(HEATER_SUPPLY);
    bench.hear_until(STUCK, |line| line == "ALARM:224")?;
    let levels = [before, bench.machine.level(HEATER_SUPPLY)];
    ensure(levels == [true, false], || {
        format!("the supply was and is {levels:?}")
    })
}

/// The main loop hangs, and nobody feeds the watchdog, which is at its slowest: the chip must be
/// reset with its heaters off.
fn main_loop_hangs(bench: &mut Bench) -> Result<f64, Failure> {
    warm_up(bench)?;
    bench.machine.set_lsi(LSI_SLOWEST_HZ);
    bench.run_for(0.05)?;
    let replaced = plant(bench, &FOR_EVER)?;
    let off = until_off(bench, HUNG)?;
    hear_restart(bench, replaced)?;
    Ok(off)
}

/// The time for which heaters may stay on after the main loop hangs, s.
const HUNG: f64 = 0.05;

/// Lines of a print: X, Y, Z and the filament, which moves alone at the end.
const PRINT: &str = "G21G90G94\nM109S200\nG1Z0.3F300\nG1X8E0.4F3000\nY6E0.7\nX0E1.1\nG1E0.5F1200\nM106\nG0Z2\nM107\nM30\n";

/// The carriages of machine 004; filament has none.
pub(super) const PRINTER: [Carriage; 3] = [(0, -800, 160), (1, -1600, 160), (2, -2000, 800)];

/// Switches machine 004 on.
pub(super) fn boot_printer(build: &Build) -> Result<Bench, Failure> {
    boot_cold(build, [thermistor, thermistor])
}

/// Machine 004 prints with four motors, which must agree to the tick.
fn printer(build: &Build) -> Result<String, Failure> {
    let mut bench = boot_printer(build)?;
    home(&mut bench, &PRINTER)?;
    let job = Job::new("print", ZERO, PRINT);
    let steps = run(&mut bench, &job)?;
    compare::to_the_tick(&steps, &plan("004", &job)?)?;
    let [.., e] = compare::ways(&steps);
    // 95 steps/mm: 1.1 mm out, 0.6 mm back.
    ensure(e == [105, -57], || format!("the filament goes {e:?}"))?;
    Ok(format!(
        "{} step events of four motors to the tick",
        steps.len()
    ))
}

/// The check of a machine; it answers the sentence for the report.
type Of = fn(&Build) -> Result<String, Failure>;

pub(crate) fn machines(firmware: &Firmware) -> Result<Figures, Failure> {
    let mut figures = Figures::default();
    let checks: [Of; 5] = [laser, prototyper, drill, engraver, printer];
    for (number, check) in checks.iter().enumerate() {
        let done = check(firmware.build(&format!("machine-file-00{number}"))?);
        figures.add(
            format!("00{number}"),
            done.map_err(|Failure(words)| Failure(format!("00{number}: {words}")))?,
        );
    }
    Ok(figures)
}
