//! Reads input files and writes jobs.

use super::super::said::{aside, put};
use super::super::{input, unusable, Unusable};
use super::OutputArgs;
use leadscrew_files::{is_input, is_stdout, read_all, Output};
use leadscrew_import::{Faults, Job};
use leadscrew_jobs::unix_lines;
use std::io::Write;
use std::path::Path;

/// The most bytes of a file that is imported.
const LONGEST: usize = 256 << 20;

/// Reads a whole file of text. Bytes that are not UTF-8 are replaced: they can only be in comments.
/// Lines end with LF, CR or CR LF, and a byte order mark is left out, as in jobs that are run.
///
/// # Errors
/// If it cannot be read or is no text.
pub(in super::super) fn read(name: &Path) -> Result<String, Unusable> {
    let job = input::open(name).map_err(unusable)?;
    let bytes = read_all(job.text, LONGEST)
        .map_err(|error| unusable(format!("{}: cannot be read: {error}", job.name)))?;
    Ok(unix_lines(&bytes))
}

/// The value that a reader returned. If it returned faults instead, prints them and returns `None`.
pub(in super::super) fn shown<T>(name: &Path, text: &str, read: Result<T, Faults>) -> Option<T> {
    let name = leadscrew_files::shown(name);
    read.map_err(|faults| aside(faults.show(&name, text))).ok()
}

/// Writes a job to `path` and prints its notes. A file in `inputs` is never overwritten.
///
/// # Errors
/// If it cannot be written.
pub(in super::super) fn write(
    job: &Job,
    path: &Path,
    inputs: &[&Path],
    args: &OutputArgs,
) -> Result<(), Unusable> {
    if !args.quiet {
        job.notes
            .iter()
            .for_each(|note| aside(format!("note: {note}")));
    }
    let text = job.lines.join("\n");
    if is_stdout(path) {
        return put(format!("{text}\n").as_bytes());
    }
    if is_input(path, inputs) {
        let shown = leadscrew_files::shown(path);
        return Err(unusable(format!(
            "{shown}: is a file that is read; the job needs another name"
        )));
    }
    let output = Output::create(path).map_err(unusable)?;
    let written = writeln!(output.pen(), "{text}");
    output.complete(written).map_err(unusable)
}
