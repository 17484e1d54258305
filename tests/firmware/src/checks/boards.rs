//! The builds for other boards. Each boots, makes a recorded program's steps at its own pins,
//! homes, dims its laser, engraves a row, and stops for a reset.
use super::{
    board_jobs::{ensure_engraves, ensure_stops},
    homing::{ensure_homes, Belts},
    machines::{self, Carriage},
    motion, start_up, Figures,
};
use crate::{
    bench::{ensure, Bench, Failure},
    compare,
    desk::{self, Planned},
    firmware::{Build, Firmware},
    job::{self, Job},
    pins::CPU_HZ,
    wiring::Wiring,
};
use leadscrew_planner::{Cartesian, CoreXy, Kinematics};
use leadscrew_sim::{profile::Profile, Rate};

/// A recorded program that steps three motors together.
const TRACE: &str = "line_xyz";
/// The steps from each carriage to its limit switch at power-up. The second motor of Y has another
/// number, because the gantry is askew.
pub(super) const AWAY: [i64; 4] = [700, 1300, 411, 1337];
/// The frequency of the power output for which each build is made, Hz, and the number of levels
/// above off at that frequency, as `crates/board-f407/src/pwm.rs` states them. Machine 003 has TIM1
/// and the SKR 2 TIM9, both on APB2.
const MACHINE_003_POWER: (u64, u64) = (50, 64_615);
pub(super) const SKR_2_POWER: (u64, u64) = (10_000, 16_800);
const CORE_XY_POWER: (u64, u64) = (1_000, 56_000);
/// The Octopus and the Spider have TIM4, on APB1. The Fly-407ZG and the Robin Nano V3 have TIM1.
pub(super) const MORE_POWER: [(&str, (u64, u64)); 4] = [
    ("octopus", (10_000, 8_400)),
    ("fly-407zg", (10_000, 16_800)),
    ("spider", (10_000, 8_400)),
    ("robin-nano-v3", (10_000, 16_800)),
];
const DUAL_Y_POWER: (u64, u64) = (100_000, 1_680);

/// The two motors of Y on boards with a fourth motor.
const SECOND_Y: (usize, usize) = (1, 3);

/// Makes a fourth motor, if there is one, move as Y does.
fn gang(planned: &mut [Planned], wiring: &Wiring) {
    let (first, second) = SECOND_Y;
    if wiring.step.len() > second {
        for step in planned {
            step.motors |= (step.motors >> first & 1) << second;
            step.negative |= (step.negative >> first & 1) << second;
        }
    }
}

/// Settings that are the same for each axis, since profiles differ in theirs, and a job that steps
/// all motors together.
const EQUAL: &str = "$0=5\n$100=250\n$101=250\n$102=250\n$110=1000\n$111=1000\n$112=1000\n$120=50\n$121=50\n$122=50\n";
const TOGETHER: &str = "G91G1X10Y10Z10F900\n";

/// Runs two queued jobs that must agree to the tick: a recorded one, and one that steps all motors
/// at once. Returns the sentence for the report.
fn ensure_traces(
    build: &Build,
    kinematics: impl Kinematics<3, 3> + Clone,
) -> Result<String, Failure> {
    let trace = Job::trace(TRACE)?;
    let job = Job::new("together", EQUAL, TOGETHER);
    let mut words = String::new();
    for job in [trace, job] {
        let (bench, steps) = motion::run_queued(build, &job)?;
        let settings = format!("{}{}", job.settings, motion::AFTER_ALL);
        let kinematics = kinematics.clone();
        let mut planned = desk::plan_with(
            kinematics,
            build.timing,
            &settings,
            &job.program,
            Rate::NeverWaits,
        )?;
        gang(&mut planned, build.wiring);
        compare::to_the_tick(&steps, &planned)?;
        let skew = bench.pins.extremes.skew;
        words += &format!(
            "{}: {} step events to the tick, pins {skew} cycles apart; ",
            job.name,
            steps.len()
        );
    }
    Ok(words)
}

/// Checks the power output: at half of the power it is high for half of the period, and at full
/// power always, each within a level. The period may be off by less than a level; it is exact if
/// the timer's clock is a multiple of the frequency. Spindle and supplies are on.
fn ensure_outputs(build: &Build, (hz, levels): (u64, u64)) -> Result<(), Failure> {
    let mut bench = Bench::boot(build)?;
    bench.commands("$30=1000\n$31=0\n")?;
    let wiring = build.wiring;
    let period = CPU_HZ / hz;
    let level = period / levels;
    for (speed, expected) in [(500, period / 2), (1000, period), (250, period / 4)] {
        bench.command(&format!("M3S{speed}"))?;
        bench.run_for(0.01)?;
        let mut duties = bench.machine.duties().iter().rev();
        let duty = duties.find(|duty| duty.pin == wiring.power);
        let right = duty.is_some_and(|duty| {
            duty.high.abs_diff(expected) <= level && duty.period.abs_diff(period) < level
        });
        ensure(right, || format!("S{speed} at {hz} Hz: {duty:?}"))?;
    }
    let high = wiring.high.iter().chain([&wiring.spindle]);
    for pin in high {
        ensure(bench.machine.level(*pin), || format!("{pin} is low"))?;
    }
    Ok(())
}

