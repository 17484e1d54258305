//! Figures that documents state and checks measure: a document must state those of this firmware.
use crate::{
    bench::{ensure, Failure},
    job,
};
use std::fs;

/// The most by which a stated figure may be from the measured one, as a share.
const OFF: f64 = 0.02;

/// A row of a table: the file, the text of its last column, and the column with the figures,
/// counted from 0.
pub(crate) struct Row {
    pub(crate) file: &'static str,
    pub(crate) last: &'static str,
    pub(crate) column: usize,
}

/// Checks the figures of a row, in their order; `None` passes over one that is not measured.
///
/// # Errors
/// There is no such row, or a figure is more than 2 % off; the error says what is to be written.
pub(crate) fn ensure_stated(row: &Row, measured: &[Option<f64>]) -> Result<(), Failure> {
    let text = fs::read_to_string(job::repository().join(row.file))?;
    let cells = |line: &str| {
        let cells: Vec<String> = line
            .trim_matches('|')
            .split('|')
            .map(|cell| cell.trim().into())
            .collect();
        cells
    };
    let found = text
        .lines()
        .map(cells)
        .find(|cells| cells.last().is_some_and(|last| last == row.last));
    let cell = found.and_then(|cells| cells.get(row.column).cloned());
    let Row { file, last, .. } = row;
    let cell = cell.ok_or_else(|| Failure(format!("{file} has no row that ends in {last}")))?;
    let stated = numbers(&cell);
    let fits = |(place, value): (usize, &Option<f64>)| {
        let near = |stated: &f64, value: f64| (stated / value - 1.0).abs() <= OFF;
        value.is_none_or(|value| stated.get(place).is_some_and(|stated| near(stated, value)))
    };
    ensure(measured.iter().enumerate().all(fits), || {
        let measured: Vec<String> = measured
            .iter()
            .map(|value| value.map_or("...".into(), |value| format!("{value:.0}")))
            .collect();
        format!(
            "{file}, the row that ends in {last}, states {cell:?}; measured: {}",
            measured.join(", ")
        )
    })
}

/// The numbers in a text. A blank before three digits parts thousands.
fn numbers(text: &str) -> Vec<f64> {
    let bytes = text.as_bytes();
    let digits = |from: usize| {
        bytes[from.min(bytes.len())..]
            .iter()
            .take_while(|byte| byte.is_ascii_digit())
            .count()
    };
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let mut length = digits(at);
        if length == 0 {
            at += 1;
            continue;
        }
        let mut number = text[at..at + length].to_owned();
        while bytes.get(at + length) == Some(&b' ') && digits(at + length + 1) == 3 {
            number += &text[at + length + 1..at + length + 4];
            length += 4;
        }
        if bytes.get(at + length) == Some(&b'.') && digits(at + length + 1) > 0 {
            let more = 1 + digits(at + length + 1);
            number += &text[at + length..at + length + more];
            length += more;
        }
        found.extend(number.parse::<f64>());
        at += length;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_thousands_and_fractions() {
        assert_eq!(
            numbers("**8 579 a second**, 0.15 us, 184 000 events, 202 at most, 448."),
            [8579.0, 0.15, 184_000.0, 202.0, 448.0]
        );
    }

    #[test]
    fn a_stated_figure_that_is_another_firmwares_is_found() {
        let row = Row {
            file: "README.md",
            last: "`cargo fw-test raster`",
            column: 2,
        };
        let stated = fs::read_to_string(job::repository().join(row.file)).unwrap();
        let line = stated.lines().find(|line| line.contains(row.last)).unwrap();
        let rate = numbers(line.split('|').nth(3).unwrap())[0];
        assert!(ensure_stated(&row, &[Some(rate * 1.01)]).is_ok());
        let error = ensure_stated(&row, &[Some(rate * 1.04)]).err().unwrap();
        assert!(error.0.contains("README.md"), "{error}");
        let none = Row {
            last: "`nobody`",
            ..row
        };
        assert!(ensure_stated(&none, &[]).is_err());
    }
}
