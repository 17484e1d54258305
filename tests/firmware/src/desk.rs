//! The same job in the simulator, on a CPU that takes no time: the steps as the timer's schedule has them.
use crate::{
    bench::{ensure, Failure},
    pins::CYCLES_PER_COUNT,
};
use leadscrew_machine::config::MachineConfig;
use leadscrew_planner::Cartesian;
use leadscrew_sim::{
    cost::Costs, Answers, Cycle, Memory, Observer, Rate, Setup, Simulation, StepEvent, Stopped,
    Streamer, Streaming,
};

/// Moves planned ahead, as on the board.
const MOVES: usize = 1024;
/// Later than the end of any job.
const LIMIT: Cycle = Cycle::from_micros(3_600_000_000);

/// One step event as it is scheduled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Planned {
    /// Counts of the step timer since power-up.
    pub(crate) due: u64,
    /// Motors that step, a bit each.
    pub(crate) motors: u8,
    /// Motors whose direction is negative, a bit each.
    pub(crate) negative: u8,
    /// The first one after a rest: the main loop says when it comes.
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

/// The step events of a program after `settings`.
pub(crate) fn plan(settings: &str, program: &str) -> Result<Vec<Planned>, Failure> {
    let mut setup = Setup::<3>::new(MachineConfig::new(), Rate::NeverWaits);
    setup.costs = Costs::NONE;
    let mut memory = Memory::<3>::new(&setup);
    let mut sim: Simulation<'_, _, _, 3, 3, MOVES> =
        Simulation::new(&mut memory, &setup, Cartesian, Schedule::default());
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