/// Checks that a host sets the board up over USB and is answered.
fn ensure_talks_usb(build: &Build) -> Result<(), Failure> {
    let mut bench = Bench::boot(build)?;
    bench.plug_usb()?;
    bench.command("$G").map(|_| ())
}

/// Runs all checks of one board.
pub(super) fn ensure_works<const MOTORS: usize>(
    build: &Build,
    belts: Belts,
    power: (u64, u64),
    away: [i64; MOTORS],
    homed: &str,
) -> Result<String, Failure> {
    let traced = match belts {
        Belts::Straight => ensure_traces(build, Cartesian)?,
        Belts::Crossed => ensure_traces(build, CoreXy)?,
    };
    ensure_talks_usb(build)?;
    ensure_outputs(build, power)?;
    ensure_engraves(build, power)?;
    ensure_stops(build)?;
    let homed = ensure_homes(build, belts, away, homed)?;
    Ok(format!("{traced}{homed}"))
}

pub(crate) fn boards(firmware: &Firmware) -> Result<Figures, Failure> {
    let [x, y, z, _] = AWAY;
    let all = "<Idle|MPos:-1.000,-1.000,-1.000|";
    let only_z = "<Idle|MPos:0.000,0.000,-1.000|";
    let mut figures = Figures::default();
    let (straight, crossed) = (Belts::Straight, Belts::Crossed);
    for (name, works) in [
        (
            "machine-003",
            ensure_works(
                firmware.build("machine-003")?,
                straight,
                MACHINE_003_POWER,
                [x, y, z],
                only_z,
            ),
        ),
        (
            "skr-2",
            ensure_works(
                firmware.build("skr-2")?,
                straight,
                SKR_2_POWER,
                [x, y, z],
                all,
            ),
        ),
        (
            "core-xy",
            ensure_works(
                firmware.build("core-xy")?,
                crossed,
                CORE_XY_POWER,
                [x, y, z],
                all,
            ),
        ),
        (
            "dual-y",
            ensure_works(firmware.build("dual-y")?, straight, DUAL_Y_POWER, AWAY, all),
        ),
    ] {
        figures.add(
            name,
            works.map_err(|Failure(words)| Failure(format!("{name}: {words}")))?,
        );
    }
    Ok(figures)
}

/// The boards that were added later: the same checks, and their pins must be safe from the start.
pub(crate) fn more(firmware: &Firmware) -> Result<Figures, Failure> {
    let [x, y, z, _] = AWAY;
    let all = "<Idle|MPos:-1.000,-1.000,-1.000|";
    let mut figures = Figures::default();
    for (name, power) in MORE_POWER {
        let build = firmware.build(name)?;
        let safe = start_up::ensure_off_at_once(build, &[])?;
        let works = ensure_works(build, Belts::Straight, power, [x, y, z], all);
        let works = works.map_err(|Failure(words)| Failure(format!("{name}: {words}")))?;
        figures.add(name, format!("{works}; {safe}"));
    }
    let build = firmware.build("six-axes")?;
    figures.add("six axes", ensure_axes(build, &SIX_AXES)?);
    Ok(figures)
}

/// A machine with more than three axes.
pub(super) struct Axes {
    /// Its file in `tests/firmware`.
    file: &'static str,
    /// Its places after homing, as the status report shows them.
    homed: &'static str,
    /// A job that moves all axes.
    program: &'static str,
}

/// All axes together, then the rotary table alone, in both directions.
pub(super) const FOUR_AXES: Axes = Axes {
    file: "four_axes.toml",
    homed: "|MPos:-1.000,-1.000,-1.000,0.000|",
    program: "G21G91G94\nG1X-4Y-2Z-1A90F1000\nA-45F3000\nX2Y1Z0.5A360\nG0X-1A-30\n",
};

/// As [`FOUR_AXES`], with a table that tilts and a head that turns.
const SIX_AXES: Axes = Axes {
    file: "six_axes.toml",
    homed: "|MPos:-1.000,-1.000,-1.000,0.000,0.000,0.000|",
    program: "G21G91G94\nG1X-4Y-2Z-1A90B-20C45F1000\nA-45B15C-90F3000\nX2Y1Z0.5A360B30\n\
        G0X-1A-30B-5C10\n",
};

/// The carriages of these machines: rotary axes have no switch.
const CARRIAGES: [Carriage; 3] = [(0, 750, 250), (1, 1250, 250), (2, 500, 250)];

impl Axes {
    /// The machine.
    pub(super) fn profile(&self) -> Result<Profile, Failure> {
        let folder = job::repository().join("tests/firmware");
        Ok(Profile::load(&folder.join(self.file))?)
    }
}

/// Checks a machine with more than three axes: it homes, reports all axes, and steps them to the
/// tick.
pub(super) fn ensure_axes(build: &Build, axes: &Axes) -> Result<String, Failure> {
    let mut bench = Bench::boot(build)?;
    machines::home(&mut bench, &CARRIAGES)?;
    let status = bench.status()?;
    ensure(status.contains(axes.homed), || status.clone())?;
    let turns = Job::new("turns", "$701=500\n", axes.program);
    let steps = machines::run(&mut bench, &turns)?;
    let before = format!("$H\n{}", turns.settings);
    compare::to_the_tick(
        &steps,
        &desk::plan_machine_with(&axes.profile()?, build.timing, &before, &turns.program)?,
    )?;
    ensure_stops(build)?;
    Ok(format!("{} step events to the tick", steps.len()))
}
