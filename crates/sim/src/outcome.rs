//! The results of a simulation: everything that a summary or a test asks about a job.

use crate::board::PARTS;
use crate::clock::{micros, seconds, Cycle};
use crate::event_loop::Simulation;
use crate::load::CpuLoad;
use crate::observer::Observer;
use crate::streamer::{Replies, Reply};
use crate::trouble::{Late, Record, Violation};
use leadscrew_machine::extension::Extension;
use leadscrew_planner::Kinematics;

/// The results of one motor.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MotorOutcome {
    /// Steps in either direction.
    pub pulses: u64,
    /// Steps in the positive direction less those in the negative.
    pub net_steps: i64,
    /// Highest rate in steps/s, measured over 16 steps.
    pub peak_hz: f64,
}

impl MotorOutcome {
    /// A motor that the machine lacks.
    const NONE: Self = Self {
        pulses: 0,
        net_steps: 0,
        peak_hz: 0.0,
    };
}

/// The results of a simulation.
#[derive(Clone, PartialEq, Debug)]
pub struct Outcome<const MOTORS: usize> {
    /// Time from the first byte to the board until motion rests and all answers have been sent, s.
    pub job_seconds: f64,
    /// The time of the first byte, at which `job_seconds` begins.
    pub first_byte: Cycle,
    /// `job_seconds` in CPU cycles.
    pub job_cycles: u64,
    /// Time from the begin of the first move until motion rests, s; 0 if nothing moved.
    pub motion_seconds: f64,
    /// Time from the first to the last step, s; 0 if there was no step. An oscilloscope shows it.
    pub step_seconds: f64,
    /// Each motor.
    pub motors: [MotorOutcome; MOTORS],
    /// Instants at which at least one motor steps.
    pub step_events: u64,
    /// Ticks at which no motor steps.
    pub smoothing_ticks: u64,
    /// Steps of the dominant motor of each move, added up.
    pub dominant_step_events: u64,
    /// The highest of the motors' rates, steps/s.
    pub peak_step_hz: f64,
    /// The shortest pulse, µs.
    pub min_pulse_us: Option<f64>,
    /// The shortest time from a motor's change of direction to its next step, µs.
    pub min_direction_setup_us: Option<f64>,
    /// The longest time by which an earlier interrupt delayed a step, µs.
    pub max_step_delay_us: f64,
    /// Late events.
    pub late: Record<Late>,
    /// Violations of the rules.
    pub violations: Record<Violation>,
    /// The load of the CPU since power-up.
    pub cpu: CpuLoad,
    /// Levels of the synchronised outputs, a bit each, and how often any of them has changed.
    pub outputs: (u8, u64),
    /// CPU cycles since power-up.
    pub cycles: u64,
}

impl<const MOTORS: usize> Outcome<MOTORS> {
    /// Returns the same outcome with `MORE` motors; those that the machine lacks did nothing.
    pub fn with_motors<const MORE: usize>(self) -> Outcome<MORE> {
        let motors = std::array::from_fn(|motor| {
            let of = self.motors.get(motor);
            of.copied().unwrap_or(MotorOutcome::NONE)
        });
        Outcome {
            motors,
            job_seconds: self.job_seconds,
            first_byte: self.first_byte,
            job_cycles: self.job_cycles,
            motion_seconds: self.motion_seconds,
            step_seconds: self.step_seconds,
            step_events: self.step_events,
            smoothing_ticks: self.smoothing_ticks,
            dominant_step_events: self.dominant_step_events,
            peak_step_hz: self.peak_step_hz,
            min_pulse_us: self.min_pulse_us,
            min_direction_setup_us: self.min_direction_setup_us,
            max_step_delay_us: self.max_step_delay_us,
            late: self.late,
            violations: self.violations,
            cpu: self.cpu,
            outputs: self.outputs,
            cycles: self.cycles,
        }
    }
}

impl<K, O, X, const AXES: usize, const MOTORS: usize, const MOVES: usize>
    Simulation<'_, K, O, AXES, MOTORS, MOVES, X>
where
    K: Kinematics<AXES, MOTORS> + Clone,
    O: Observer,
    X: Extension<AXES>,
{
    /// Ends the simulation; returns its results and the observer.
    pub fn finish(self) -> (Outcome<MOTORS>, O) {
        (self.outcome(), self.board.observer)
    }

    /// Returns the results so far.
    pub fn outcome(&self) -> Outcome<MOTORS> {
        let board = &self.board;
        let motors = self.motors();
        let job_cycles = board.last_rest.max(self.last_byte) - self.first_byte;
        Outcome {
            job_seconds: seconds(job_cycles),
            first_byte: self.first_byte,
            job_cycles,
            motion_seconds: seconds(board.last_rest - board.first_start),
            step_seconds: seconds(board.last_step - board.first_step),
            motors,
            step_events: board.counts.step_events,
            smoothing_ticks: board.counts.smoothing_ticks(),
            dominant_step_events: board.counts.dominant_parts / PARTS,
            peak_step_hz: motors.iter().map(|motor| motor.peak_hz).fold(0.0, f64::max),
            min_pulse_us: board.plant.shortest_pulse().map(micros),
            min_direction_setup_us: board.plant.shortest_setup().map(micros),
            max_step_delay_us: micros(board.counts.longest_delay),
            late: board.late.clone(),
            violations: board.violations.clone(),
            cpu: self.cpu.load(self.now()),
            outputs: (board.shown_outputs, board.counts.output_changes),
            cycles: (self.now() - Cycle::ZERO),
        }
    }

    fn motors(&self) -> [MotorOutcome; MOTORS] {
        let plant = &self.board.plant;
        let (pulses, net, peak) = (plant.pulses(), plant.net_steps(), plant.peak_rates());
        std::array::from_fn(|motor| {
            let inverted = self.board.turned().contains(motor);
            MotorOutcome {
                pulses: pulses[motor],
                net_steps: if inverted { -net[motor] } else { net[motor] },
                peak_hz: peak[motor],
            }
        })
    }
}

/// A line that was refused.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LineError {
    /// Its number in the program, from 1.
    pub line: u64,
    /// GRBL's number.
    pub code: u8,
    /// The line as it was sent.
    pub text: String,
}

/// The answers of the machine to a program, to be read after its end.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Answers {
    /// Lines that were answered.
    pub lines: u64,
    /// Lines that were refused.
    pub errors: Record<LineError>,
    /// The alarm that ended the program.
    pub alarm: Option<u8>,
}

impl Replies for Answers {
    fn reply(&mut self, reply: &Reply<'_>, _: Cycle) {
        match *reply {
            Reply::Ok { .. } => self.lines += 1,
            Reply::Error { line, code, text } => {
                self.lines += 1;
                let text = String::from_utf8_lossy(text).into_owned();
                self.errors.push(LineError { line, code, text });
            }
            Reply::Alarm { code, .. } => self.alarm = self.alarm.or(Some(code)),
            Reply::Other(_) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_counted_errors_kept_and_the_first_alarm_remembered() {
        let mut answers = Answers::default();
        answers.reply(&Reply::Ok { line: 1 }, Cycle::ZERO);
        let error = Reply::Error {
            line: 2,
            code: 20,
            text: b"G77",
        };
        answers.reply(&error, Cycle::ZERO);
        for code in [1, 3] {
            let alarm = Reply::Alarm {
                code,
                line: 3,
                text: b"G0X1",
            };
            answers.reply(&alarm, Cycle::ZERO);
        }
        assert_eq!((answers.lines, answers.alarm), (2, Some(1)));
        assert_eq!(answers.errors.first()[0].text, "G77");
    }
}
