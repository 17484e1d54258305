//! The use of a job's time, and the settings that would make it faster.

use crate::complaint::Complaint;
use crate::json::{error_json, JsonError, JSON_VERSION};
use crate::life::{End, JsonEnd, Wait};
use crate::machine::{Machine as Chosen, TIMING};
use crate::stream::Streamed;
use crate::words::{duration, waits};
use leadscrew_gcode::Number;
use leadscrew_machine::settings::table::{AxisSetting, Setting};
use leadscrew_machine::settings::values::{Entry, Key};
use leadscrew_sim::clock::{seconds, Cycle};
use leadscrew_sim::profile::Belts;
use leadscrew_sim::speed_profile::{shares, Machine, Recorder, Share, Stretch};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;

/// Limits that are listed one by one; the others are added up.
const LISTED: usize = 12;

/// Returns the same machine without the laser's lead. The lead does not change motion; without it,
/// power is shown at its place on the path.
pub fn without_lead(chosen: &Chosen) -> Chosen {
    let mut settings = chosen.settings.clone();
    settings.load(Entry {
        number: Key::Machine(Setting::LaserLead).number(),
        value: Number::from_int(0),
    });
    chosen.with(&settings)
}

/// Returns the data of the machine from which limits are found.
pub fn limits_of(chosen: &Chosen) -> Machine {
    let pulse = chosen.settings.whole(Setting::StepPulse);
    let pulse_us = u8::try_from(pulse).unwrap_or(u8::MAX);
    let values = |setting| chosen.of_axes(setting).into_iter();
    Machine {
        mm_per_step: values(AxisSetting::StepsPerMm).map(f64::recip).collect(),
        rate: values(AxisSetting::MaxRate)
            .map(|rate| rate / 60.0)
            .collect(),
        acceleration: values(AxisSetting::Acceleration).collect(),
        step_rate: TIMING
            .highest_rate(pulse_us, chosen.file.motor_count())
            .into(),
        crossed: chosen.file.kinematics == Belts::CoreXy,
    }
}

/// A change of settings, and how much time it saves.
#[derive(Clone, PartialEq, Debug, Serialize, JsonSchema)]
pub struct Trial {
    /// The change of settings, for example `$120=400 (now 200)`.
    pub change: String,
    /// The amount by which the job is shorter, s.
    pub seconds_saved: f64,
}

/// The result of a profile.
pub struct ProfileReport {
    file: String,
    /// Letters of the axes, in order.
    pub letters: Vec<char>,
    /// Notes about a file that was imported.
    pub notes: Vec<String>,
    lines: u64,
    errors: Vec<Complaint>,
    error_count: u64,
    alarm: Option<Complaint>,
    end: End,
    waits: Vec<Wait>,
    /// The time at which the first byte came: the start of the job's time.
    pub begin: Cycle,
    /// The job's time from `begin`, cycles.
    pub job_cycles: u64,
    /// The stretches in which one limit binds, if they were kept.
    pub stretches: Vec<Stretch>,
    /// The time that each limit binds.
    pub shares: Vec<Share>,
    /// The savings of changes that were tried.
    pub trials: Vec<Trial>,
}

impl ProfileReport {
    /// Returns the result of a job called `file`, on a machine whose axes have these letters.
    /// `keeps`: the recorder kept the stretches, for a picture, a table or the times of the lines.
    pub fn new(file: &str, letters: Vec<char>, done: Streamed<Recorder>, keeps: bool) -> Self {
        let begin = done.outcome.first_byte;
        let end = begin + done.outcome.job_cycles;
        let counted = done.counted;
        let (stretches, shares) = if keeps {
            let of_file = |number| counted.line(number);
            let stretches = done.observer.finish(begin, end, of_file);
            let shares = shares(&stretches);
            (stretches, shares)
        } else {
            (Vec::new(), done.observer.shares(begin, end))
        };
        Self {
            file: file.to_owned(),
            letters,
            notes: Vec::new(),
            lines: done.lines,
            errors: done.errors,
            error_count: done.error_count,
            alarm: done.alarm,
            end: done.end,
            waits: done.waits,
            begin,
            job_cycles: done.outcome.job_cycles,
            shares,
            stretches,
            trials: Vec::new(),
        }
    }

    /// Returns true if the job met neither an error nor an alarm.
    pub fn is_clean(&self) -> bool {
        self.error_count == 0 && self.alarm.is_none()
    }

    fn verdict(&self) -> String {
        self.end.words()
    }

    /// Returns one line of figures, for a picture.
    pub fn caption(&self) -> String {
        let length: f64 = self.stretches.iter().map(|stretch| stretch.length).sum();
        let time = seconds(self.job_cycles);
        format!("{} · {length:.1} mm · {}", duration(time), self.verdict())
    }

    /// `cycles` as a share of the job's time.
    fn part(&self, cycles: u64) -> f64 {
        cycles as f64 / self.job_cycles.max(1) as f64
    }

