//! Runs the same job in the simulator, on a CPU that takes no time: the steps come exactly at the
//! timer's scheduled instants.
use crate::{
    bench::{ensure, Failure},
    pins::CYCLES_PER_COUNT,
};
use leadscrew_machine::{board::ChannelId, config::MachineConfig, step_timing::StepTiming};
use leadscrew_planner::{Cartesian, Kinematics};
use leadscrew_sim::PowerUp;
use leadscrew_sim::{
    cost::Costs,
    plant::{Pin, Side, Switch},
    powered::{Powered, Supply},
    profile::Profile,
    Answers, Cycle, Host, Memory, Observer, Rate, Reply, Setup, Simulation, StepEvent, Stopped,
    Streamer, Streaming,
};

/// Moves planned ahead, as on the board.
const MOVES: usize = 1024;
/// Later than the end of any job.
const LIMIT: Cycle = Cycle::from_micros(3_600_000_000);

/// One step event as it is scheduled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Planned {
    /// The instant in counts of the step timer since power-up.
    pub(crate) due: u64,
    /// The motors that step, one bit each.
    pub(crate) motors: u8,
    /// The motors whose direction is negative, one bit each.
    pub(crate) negative: u8,
    /// True if it is the first one after a rest: the main loop decides when it comes.
    pub(crate) first: bool,
}

#[derive(Default)]
struct Schedule {
    steps: Vec<Planned>,
    rested: bool,
}

impl Observer for Schedule {
    fn step(&mut self, event: &StepEvent) {
        self.steps.push(Planned {
            due: event.cycle.0 / CYCLES_PER_COUNT,
            motors: event.motors.bits(),
            negative: event.negative.bits(),
            first: self.steps.is_empty() || self.rested,
        });
        self.rested = false;
    }

    fn running(&mut self, _: Cycle, running: bool) {
        self.rested |= !running;
    }
}

/// The simulator's `[PRB:…]` for a probing in the negative direction of Z that meets something
/// after `contact` steps.
pub(crate) fn probe(settings: &str, program: &str, contact: usize) -> Result<String, Failure> {
    let mut setup = Setup::<3>::new(MachineConfig::new(), Rate::NeverWaits);
    setup.costs = Costs::NONE;
    let mut memory = Memory::new(&setup);
    let mut sim: Simulation<'_, _, _, 3, 3, MOVES> =
        Simulation::new(&mut memory, &setup, Cartesian, Schedule::default());
    sim.add_switch(Switch {
        pin: Pin::Probe,
        motor: 2,
        side: Side::AtOrBelow,
        place: -i32::try_from(contact)?,
        level: false,
    });
    let mut report = None;
    for text in [settings, program] {
        let streaming = Streaming {
            window: setup.receive_buffer,
            keep_going: false,
        };
        let replies = |reply: &Reply<'_>, _: Cycle| {
            if let Reply::Other(line) = reply {
                let line = String::from_utf8_lossy(line);
                report = line
                    .starts_with("[PRB:")
                    .then(|| line.trim().to_owned())
                    .or(report.take());
            }
        };
        let mut host = Streamer::new(text.as_bytes(), streaming, replies);
        let stopped = sim.run_until(&mut host, LIMIT);
        ensure(stopped == Stopped::Quiet && host.is_done(), || {
            "the simulator stands still".into()
        })?;
    }
    report.ok_or_else(|| Failure("the simulator says nothing of the probe".into()))
}

/// The step events of a program after `settings`, over a line of this rate. Over a slow line fewer
/// moves have come when motion begins. The machine then looks less far ahead, and motion takes
/// longer, here and on the board.
pub(crate) fn plan(settings: &str, program: &str, line: Rate) -> Result<Vec<Planned>, Failure> {
    plan_with(Cartesian, StepTiming::F407, settings, program, line)
}

