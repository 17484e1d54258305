//! A text that a reader did not understand, and its place.

use std::collections::HashMap;
use std::fmt;

/// A text in a file that a reader does not understand.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Fault {
    /// The line's number, from 1.
    pub line: u32,
    /// The column in the line, in characters from 1.
    pub column: u32,
    /// The mistake and, if there is one, the remedy.
    pub message: String,
}

impl Fault {
    /// A fault at `line` and `column`, both from 1.
    pub(crate) fn new(line: usize, column: usize, message: impl Into<String>) -> Self {
        Self {
            line: u32::try_from(line).unwrap_or(u32::MAX),
            column: u32::try_from(column).unwrap_or(u32::MAX),
            message: message.into(),
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}", self.line, self.column, self.message)
    }
}

/// All faults of a file, in the order of its lines.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Faults(pub Vec<Fault>);

/// Mistakes that are shown. The limit is for a file of another kind, which has a fault in each
/// line.
const SHOWN: usize = 20;
/// Characters of a line that are shown.
const WIDTH: usize = 100;

impl Faults {
    /// Writes the faults as a compiler does: `file:line:column: message`, the line, and a caret
    /// below it. A mistake that many lines make is shown once, at the first of them, with their
    /// count.
    pub fn show(&self, file: &str, text: &str) -> String {
        let lines: Vec<&str> = text.lines().collect();
        let causes = self.causes();
        let shown = causes.iter().take(SHOWN);
        let mut all: Vec<String> = shown.map(|cause| cause.show(file, &lines)).collect();
        if causes.len() > SHOWN {
            all.push(format!("{file}: and {} more", causes.len() - SHOWN));
        }
        all.join("\n")
    }

    /// The mistakes, each with the faults that it makes, in the order of their first lines.
    fn causes(&self) -> Vec<Cause<'_>> {
        let mut causes: Vec<Cause<'_>> = Vec::new();
        let mut places = HashMap::new();
        for fault in &self.0 {
            let place = *places
                .entry(without_place(&fault.message))
                .or_insert(causes.len());
            match causes.get_mut(place) {
                Some(cause) => {
                    cause.last = Some((cause.last.map_or(1, |(more, _)| more + 1), fault.line))
                }
                None => causes.push(Cause {
                    first: fault,
                    last: None,
                }),
            }
        }
        causes
    }
}

/// A message without the length that it begins with, such as `X1234`: other lines make the same
/// mistake with another one.
fn without_place(message: &str) -> &str {
    match message.split_once(": ") {
        Some((word, rest))
            if word.starts_with(['X', 'Y', 'Z', 'I', 'J', 'C']) && !word.contains(' ') =>
        {
            rest
        }
        _ => message,
    }
}

/// A mistake that one line or more make.
struct Cause<'a> {
    first: &'a Fault,
    /// The number of further faults, and the line of the last one.
    last: Option<(usize, u32)>,
}

impl Cause<'_> {
    fn show(&self, file: &str, lines: &[&str]) -> String {
        let first = one(file, lines, self.first);
        match self.last {
            None => first,
            Some((1, line)) => format!("{first}\n       = once more: line {line}"),
            Some((more, line)) => format!("{first}\n       = {more} times more, up to line {line}"),
        }
    }
}

fn one(file: &str, lines: &[&str], fault: &Fault) -> String {
    let line = lines.get(fault.line as usize - 1).copied().unwrap_or("");
    let shown: String = line.chars().take(WIDTH).map(printable).collect();
    let blanks = (fault.column as usize - 1).min(WIDTH);
    format!(
        "{file}:{fault}\n{:>6} | {shown}\n       | {:blanks$}^",
        fault.line, ""
    )
}

fn printable(c: char) -> char {
    match c {
        '\t' => ' ',
        c if c.is_control() => '·',
        c => c,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_caret_stands_under_the_column() {
        let faults = Faults(vec![Fault::new(2, 4, "no number")]);
        let shown = faults.show("a.drl", "M48\nX12Y\n");
        assert_eq!(shown, "a.drl:2:4: no number\n     2 | X12Y\n       |    ^");
    }

    #[test]
    fn a_file_of_another_kind_does_not_flood_the_screen() {
        let faults = (1..1000).map(|line| Fault::new(line, 1, format!("? {line}")));
        let faults = Faults(faults.collect());
        assert!(faults.show("a", "x").ends_with("a: and 979 more"));
    }

    #[test]
    fn a_mistake_that_many_lines_make_is_shown_once() {
        let lines = [(3, "a"), (5, "b"), (7, "a"), (9, "a"), (11, "b"), (12, "c")];
        let faults = Faults(lines.map(|(line, what)| Fault::new(line, 1, what)).to_vec());
        let shown = faults.show("f", "");
        let told: Vec<&str> = shown.lines().filter(|line| !line.contains('|')).collect();
        assert_eq!(
            told,
            [
                "f:3:1: a",
                "       = 2 times more, up to line 9",
                "f:5:1: b",
                "       = once more: line 11",
                "f:12:1: c",
            ]
        );
    }

    #[test]
    fn lengths_with_one_mistake_are_shown_once() {
        let faults = [
            (3, "X12: is short"),
            (4, "Y9: is short"),
            (5, "T2: is short"),
        ];
        let faults = Faults(
            faults
                .map(|(line, what)| Fault::new(line, 1, what))
                .to_vec(),
        );
        let shown = faults.show("f", "");
        assert_eq!(shown.matches("is short").count(), 2, "{shown}");
        assert!(shown.contains("once more: line 4"), "{shown}");
    }
}
