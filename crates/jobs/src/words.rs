//! Texts about a job, for people.

use crate::complaint::Complaint;

/// A job's name without its folders, for a picture.
pub fn title(file: &str) -> String {
    let name = std::path::Path::new(file).file_name();
    name.map_or_else(
        || file.to_owned(),
        |name| name.to_string_lossy().into_owned(),
    )
}

/// How a job ended, in a few words.
pub fn verdict(alarm: Option<&Complaint>, errors: u64) -> String {
    match (alarm, errors) {
        (Some(alarm), _) => format!("stopped by ALARM:{}", alarm.fault.code()),
        (None, 0) => "done".to_owned(),
        (None, 1) => "1 error".to_owned(),
        (None, count) => format!("{count} errors"),
    }
}

/// A time as a person reads it: `83.512 s`, for long times with hours and minutes added.
pub fn duration(seconds: f64) -> String {
    let whole = seconds as u64;
    match (whole / 3600, whole / 60 % 60, whole % 60) {
        (0, 0, _) => format!("{seconds:.3} s"),
        (0, minutes, rest) => format!("{seconds:.3} s ({minutes} min {rest} s)"),
        (hours, minutes, _) => format!("{seconds:.3} s ({hours} h {minutes} min)"),
    }
}

/// The most lines that are named one by one.
const NAMED_PAUSES: usize = 8;

/// A note for [`pauses`]: nobody is there to end a pause.
pub const RESUMED: &str = ", resumed at once: the time is without them";

/// How often a program pauses for its operator, and at which lines; `note` follows the number.
pub fn pauses(lines: &[u64], note: &str) -> String {
    let named = lines.iter().take(NAMED_PAUSES).map(u64::to_string);
    let (count, places) = (lines.len(), named.collect::<Vec<_>>().join(", "));
    let more = if count > NAMED_PAUSES { ", ..." } else { "" };
    format!("{count} (M0, M6, !){note}; line {places}{more}")
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