/// As [`plan`], with other kinematics, and other times of making steps.
pub(crate) fn plan_with(
    kinematics: impl Kinematics<3, 3> + Clone,
    timing: StepTiming,
    settings: &str,
    program: &str,
    line: Rate,
) -> Result<Vec<Planned>, Failure> {
    let config = MachineConfig {
        step_timing: timing,
        ..MachineConfig::new()
    };
    let mut setup = Setup::<3>::new(config, line);
    setup.costs = Costs::NONE;
    let mut memory = Memory::<3, 3>::new(&setup);
    let mut sim: Simulation<'_, _, _, 3, 3, MOVES> =
        Simulation::new(&mut memory, &setup, kinematics, Schedule::default());
    for text in [settings, program] {
        let streaming = Streaming {
            window: setup.receive_buffer,
            keep_going: false,
        };
        let mut host = Streamer::new(text.as_bytes(), streaming, Answers::default());
        let stopped = sim.run_until(&mut host, LIMIT);
        ensure(stopped == Stopped::Quiet && host.is_done(), || {
            "the simulator stands still".into()
        })?;
        let answers = host.finish()?;
        ensure(answers.errors.is_empty() && answers.alarm.is_none(), || {
            format!("the simulator refuses: {answers:?}")
        })?;
    }
    let (outcome, schedule) = sim.finish();
    ensure(
        outcome.late.is_empty() && outcome.violations.is_empty(),
        || {
            format!(
                "the simulator complains: {:?} {:?}",
                outcome.late.first(),
                outcome.violations.first()
            )
        },
    )?;
    Ok(schedule.steps)
}

/// The step events of a program on the machine of a file, without the events of the lines `before`.
/// All lines must be answered with `ok`. The operator resumes after pauses and tool changes at
/// once.
pub(crate) fn plan_machine(
    profile: &Profile,
    before: &str,
    program: &str,
) -> Result<Vec<Planned>, Failure> {
    plan_machine_with(profile, StepTiming::F407, before, program)
}

/// As [`plan_machine`], on a board with other times of making steps.
pub(crate) fn plan_machine_with(
    profile: &Profile,
    timing: StepTiming,
    before: &str,
    program: &str,
) -> Result<Vec<Planned>, Failure> {
    let mut schedule = Schedule::default();
    let mut begun = Ok(Cycle::default());
    let supply = Supply {
        timing,
        ..profile.supply(Rate::NeverWaits)
    };
    profile.power_up(supply, &mut schedule, &mut |machine| {
        begun = send_all(machine, before, profile.receive_buffer()).and_then(|()| {
            let begun = machine.now();
            send_all(machine, program, profile.receive_buffer()).map(|()| begun)
        });
    });
    let begun = begun?.0 / CYCLES_PER_COUNT;
    schedule.steps.retain(|step| step.due >= begun);
    Ok(schedule.steps)
}

fn send_all(machine: &mut dyn Powered, text: &str, window: u16) -> Result<(), Failure> {
    let streaming = Streaming {
        window: window.into(),
        keep_going: false,
    };
    let mut host = Operator {
        streamer: Streamer::new(text.as_bytes(), streaming, Answers::default()),
        resumes: false,
    };
    loop {
        machine.work(&mut host);
        if !machine.waits_for_operator() {
            break;
        }
        host.resumes = true;
    }
    machine.settle(&mut host);
    let answers = host.streamer.finish()?;
    ensure(answers.errors.is_empty() && answers.alarm.is_none(), || {
        format!("the simulator refuses: {answers:?}")
    })
}

/// A sender whose operator presses resume.
struct Operator<'a> {
    streamer: Streamer<&'a [u8], Answers>,
    resumes: bool,
}

impl Host for Operator<'_> {
    fn next_byte(&mut self, channel: ChannelId) -> Option<u8> {
        match std::mem::take(&mut self.resumes) {
            true => Some(b'~'),
            false => self.streamer.next_byte(channel),
        }
    }

    fn receive(&mut self, channel: ChannelId, byte: u8, now: Cycle) {
        self.streamer.receive(channel, byte, now);
    }

    fn is_done(&self) -> bool {
        self.streamer.is_done()
    }
}
