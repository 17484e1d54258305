//! Texts about a job, for people.

use crate::life::{End, Wait};
use crate::time::Time;
use leadscrew_sim::profile::Profile;
use leadscrew_sim::Fixtures;

/// Returns a job's name without its folders, for a picture.
pub fn title(file: &str) -> String {
    let name = std::path::Path::new(file).file_name();
    name.map_or_else(
        || file.to_owned(),
        |name| name.to_string_lossy().into_owned(),
    )
}

/// Returns what the tool of the machine of a file does to the material.
pub fn work(file: &Profile) -> &'static str {
    match file.tooling().extruder {
        Some(_) => "extruded",
        None => "cut",
    }
}

/// Returns a time as a person reads it: `83.512 s`, for long times with hours and minutes added.
pub fn duration(seconds: f64) -> String {
    let whole = seconds as u64;
    match (whole / 3600, whole / 60 % 60, whole % 60) {
        (0, 0, _) => format!("{seconds:.3} s"),
        (0, minutes, rest) => format!("{seconds:.3} s ({minutes} min {rest} s)"),
        (hours, minutes, _) => format!("{seconds:.3} s ({hours} h {minutes} min)"),
    }
}

/// The time that a job takes here, and beside it on `grbl`.
pub(crate) fn times(here: &Time, grbl: Option<&Time>) -> String {
    let stopped = match here.end {
        End::Done { .. } => String::new(),
        end @ End::Stopped { .. } => format!(", {}", end.words()),
    };
    let here = duration(here.job_seconds);
    match grbl {
        None => here + &stopped,
        Some(grbl) => format!(
            "your Grbl {}, here {here}{stopped}",
            duration(grbl.job_seconds)
        ),
    }
}

/// The most lines that are named one by one.
const NAMED_PAUSES: usize = 8;

/// A note for [`pauses`]: nobody is there to end a pause.
const RESUMED: &str = ", resumed at once: the time is without them";

/// Returns how often a program pauses for its operator, and at which lines; `note` follows the
/// number.
pub fn pauses(lines: &[u64], note: &str) -> String {
    let named = lines.iter().take(NAMED_PAUSES).map(u64::to_string);
    let (count, places) = (lines.len(), named.collect::<Vec<_>>().join(", "));
    let more = if count > NAMED_PAUSES { ", ..." } else { "" };
    format!("{count} (M0, M6, !){note}; line {places}{more}")
}

/// As [`pauses`] for a job that has run, with what its operator has to do at each line.
pub fn waits(waits: &[Wait]) -> String {
    let lines: Vec<u64> = waits.iter().map(|wait| wait.line).collect();
    let named = waits.iter().take(NAMED_PAUSES);
    let each = named.map(|Wait { line, why }| format!("\n               line {line}: {why}"));
    pauses(&lines, RESUMED) + &each.collect::<String>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_times_are_also_given_in_minutes_and_hours() {
        assert_eq!(duration(59.0004), "59.000 s");
        assert_eq!(duration(83.5), "83.500 s (1 min 23 s)");
        assert_eq!(duration(7384.0), "7384.000 s (2 h 3 min)");
    }
}