    /// Returns the report as JSON; `line_times` adds the time that each line moves the machine.
    pub fn json(&self, line_times: bool) -> String {
        let share = |share: &Share| JsonShare {
            limit: share.limit.name(&self.letters),
            because: share.limit.because(&self.letters),
            held_by: share.limit.held_by(),
            seconds: seconds(share.cycles),
            share: self.part(share.cycles),
        };
        let json = ProfileJson {
            version: JSON_VERSION,
            file: &self.file,
            notes: &self.notes,
            lines: self.lines,
            errors: self.errors.iter().map(error_json).collect(),
            error_count: self.error_count,
            alarm: self.alarm.as_ref().map(|alarm| alarm.fault.code()),
            end: self.end.json(),
            waits: &self.waits,
            pauses: self.waits.iter().map(|wait| wait.line).collect(),
            job_seconds: seconds(self.job_cycles),
            limits: self.shares.iter().map(share).collect(),
            trials: &self.trials,
            line_times: line_times.then(|| self.line_times()),
        };
        serde_json::to_string_pretty(&json).unwrap_or_default()
    }

    /// The time that the machine spends on each line that moves it.
    fn line_times(&self) -> Vec<JsonLine> {
        let mut cycles: BTreeMap<u64, u64> = BTreeMap::new();
        for stretch in self.stretches.iter().filter(|stretch| stretch.line > 0) {
            *cycles.entry(stretch.line).or_default() += stretch.cycles();
        }
        let line = |(line, cycles): (u64, u64)| JsonLine {
            line,
            seconds: seconds(cycles),
        };
        cycles.into_iter().map(line).collect()
    }

    /// The order of the lines in time: each with the seconds for which it moves the machine; at rest
    /// the line is 0.
    pub(crate) fn course(&self) -> Vec<(u64, f64)> {
        let of_line = |part: &[Stretch]| {
            let cycles = part.iter().map(Stretch::cycles).sum();
            (part.first().map_or(0, |first| first.line), seconds(cycles))
        };
        let parts = self.stretches.chunk_by(|one, next| one.line == next.line);
        parts.map(of_line).filter(|(_, time)| *time > 0.0).collect()
    }

    fn write_shares(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "  what binds                                     time    share  held by"
        )?;
        for share in self.shares.iter().take(LISTED) {
            let because = share.limit.because(&self.letters);
            let ramp = if because.is_empty() { "" } else { ", " };
            let name = format!("{}{ramp}{because}", share.limit.name(&self.letters));
            let percent = self.part(share.cycles) * 100.0;
            let line = format!(
                "    {name:<40} {:>10.3} s {percent:>6.1} %  {}",
                seconds(share.cycles),
                share.limit.held_by()
            );
            writeln!(f, "{}", line.trim_end())?;
        }
        let rest: u64 = self
            .shares
            .iter()
            .skip(LISTED)
            .map(|share| share.cycles)
            .sum();
        if rest > 0 {
            let percent = self.part(rest) * 100.0;
            writeln!(
                f,
                "    {:<40} {:>10.3} s {percent:>6.1} %",
                "others",
                seconds(rest)
            )?;
        }
        Ok(())
    }

    fn write_trials(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.trials.is_empty() {
            return Ok(());
        }
        writeln!(
            f,
            "  to run faster (each measured by running the job again)"
        )?;
        let job = seconds(self.job_cycles);
        let widths = self.trials.iter().map(|trial| trial.change.len());
        let width = widths.max().unwrap_or(0);
        for trial in &self.trials {
            let (saved, percent) = (trial.seconds_saved, trial.seconds_saved / job * 100.0);
            writeln!(
                f,
                "    {:<width$}  saves {saved:.3} s ({percent:.1} %)",
                trial.change
            )?;
        }
        writeln!(
            f,
            "  whether machine and tool can do it is for you to judge"
        )
    }
}

impl fmt::Display for ProfileReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {} lines, {}", self.file, self.lines, self.verdict())?;
        let time = duration(seconds(self.job_cycles));
        writeln!(f, "  job time     {time} from the first byte to rest")?;
        if !self.waits.is_empty() {
            writeln!(f, "  pauses       {}", waits(&self.waits))?;
        }
        self.write_shares(f)?;
        self.write_trials(f)
    }
}

/// The output of `leadscrew profile --json`.
#[derive(Serialize, JsonSchema)]
#[serde(rename = "Profile")]
pub struct ProfileJson<'a> {
    version: u32,
    file: &'a str,
    notes: &'a [String],
    lines: u64,
    errors: Vec<JsonError<'a>>,
    error_count: u64,
    alarm: Option<u8>,
    end: JsonEnd,
    pauses: Vec<u64>,
    waits: &'a [Wait],
    job_seconds: f64,
    limits: Vec<JsonShare>,
    trials: &'a [Trial],
    #[serde(skip_serializing_if = "Option::is_none")]
    line_times: Option<Vec<JsonLine>>,
}

#[derive(Serialize, JsonSchema)]
struct JsonLine {
    line: u64,
    seconds: f64,
}

#[derive(Serialize, JsonSchema)]
struct JsonShare {
    limit: String,
    because: String,
    held_by: String,
    seconds: f64,
    share: f64,
}
