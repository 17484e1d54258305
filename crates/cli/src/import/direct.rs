//! Files of other machines that are checked, timed and run as they are.

use super::super::input::Job;
use super::super::{unusable, Unusable};
use leadscrew_jobs::{Foreign, Machine};
use std::io::{BufReader, Cursor};

/// Makes a job of a file of another machine. Returns the job, which is the file itself if it is
/// G-code, and the notes for its user.
///
/// # Errors
/// The file cannot be read, it has faults, or the machine file lacks what the import needs.
pub(in super::super) fn direct(
    mut job: Job,
    machine: &Machine,
) -> Result<(Job, Vec<String>), Unusable> {
    let Some(kind) = Foreign::of(&job.head) else {
        return Ok((job, Vec::new()));
    };
    let bytes = job.keep().map_err(unusable)?;
    let made = kind.job(&job.name, &bytes, machine).map_err(unusable)?;
    let notes = made.notes.iter();
    let notes = notes.map(|note| format!("{}: {note}", job.name)).collect();
    let lines = made.lines.join("\n") + "\n";
    let made = Job {
        name: job.name,
        size: Some(lines.len() as u64),
        head: Vec::new(),
        text: Box::new(BufReader::new(Cursor::new(lines))),
    };
    Ok((made, notes))
}
