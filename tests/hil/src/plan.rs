//! Runs the same job in the simulator, on a CPU that takes no time: steps and changes of power come
//! exactly at their scheduled instants.
use crate::failure::{fail, Failure};
use leadscrew_machine::config::MachineConfig;
use leadscrew_planner::Cartesian;
use leadscrew_sim::{
    cost::Costs, Answers, Cycle, Memory, Observer, Rate, Setup, Simulation, StepEvent, Stopped,
    Streamer, Streaming,
};
use leadscrew_stepper::{MotorMask, Power};

/// CPU cycles in a count of the board's timers.
const CYCLES_PER_COUNT: u64 = 2;
/// Moves planned ahead: enough for the jobs of this program, here and on the board.
const MOVES: usize = 256;
/// Later than the end of any job.
const LIMIT: Cycle = Cycle::from_micros(60_000_000);

/// One step event.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Planned {
    /// The instant in counts of the step timer.
    pub(crate) due: u64,
    /// The motors that step, one bit each.
    motors: u8,
    /// The motors whose direction is negative, one bit each.
    pub(crate) negative: u8,
}

/// A job's schedule.
#[derive(Clone, Default, Debug)]
pub(crate) struct Plan {
    steps: Vec<Planned>,
    /// The counts at which the direction of X changes.
    turns: Vec<u64>,
    negative: bool,
    /// The changes of the power: the count, and the share of full power from then on.
    power: Vec<(u64, f64)>,
}

impl Observer for Plan {
    fn step(&mut self, event: &StepEvent) {
        self.steps.push(Planned {
            due: event.cycle.0 / CYCLES_PER_COUNT,
            motors: event.motors.bits(),
            negative: event.negative.bits(),
        });
    }

    fn direction(&mut self, cycle: Cycle, negative: MotorMask) {
        let negative = negative.bits() & 1 != 0;
        if std::mem::replace(&mut self.negative, negative) != negative {
            self.turns.push(cycle.0 / CYCLES_PER_COUNT);
        }
    }

    fn power(&mut self, cycle: Cycle, power: Power) {
        let share = power.share().to_num::<f64>();
        self.power.push((cycle.0 / CYCLES_PER_COUNT, share));
    }
}

impl Plan {
    /// The step events of a motor.
    pub(crate) fn of(&self, motor: usize) -> Vec<Planned> {
        let steps = self.steps.iter();
        let ours = steps.filter(|step| step.motors >> motor & 1 != 0);
        ours.copied().collect()
    }

    /// The counts at which the direction of X changes.
    pub(crate) fn turns(&self) -> &[u64] {
        &self.turns
    }

    /// The count at which the power first goes on, and the one at which it goes off for good.
    pub(crate) fn lit(&self) -> Option<(u64, u64)> {
        let on = self.power.iter().find(|(_, share)| *share > 0.0)?.0;
        let (off, share) = *self.power.last()?;
        (share == 0.0).then_some((on, off))
    }

    /// The energy of the whole job, in counts of full power: each count times its share.
    pub(crate) fn energy(&self) -> f64 {
        let pairs = self.power.iter().zip(self.power.iter().skip(1));
        pairs
            .map(|((from, share), (to, _))| share * (to - from) as f64)
            .sum()
    }
}

/// Simulates `program` after `settings`, each line of both answered with `ok`.
///
/// # Errors
/// The simulator refuses a line, or finds an event late.
pub(crate) fn plan(settings: &str, program: &str) -> Result<Plan, Failure> {
    let mut setup = Setup::<3>::new(MachineConfig::new(), Rate::NeverWaits);
    setup.costs = Costs::NONE;
    let mut memory = Memory::<3, 3, MOVES>::new(&setup);
    let mut sim: Simulation<'_, _, _, 3, 3, MOVES> =
        Simulation::new(&mut memory, &setup, Cartesian, Plan::default());
    for text in [settings, program] {
        let streaming = Streaming {
            window: setup.receive_buffer,
            keep_going: false,
        };
        let mut host = Streamer::new(text.as_bytes(), streaming, Answers::default());
        if sim.run_until(&mut host, LIMIT) != Stopped::Quiet {
            return fail("the simulator stands still");
        }
        let answers = host.finish()?;
        if !answers.errors.is_empty() || answers.alarm.is_some() {
            return fail(format!("the simulator refuses: {answers:?}"));
        }
    }
    let (outcome, plan) = sim.finish();
    match outcome.late.is_empty() && outcome.violations.is_empty() {
        true => Ok(plan),
        false => fail("the simulator finds an event late, or a rule broken"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_there_and_back_has_its_steps_and_its_light() {
        let settings = "$32=1\n$30=1000\n$100=100\n";
        let plan = plan(settings, "M4S500\nG91G1X1F300\nX-0.5\nM5\n").unwrap();
        let x = plan.of(0);
        assert_eq!(x.len(), 150);
        assert!(x[..100].iter().all(|step| step.negative == 0));
        assert!(x[100..].iter().all(|step| step.negative == 1));
        assert!(plan.of(1).is_empty());
        assert!(matches!(plan.turns(), [turn] if (x[99].due..x[100].due).contains(turn)));
        let (on, off) = plan.lit().unwrap();
        assert!(on <= x[0].due && off >= x[149].due, "{on} {off} {x:?}");
        let all = (off - on) as f64;
        assert!(plan.energy() > 0.1 * all && plan.energy() < 0.5 * all);
    }
}
