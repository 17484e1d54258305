//! The result of a job: as lines for a person, as JSON for a program.

use leadscrew_files::plain_json;
use leadscrew_jobs::{
    duration, error_json, waits, warning_json, Complaint, End, Extents, JsonEnd, JsonError,
    JsonWarning, Time, Wait, JSON_VERSION,
};
use leadscrew_sim::outcome::Outcome;
use leadscrew_sim::powered::MOST_MOTORS;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::num::NonZeroU32;

/// All data that is reported about a job.
#[derive(Debug)]
pub(super) struct Report {
    /// The file's name.
    pub(super) file: String,
    /// Lines read from it.
    pub(super) lines: u64,
    /// The errors that were kept in full.
    pub(super) errors: Vec<Complaint>,
    /// The number of errors.
    pub(super) error_count: u64,
    /// The likely mistakes in the job that were kept.
    pub(super) warnings: Vec<Complaint>,
    /// The number of likely mistakes.
    pub(super) warning_count: u64,
    /// The alarm that ended the job.
    pub(super) alarm: Option<Complaint>,
    /// The result of the simulation.
    pub(super) outcome: Outcome<MOST_MOTORS>,
    /// Letters of the axes, in order.
    pub(super) letters: Vec<char>,
    /// The letters of the axes that turn.
    pub(super) turning: Vec<char>,
    /// Steps/mm of each axis.
    pub(super) steps_per_mm: Vec<f64>,
    /// Steps of a turn of each axis's motor, if that is known.
    pub(super) steps_per_rev: Vec<Option<f64>>,
    /// True if motors 0 and 1 turn X and Y together, by crossed belts.
    pub(super) crossed: bool,
    /// What the tool does to the material: cut, extruded.
    pub(super) work: &'static str,
    /// Length of the cuts, mm.
    pub(super) cut_mm: f64,
    /// Length of all other moves, mm.
    pub(super) travel_mm: f64,
    /// Bits a second of the serial line; `None` if the line never waits.
    pub(super) baud: Option<NonZeroU32>,
    /// How the job ended.
    pub(super) end: End,
    /// The lines at which the program waited for its operator.
    pub(super) waits: Vec<Wait>,
    /// The tools that the program asked for.
    pub(super) tools: Vec<u32>,
    /// The number of synchronised outputs.
    pub(super) outputs: u8,
    /// The box around all cuts.
    pub(super) extents: Option<Extents>,
    /// Notes about a file that was imported.
    pub(super) notes: Vec<String>,
    /// The time that Grbl takes, if that was asked for.
    pub(super) grbl: Option<Time>,
    /// The time that the simulation took in real time, s.
    pub(super) wall_seconds: f64,
}

/// The output of `run --json` for a job.
#[derive(Serialize, JsonSchema)]
#[serde(rename = "Run")]
pub(super) struct RunJson<'a> {
    version: u32,
    file: &'a str,
    notes: &'a [String],
    lines: u64,
    errors: Vec<JsonError<'a>>,
    error_count: u64,
    warnings: Vec<JsonWarning<'a>>,
    warning_count: u64,
    alarm: Option<u8>,
    alarm_line: Option<u64>,
    end: JsonEnd,
    pauses: Vec<u64>,
    waits: &'a [Wait],
    tools: &'a [u32],
    #[serde(skip_serializing_if = "Option::is_none")]
    outputs: Option<JsonOutputs>,
    /// The box around all cuts, in machine coordinates, mm.
    extents: Option<&'a Extents>,
    /// Length of the feed moves, mm; with a laser only of those with power, on a machine with
    /// filament only of those that feed some.
    cut_mm: f64,
    /// Length of all other moves, mm.
    travel_mm: f64,
    job_seconds: f64,
    motion_seconds: f64,
    step_seconds: f64,
    /// The time that Grbl takes; with `--as grbl`.
    #[serde(skip_serializing_if = "Option::is_none")]
    grbl: Option<Time>,
    axes: BTreeMap<char, JsonAxis>,
    step_events: u64,
    smoothing_ticks: u64,
    dominant_step_events: u64,
    peak_step_hz: f64,
    min_pulse_us: Option<f64>,
    min_direction_setup_us: Option<f64>,
    late_events: u64,
    cpu: JsonCpu,
    cycles: u64,
    wall_seconds: f64,
}

#[derive(Serialize, JsonSchema)]
struct JsonAxis {
    pulses: u64,
    net_steps: i64,
    position_mm: f64,
    peak_mm_min: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    position_rev: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    peak_rev_min: Option<f64>,
}

#[derive(Serialize, JsonSchema)]
struct JsonOutputs {
    levels: Vec<bool>,
    changes: u64,
}

#[derive(Serialize, JsonSchema)]
struct JsonCpu {
    mean: f64,
    peak: f64,
}

impl Report {
    /// Returns true if the job met neither an error nor an alarm.
    pub(super) fn is_clean(&self) -> bool {
        self.error_count == 0 && self.alarm.is_none()
    }

