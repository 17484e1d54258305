//! A check of a job finds every error in one go, soft limits included, and likely mistakes; nothing
//! moves. The result is a line for a person, or JSON for a program.

use crate::checker::{Doubt, Follow};
use crate::complaint::{Complaint, Fault};
use crate::json::{
    error_json, extents, warning_json, Extents, JsonError, JsonWarning, JSON_VERSION,
};
use crate::remark::Remarks;
use crate::time::Time;
use crate::words::{pauses, times};
use leadscrew_sim::program::Next;
use leadscrew_sim::scene::{note_tools, Toolpath};
use leadscrew_sim::streamer::Lines;
use schemars::JsonSchema;
use serde::Serialize;
use std::fmt;
use std::io::{self, BufRead};

/// Conditions that are shown to a person.
const SHOWN: usize = 20;

/// Complaints that are kept for the JSON output.
const KEPT: usize = 10_000;

/// Checks a job called `name` to its end; hands out each complaint.
///
/// # Errors
/// If the text cannot be read.
pub fn read_through(
    checker: &mut dyn Follow,
    name: &str,
    text: impl BufRead,
    mut each: impl FnMut(&Complaint),
) -> io::Result<CheckReport> {
    let mut report = CheckReport::new(name);
    let mut remarks = Remarks::default();
    let mut lines = Lines::new(text);
    let (mut raw, mut last) = (Vec::new(), Vec::new());
    loop {
        match lines.next(&mut raw, checker.world())? {
            Next::Line => {}
            Next::Begins => continue,
            Next::End => break,
            Next::Fault(fault) => {
                let complaint = Complaint::of_program(name, &fault);
                each(&complaint);
                report.note(complaint, KEPT);
                break;
            }
        }
        let number = lines.number();
        let found = checker.check(number, &raw);
        let done = checker.last();
        report.pauses.extend(done.paused.then_some(number));
        report.note_tools(&raw);
        let doubts = checker.doubts().into_iter();
        let doubts = doubts.map(|doubt| doubtful(name, number, &raw, doubt));
        let remarked = remarks
            .take(&raw, done)
            .into_iter()
            .map(|(column, remark)| {
                Complaint::new(name, number, Some(column), Fault::Remark(remark), &raw)
            });
        for complaint in found.into_iter().chain(remarked).chain(doubts) {
            each(&complaint);
            report.note(complaint, KEPT);
        }
        std::mem::swap(&mut raw, &mut last);
    }
    report.lines = lines.count();
    report.branches = branches(&lines);
    for (line, text, doubt) in checker.end(report.lines, &last) {
        let complaint = doubtful(name, line, &text, doubt);
        each(&complaint);
        report.note(complaint, KEPT);
    }
    report.measure(checker.path());
    Ok(report)
}

/// The conditions that a program has met, in the order of its lines.
fn branches<R: BufRead>(lines: &Lines<R>) -> Option<Vec<JsonBranch>> {
    let met = lines.branches()?.iter();
    Some(
        met.map(|(line, branch)| JsonBranch {
            line: *line,
            taken: branch.taken,
            passed: branch.passed,
        })
        .collect(),
    )
}

/// A likely mistake in a line as a complaint.
fn doubtful(name: &str, line: u64, text: &[u8], doubt: Doubt) -> Complaint {
    Complaint {
        detail: doubt.detail,
        ..Complaint::new(name, line, None, Fault::Remark(doubt.remark), text)
    }
}

/// The result of a check.
#[derive(Default)]
pub struct CheckReport {
    /// The file's name.
    pub file: String,
    /// Notes about a file that was imported.
    pub notes: Vec<String>,
    /// Lines read from it.
    pub lines: u64,
    errors: Vec<Complaint>,
    /// The number of errors.
    pub error_count: u64,
    warnings: Vec<Complaint>,
    warning_count: u64,
    /// Lines at which the program pauses.
    pub pauses: Vec<u64>,
    tools: Vec<u32>,
    /// The conditions that were met; `None` for a job that is no program.
    branches: Option<Vec<JsonBranch>>,
    extents: Option<Extents>,
    cut_mm: f64,
    travel_mm: f64,
    /// The time that the job takes, if that was asked for.
    pub time: Option<Time>,
    /// The time that it takes on Grbl.
    pub grbl: Option<Time>,
}

impl CheckReport {
    /// Returns true if the job is a program: it has a parameter, an expression or an O word.
    pub(crate) fn is_program(&self) -> bool {
        self.branches.is_some()
    }

