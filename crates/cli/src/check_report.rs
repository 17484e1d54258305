//! The result of a check: as a line for a person, as JSON for a program.

use super::complaint::Complaint;
use super::report::{
    error_json, extents, warning_json, Extents, JsonError, JsonWarning, JSON_VERSION,
};
use leadscrew_sim::scene::note_tools;
use leadscrew_sim::scene::Toolpath;
use schemars::JsonSchema;
use serde::Serialize;
use std::fmt;

/// The result of a check.
#[derive(Default)]
pub(super) struct CheckReport {
    /// The file's name.
    pub(super) file: String,
    /// Lines read from it.
    pub(super) lines: u64,
    errors: Vec<Complaint>,
    /// How many errors there were.
    pub(super) error_count: u64,
    warnings: Vec<Complaint>,
    warning_count: u64,
    /// Lines at which the program pauses.
    pub(super) pauses: Vec<u64>,
    tools: Vec<u32>,
    extents: Option<Extents>,
    cut_mm: f64,
    travel_mm: f64,
}

impl CheckReport {
    /// Begins the report of a file.
    pub(super) fn new(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            ..Self::default()
        }
    }

    /// Counts a complaint, and keeps it where there are not `most` already.
    pub(super) fn note(&mut self, complaint: Complaint, most: usize) {
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
    pub(super) fn note_tools(&mut self, raw: &[u8]) {
        note_tools(&mut self.tools, raw);
    }

    /// Takes over where the program goes.
    pub(super) fn measure(&mut self, path: &Toolpath) {
        self.extents = path.cut_bounds().map(extents);
        (self.cut_mm, self.travel_mm) = (path.cut_mm(), path.travel_mm());
    }

    /// One line of figures, for a picture.
    pub(super) fn caption(&self) -> String {
        let (cut, travel) = (self.cut_mm, self.travel_mm);
        format!(
            "{cut:.1} mm cut, {travel:.1} mm travelled · {}",
            self.verdict()
        )
    }

    /// The findings as a JSON object.
    pub(super) fn json(&self) -> impl Serialize + '_ {
        CheckJson {
            version: JSON_VERSION,
            file: &self.file,
            lines: self.lines,
            errors: self.errors.iter().map(error_json).collect(),
            warnings: self.warnings.iter().map(warning_json).collect(),
            extents: self.extents.as_ref(),
            cut_mm: self.cut_mm,
            travel_mm: self.travel_mm,
            tools: &self.tools,
            pauses: &self.pauses,
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
        write!(f, "{}: {} lines, {}", self.file, self.lines, self.verdict())
    }
}

/// The output of `check --json` for a file.
#[derive(Serialize, JsonSchema)]
#[serde(rename = "Check")]
pub(super) struct CheckJson<'a> {
    version: u32,
    file: &'a str,
    lines: u64,
    errors: Vec<JsonError<'a>>,
    warnings: Vec<JsonWarning<'a>>,
    extents: Option<&'a Extents>,
    cut_mm: f64,
    travel_mm: f64,
    tools: &'a [u32],
    pauses: &'a [u64],
}
