//! The time that a job takes: lines are planned and segments made, but no steps on pins.

use crate::grbl_timer::GrblTimer;
use crate::life::End;
use crate::machine::Machine;
use crate::stream::Stream;
use leadscrew_sim::link::Rate;
use schemars::JsonSchema;
use serde::Serialize;
use std::io::{self, BufRead};

/// The time that a job takes on a machine.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, JsonSchema)]
pub struct Time {
    /// From the first byte until motion rests and all has been answered, s.
    pub job_seconds: f64,
    /// From the start of the first move until motion rests, s; 0 for a job that moves nothing.
    pub motion_seconds: f64,
    /// From the first step to the last one, s.
    #[serde(skip)]
    pub step_seconds: f64,
    /// How it ends.
    #[serde(skip)]
    pub end: End,
}

/// Times a job called `name`, without a pause between its lines. A run takes the same time, to
/// the tick if its line never waits.
///
/// # Errors
/// If its text cannot be read to its end.
pub fn time(machine: &Machine, rate: Rate, name: &str, text: impl BufRead) -> io::Result<Time> {
    let stream = Stream {
        machine,
        rate,
        // A check has found the lines that are refused.
        keep_going: true,
        feed_percent: 100,
        keep_answers: false,
        warn: false,
        only_times: true,
        knows_place: false,
        tell: |_| {},
    };
    let done = stream.run(name, text, machine.is_grbl.then(GrblTimer::default))?;
    let sooner = done.observer.map_or(0.0, |timer| timer.sooner);
    let share = match sooner > 0.0 {
        true => 1.0 - sooner / done.outcome.motion_seconds,
        false => 1.0,
    };
    Ok(Time {
        job_seconds: done.outcome.job_seconds - sooner,
        motion_seconds: done.outcome.motion_seconds * share,
        step_seconds: done.outcome.step_seconds * share,
        end: done.end,
    })
}