    /// Begins the report of a file.
    fn new(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            ..Self::default()
        }
    }

    /// Counts a complaint, and keeps it unless `most` complaints have been kept already.
    fn note(&mut self, complaint: Complaint, most: usize) {
        let (kept, count) = match complaint.fault.is_remark() {
            true => (&mut self.warnings, &mut self.warning_count),
            false => (&mut self.errors, &mut self.error_count),
        };
        *count += 1;
        if kept.len() < most {
            kept.push(complaint);
        }
    }

    /// Notes the tools that a line asks for.
    fn note_tools(&mut self, raw: &[u8]) {
        note_tools(&mut self.tools, raw);
    }

    /// Takes over the extents and lengths of the program's path.
    fn measure(&mut self, path: &Toolpath) {
        self.extents = path.cut_bounds().map(extents);
        (self.cut_mm, self.travel_mm) = (path.cut_mm(), path.travel_mm());
    }

    /// Counts the extents from work zero, which is at `zero`, machine position, mm.
    pub(crate) fn count_from(&mut self, zero: [f32; 3]) {
        let extents = self.extents.iter_mut().flat_map(|all| all.values_mut());
        for (extent, zero) in extents.zip(zero) {
            extent.min -= f64::from(zero);
            extent.max -= f64::from(zero);
        }
    }

    /// Returns one line of figures, for a picture; `work` is what the tool does to the material.
    pub fn caption(&self, work: &str) -> String {
        let (cut, travel) = (self.cut_mm, self.travel_mm);
        format!(
            "{cut:.1} mm {work}, {travel:.1} mm travelled · {}",
            self.verdict()
        )
    }

    /// Returns the findings as a JSON object.
    pub fn json(&self) -> impl Serialize + '_ {
        CheckJson {
            version: JSON_VERSION,
            file: &self.file,
            notes: &self.notes,
            lines: self.lines,
            errors: self.errors.iter().map(error_json).collect(),
            error_count: self.error_count,
            warnings: self.warnings.iter().map(warning_json).collect(),
            warning_count: self.warning_count,
            extents: self.extents.as_ref(),
            cut_mm: self.cut_mm,
            travel_mm: self.travel_mm,
            tools: &self.tools,
            pauses: &self.pauses,
            branches: self.branches.as_deref(),
            time: self.time,
            grbl: self.grbl,
        }
    }

    fn verdict(&self) -> String {
        let plural = |count, word| match count {
            0 => format!("no {word}"),
            1 => format!("1 {word}"),
            count => format!("{count} {word}s"),
        };
        let errors = plural(self.error_count, "error");
        match self.warning_count {
            0 => errors,
            count => format!("{errors}, {}", plural(count, "warning")),
        }
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} lines, {}", self.file, self.lines, self.verdict())?;
        if let Some(time) = &self.time {
            write!(f, "\n  job time     {}", times(time, self.grbl.as_ref()))?;
        }
        if let lines @ [_, ..] = self.pauses.as_slice() {
            write!(f, "\n  pauses       {}", pauses(lines, ""))?;
        }
        for branch in self.branches.iter().flatten().take(SHOWN) {
            write!(f, "\n  condition    {branch}")?;
        }
        match self
            .branches
            .as_ref()
            .map_or(0, Vec::len)
            .checked_sub(SHOWN)
        {
            None | Some(0) => Ok(()),
            Some(more) => write!(f, "\n  condition    {more} more"),
        }
    }
}

/// An `if` or `elseif` of a program.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
struct JsonBranch {
    line: u64,
    /// The number of times that what follows it was run.
    taken: u64,
    /// The number of times that it was passed over.
    passed: u64,
}

impl fmt::Display for JsonBranch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (line, taken, passed) = (self.line, self.taken, self.passed);
        match (taken, passed) {
            (_, 0) => write!(f, "line {line}: true, {taken} times"),
            (0, _) => write!(f, "line {line}: false, {passed} times"),
            _ => write!(f, "line {line}: true {taken} times, false {passed} times"),
        }
    }
}

/// The output of `leadscrew check --json` for a file.
#[derive(Serialize, JsonSchema)]
#[serde(rename = "Check")]
pub struct CheckJson<'a> {
    version: u32,
    file: &'a str,
    notes: &'a [String],
    lines: u64,
    errors: Vec<JsonError<'a>>,
    error_count: u64,
    warnings: Vec<JsonWarning<'a>>,
    warning_count: u64,
    /// The box around all cuts, in machine coordinates, mm.
    extents: Option<&'a Extents>,
    /// Length of the feed moves, mm; with a laser only of those with power, on a machine with
    /// filament only of those that feed some.
    cut_mm: f64,
    /// Length of all other moves, mm.
    travel_mm: f64,
    tools: &'a [u32],
    pauses: &'a [u64],
    /// The conditions that a program has met; only of a job with parameters, expressions or O words.
    #[serde(skip_serializing_if = "Option::is_none")]
    branches: Option<&'a [JsonBranch]>,
    /// The time that the job takes; with `--time`, and only if it has no error.
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<Time>,
    /// The time that Grbl takes; with `--as grbl`.
    #[serde(skip_serializing_if = "Option::is_none")]
    grbl: Option<Time>,
}
