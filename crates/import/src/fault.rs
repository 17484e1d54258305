//! A text that a reader did not understand, and its place.

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

/// Faults that are shown one by one. The limit is for a file of another kind, which has a fault in
/// each line.
const SHOWN: usize = 20;
/// Characters of a line that are shown.
const WIDTH: usize = 100;

impl Faults {
    /// Writes the faults as a compiler does: `file:line:column: message`, the line, and a caret
    /// below it.
    pub fn show(&self, file: &str, text: &str) -> String {
        let lines: Vec<&str> = text.lines().collect();
        let shown = self.0.iter().take(SHOWN);
        let mut all: Vec<String> = shown.map(|fault| one(file, &lines, fault)).collect();
        if self.0.len() > SHOWN {
            all.push(format!("{file}: and {} more", self.0.len() - SHOWN));
        }
        all.join("\n")
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
        let faults = Faults((1..1000).map(|line| Fault::new(line, 1, "?")).collect());
        assert!(faults.show("a", "x").ends_with("a: and 979 more"));
    }
}