    /// The report as a JSON object.
    pub(super) fn json(&self) -> impl Serialize + '_ {
        let outcome = &self.outcome;
        RunJson {
            version: JSON_VERSION,
            file: &self.file,
            notes: &self.notes,
            lines: self.lines,
            errors: self.errors.iter().map(error_json).collect(),
            error_count: self.error_count,
            warnings: self.warnings.iter().map(warning_json).collect(),
            warning_count: self.warning_count,
            alarm: self.alarm.as_ref().map(|alarm| alarm.fault.code()),
            alarm_line: self.alarm.as_ref().map(|alarm| alarm.line),
            end: self.end.json(),
            pauses: self.waits.iter().map(|wait| wait.line).collect(),
            waits: &self.waits,
            tools: &self.tools,
            outputs: self.outputs(),
            extents: self.extents.as_ref(),
            cut_mm: self.cut_mm,
            travel_mm: self.travel_mm,
            job_seconds: outcome.job_seconds,
            motion_seconds: outcome.motion_seconds,
            step_seconds: outcome.step_seconds,
            grbl: self.grbl,
            axes: self
                .axes()
                .map(|(name, axis)| (name.to_ascii_lowercase(), axis))
                .collect(),
            step_events: outcome.step_events,
            smoothing_ticks: outcome.smoothing_ticks,
            dominant_step_events: outcome.dominant_step_events,
            peak_step_hz: outcome.peak_step_hz,
            min_pulse_us: outcome.min_pulse_us,
            min_direction_setup_us: outcome.min_direction_setup_us,
            late_events: outcome.late.count(),
            cpu: JsonCpu {
                mean: outcome.cpu.mean,
                peak: outcome.cpu.peak,
            },
            cycles: outcome.cycles,
            wall_seconds: self.wall_seconds,
        }
    }

    fn outputs(&self) -> Option<JsonOutputs> {
        let (levels, changes) = self.outcome.outputs;
        let levels = (0..self.outputs).map(|index| levels >> index & 1 == 1);
        (self.outputs > 0).then(|| JsonOutputs {
            levels: levels.collect(),
            changes,
        })
    }

    /// The distance that each axis has gone, in its own steps.
    fn net_steps(&self) -> [f64; MOST_MOTORS] {
        let mut steps = self.outcome.motors.map(|motor| motor.net_steps as f64);
        if let (true, [a, b, ..]) = (self.crossed, steps.as_mut_slice()) {
            (*a, *b) = (0.5 * (*a + *b), 0.5 * (*a - *b));
        }
        steps
    }

    fn axes(&self) -> impl Iterator<Item = (char, JsonAxis)> + '_ {
        let scales = self.steps_per_mm.iter().zip(&self.steps_per_rev);
        let motors = self.outcome.motors.iter().zip(scales);
        let steps = self.net_steps();
        let letters = self.letters.iter().copied();
        letters.zip(steps).zip(motors).map(
            |((name, steps), (motor, (steps_per_mm, steps_per_rev)))| {
                let axis = JsonAxis {
                    pulses: motor.pulses,
                    net_steps: motor.net_steps,
                    position_mm: steps / steps_per_mm,
                    peak_mm_min: motor.peak_hz / steps_per_mm * 60.0,
                    position_rev: steps_per_rev.map(|turn| steps / turn),
                    peak_rev_min: steps_per_rev.map(|turn| motor.peak_hz / turn * 60.0),
                };
                (name, axis)
            },
        )
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let outcome = &self.outcome;
        writeln!(f, "{}: {} lines, {}", self.file, self.lines, self.verdict())?;
        row(
            f,
            "job time",
            &format!(
                "{} from the first byte to rest",
                duration(outcome.job_seconds)
            ),
        )?;
        row(
            f,
            "motion",
            &format!(
                "{} from the start of the first move to rest",
                duration(outcome.motion_seconds)
            ),
        )?;
        if let Some(grbl) = &self.grbl {
            let (grbl, here) = (duration(grbl.job_seconds), duration(outcome.job_seconds));
            row(f, "compared", &format!("your Grbl {grbl}, here {here}"))?;
        }
        if !self.waits.is_empty() {
            row(f, "pauses", &waits(&self.waits))?;
        }
        row(
            f,
            "distance",
            &format!(
                "{:.1} mm {}, {:.1} mm travelled",
                self.cut_mm, self.work, self.travel_mm
            ),
        )?;
        for (name, axis) in self.axes() {
            let unit = match self.turning.contains(&name) {
                true => "degrees",
                false => "mm",
            };
            row(
                f,
                &format!("{name} axis"),
                &format!(
                    "{} steps, ends at {:.3} {unit}, peak {:.0} {unit}/min",
                    axis.pulses, axis.position_mm, axis.peak_mm_min
                ),
            )?;
        }
        row(
            f,
            "steps",
            &format!(
                "{} step events, at most {:.0} Hz",
                outcome.step_events, outcome.peak_step_hz
            ),
        )?;
        let (mean, peak) = (outcome.cpu.mean * 100.0, outcome.cpu.peak * 100.0);
        row(
            f,
            "CPU load",
            &format!(
                "{mean:.1} % on average; step interrupts take {peak:.1} % of a millisecond at most"
            ),
        )?;
        row(f, "serial line", &self.line())?;
        row(f, "late events", &outcome.late.count().to_string())
    }
}

impl Report {
    /// One line of figures, for a picture.
    pub(super) fn caption(&self) -> String {
        format!(
            "{} · {:.1} mm {}, {:.1} mm travelled · {} step events · {}",
            duration(self.outcome.job_seconds),
            self.cut_mm,
            self.work,
            self.travel_mm,
            self.outcome.step_events,
            self.verdict()
        )
    }

    fn verdict(&self) -> String {
        self.end.words()
    }

    fn line(&self) -> String {
        match self.baud {
            Some(baud) => format!("{baud} baud"),
            None => "never waits (use --baud for a real one)".to_owned(),
        }
    }
}

fn row(f: &mut fmt::Formatter<'_>, name: &str, value: &str) -> fmt::Result {
    writeln!(f, "  {name:<12} {value}")
}

/// The reports of jobs as JSON: one object, or an array if there may be several jobs.
pub(super) fn json_text(reports: &[impl Serialize], is_one: bool) -> String {
    let text = match (is_one, reports) {
        (true, [one]) => serde_json::to_string_pretty(one),
        (_, all) => serde_json::to_string_pretty(all),
    };
    plain_json(&text.unwrap_or_default())
}
