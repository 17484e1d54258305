//! Groups complaints by their cause, so that one wrong origin is reported once and not for each
//! line that it spoils.

use leadscrew_jobs::{Complaint, Fault};
use std::collections::BTreeMap;

/// The most causes that are counted. Complaints of further causes are all shown.
const KEPT: usize = 1000;

/// The mistake, and its word or axis. Complaints of one group have the same mistake and the same
/// word or axis.
type Cause = (String, String);

/// The complaints of one cause.
struct Group {
    count: u64,
    first: u64,
    last: u64,
}

/// The complaints of a job, counted by cause.
#[derive(Default)]
pub(super) struct Causes(BTreeMap<Cause, Group>);

impl Causes {
    /// Counts a complaint; returns whether it is to be shown, as the first of its cause.
    pub(super) fn note(&mut self, complaint: &Complaint) -> bool {
        let line = complaint.line;
        let cause = (complaint.fault.to_string(), subject(complaint));
        if let Some(group) = self.0.get_mut(&cause) {
            group.count += 1;
            group.last = line;
            return false;
        }
        if self.0.len() < KEPT {
            let (count, first, last) = (1, line, line);
            self.0.insert(cause, Group { count, first, last });
        }
        true
    }

    /// The complaints that were not shown, summed up in a line for each cause.
    pub(super) fn rest(&self, file: &str) -> Vec<String> {
        let mut groups: Vec<_> = self.0.iter().filter(|(_, group)| group.count > 1).collect();
        groups.sort_by_key(|(_, group)| group.first);
        let words = |((fault, subject), group): (&Cause, &Group)| {
            let (more, first, last) = (group.count - 1, group.first, group.last);
            let subject = if subject.is_empty() {
                ""
            } else {
                &format!(" ({subject})")
            };
            format!("{file}: {fault}{subject}: {more} more, as in line {first}, the last in line {last}")
        };
        groups.into_iter().map(words).collect()
    }
}

/// The subject of a complaint: the word at the column, or the axes that leave their travel.
fn subject(complaint: &Complaint) -> String {
    match (complaint.fault, complaint.column) {
        (Fault::Remark(_), _) => complaint.fault.message().to_owned(),
        (Fault::Error(_), Some(_)) => word(complaint.from_column()),
        (_, _) => complaint.detail.as_deref().map_or(String::new(), axes),
    }
}

/// The axes that leave their travel, and at which end. `detail` is `X would be at 5.000 mm, its
/// travel is -200.000 to 0; Y would be at -7.000 mm on the axis' own scale, its frame ends at 0.000
/// mm`: a place that is below the next number is too low.
fn axes(detail: &str) -> String {
    let end = |axis: &str| {
        let name = axis.chars().next().unwrap_or(' ');
        let mut numbers = axis.split(' ').filter_map(|word| word.parse::<f64>().ok());
        let side = match (axis.contains("be at"), numbers.next(), numbers.next()) {
            (true, Some(at), Some(end)) if at < end => "low",
            _ => "high",
        };
        format!("{name} too {side}")
    };
    detail.split("; ").map(end).collect::<Vec<_>>().join(", ")
}

/// The word that a text begins with: all of a G or M code, but only the letter of any other word,
/// since its value differs from line to line.
fn word(rest: &str) -> String {
    let first = rest.chars().next().unwrap_or(' ').to_ascii_uppercase();
    if first.is_ascii_alphabetic() && !"GM".contains(first) {
        return first.to_string();
    }
    let ends = |(_, c): &(usize, char)| !matches!(c, '0'..='9' | '.' | '-' | ' ');
    let end = rest.char_indices().skip(1).find(ends);
    let word = rest.get(..end.map_or(rest.len(), |(at, _)| at));
    word.unwrap_or_default().trim_end().to_uppercase()
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_machine::protocol::status::Status;

    fn unsupported(line: u64, text: &str) -> Complaint {
        Complaint {
            file: "job.nc".to_owned(),
            line,
            column: Some(0),
            fault: Fault::Error(Status::UnsupportedCommand),
            text: text.to_owned(),
            detail: None,
        }
    }

    #[test]
    fn words_of_one_letter_have_one_cause_whatever_their_values() {
        let mut causes = Causes::default();
        assert!(causes.note(&unsupported(1, "E1.5")));
        assert!(!causes.note(&unsupported(2, "e2.75")));
        assert!(causes.note(&unsupported(3, "M107")));
        assert!(causes.note(&unsupported(4, "M104 S200")));
        let rest = "job.nc: error:20 (E): 1 more, as in line 1, the last in line 2";
        assert_eq!(causes.rest("job.nc"), [rest]);
    }

    #[test]
    fn an_axis_is_too_low_below_the_lower_end_wherever_zero_is() {
        for (detail, words) in [
            ("X would be at 5.000 mm, its travel is -200.000 to 0", "X too high"),
            ("X would be at -2.000 mm, its travel is -200.000 to -3", "X too high"),
            ("X would be at 2.000 mm, its travel is 3.000 to 203", "X too low"),
            (
                "X would be at 204.000 mm, its travel is 3.000 to 203; Y would be at -7.000 mm, its travel is 0.000 to 9",
                "X too high, Y too low",
            ),
            ("Z would be at -1.000 mm on the axis' own scale, its frame ends at 0.000 mm", "Z too low"),
            ("Z goes over 300.000 mm, its travel is 200.000 mm", "Z too high"),
        ] {
            assert_eq!(axes(detail), words);
        }
    }

    #[test]
    fn each_cause_is_shown_once_and_the_rest_is_counted() {
        let mut causes = Causes::default();
        let lines = ["G77", "g77 X1", "G78", "G77Y2"];
        let shown: Vec<bool> = (5..)
            .zip(lines)
            .map(|(n, text)| causes.note(&unsupported(n, text)))
            .collect();
        assert_eq!(shown, [true, false, true, false]);
        let rest = "job.nc: error:20 (G77): 2 more, as in line 5, the last in line 8";
        assert_eq!(causes.rest("job.nc"), [rest]);
    }
}
