//! The parts that all JSON output about jobs shares.

use crate::complaint::Complaint;
use schemars::JsonSchema;
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Version of all that `--json` writes; fields that are added do not raise it.
pub const JSON_VERSION: u32 = 1;

/// The box around all cuts, axis by axis.
pub type Extents = BTreeMap<char, Extent>;

/// The range of coordinates along one axis, mm.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, JsonSchema)]
pub struct Extent {
    pub(crate) min: f64,
    pub(crate) max: f64,
}

/// Returns the box between two corners.
pub fn extents([low, high]: [[f64; 3]; 2]) -> Extents {
    let ends = low
        .into_iter()
        .zip(high)
        .map(|(min, max)| Extent { min, max });
    ['x', 'y', 'z'].into_iter().zip(ends).collect()
}

/// An error of a job.
#[derive(Serialize, JsonSchema)]
pub struct JsonError<'a> {
    line: u64,
    column: Option<usize>,
    code: u8,
    message: Cow<'a, str>,
    /// What the user can do; the lines that a machine file needs stand on lines of their own.
    remedy: &'static str,
    text: &'a str,
}

/// Returns an error as JSON.
pub fn error_json(complaint: &Complaint) -> JsonError<'_> {
    JsonError {
        line: complaint.line,
        column: complaint.column.map(|column| column + 1),
        code: complaint.fault.code(),
        message: complaint.message(),
        remedy: complaint.remedy(),
        text: &complaint.text,
    }
}

/// A likely mistake.
#[derive(Serialize, JsonSchema)]
pub struct JsonWarning<'a> {
    line: u64,
    column: Option<usize>,
    kind: &'static str,
    message: Cow<'a, str>,
    /// What the user can do; the lines that a machine file needs stand on lines of their own.
    remedy: &'static str,
    text: &'a str,
}

/// Returns a warning as JSON.
pub fn warning_json(complaint: &Complaint) -> JsonWarning<'_> {
    JsonWarning {
        line: complaint.line,
        column: complaint.column.map(|column| column + 1),
        kind: complaint.fault.name(),
        message: complaint.message(),
        remedy: complaint.remedy(),
        text: &complaint.text,
    }
}
