//! Replays the recorded conversations with Grbl 1.1h. The lines must be the same, except for the
//! differences in `conformance/deviations.toml`.
//!
//! The tests check the lines that do not depend on time: every line that is no status report, in
//! order (rule 1 of `conformance/compare.py`). `.ci/run conformance` checks all rules.

use leadscrew_sim::replay::{judge, replay, replay_on, Case, Exchange};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// The number of rules that permit a difference: D1 to D34, see `conformance/README.md`.
const RULES: usize = 34;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("conformance")
}

/// All recordings, with their names as rows spell them: `GROUP/NAME`.
fn cases() -> Vec<(String, Case)> {
    let groups = fs::read_dir(folder().join("cases")).unwrap();
    let folders = groups.map(|group| group.unwrap().path());
    folders
        .chain([folder().join("round2"), folder().join("round3")])
        .flat_map(|folder| cases_in(&folder))
        .collect()
}

fn cases_in(folder: &Path) -> Vec<(String, Case)> {
    let files = fs::read_dir(folder).unwrap();
    let read = |file: PathBuf| {
        let case: Case = serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap();
        let of = |key: &str| case.other[key].as_str().unwrap();
        (format!("{}/{}", of("group"), of("name")), case)
    };
    files.map(|file| read(file.unwrap().path())).collect()
}

/// The rows of permitted differences.
fn rows() -> Vec<Value> {
    let text = fs::read_to_string(folder().join("deviations.toml")).unwrap();
    let mut table: Value = toml::from_str(&text).unwrap();
    serde_json::from_value(table["row"].take()).unwrap()
}

fn lines(of: &Value) -> Vec<String> {
    serde_json::from_value(of.clone()).unwrap()
}

/// Puts the text that a row permits in place of the recorded one.
fn apply(row: &Value, case: &mut Case) {
    let rule = row["rule"].as_str().unwrap();
    let known = (1..=RULES).any(|number| rule == format!("D{number}"));
    assert!(known, "no such rule: {row}");
    let exchange = &mut case.exchanges[row["op"].as_u64().unwrap() as usize];
    assert_eq!(
        exchange.recv,
        lines(&row["grbl"]),
        "not what was recorded: {row}"
    );
    exchange.recv = lines(&row["leadscrew"]);
}

/// Every line that is no status report.
fn said(exchanges: &[Exchange]) -> Vec<&str> {
    let all = exchanges.iter().flat_map(|exchange| &exchange.recv);
    all.map(String::as_str)
        .filter(|line| !(line.starts_with('<') && line.ends_with('>')))
        .collect()
}

/// Returns true if a line is as expected. Lines with positions may differ by one unit of the last
/// decimal; all other lines must be the same to the byte.
fn agrees(expected: &str, found: &str) -> bool {
    const POSITIONS: [&str; 10] = [
        "[G54:", "[G55:", "[G56:", "[G57:", "[G58:", "[G59:", "[G28:", "[G30:", "[G92:", "[TLO:",
    ];
    let tolerant = POSITIONS
        .iter()
        .chain(&["[PRB:"])
        .any(|start| expected.starts_with(start));
    if !tolerant {
        return expected == found;
    }
    let (expected, found) = (parts(expected), parts(found));
    expected.len() == found.len()
        && expected
            .iter()
            .zip(&found)
            .all(|(e, f)| e == f || is_near(e, f))
}

/// The texts between colons, commas and brackets.
fn parts(line: &str) -> Vec<&str> {
    line.split([':', ',', '[', ']']).collect()
}

/// Returns true if two numbers of 3 or 4 decimals differ by at most one unit of the last decimal.
fn is_near(expected: &str, found: &str) -> bool {
    let units = |number: &str| {
        let (_, places) = number.split_once('.')?;
        let units: i64 = number.replace('.', "").parse().ok()?;
        Some((places.len(), units)).filter(|(places, _)| *places >= 3)
    };
    match (units(expected), units(found)) {
        (Some((e_places, e)), Some((f_places, f))) => e_places == f_places && e.abs_diff(f) <= 1,
        (_, _) => false,
    }
}

/// The first line at which two conversations differ.
fn first_difference(expected: &[&str], found: &[&str]) -> Option<String> {
    (0..expected.len().max(found.len())).find_map(|number| {
        let (e, f) = (expected.get(number), found.get(number));
        let same = matches!((e, f), (Some(e), Some(f)) if agrees(e, f));
        (!same).then(|| format!("line {number}: expected {e:?}, found {f:?}"))
    })
}

#[test]
fn every_recorded_conversation_is_held_as_with_grbl() {
    let (cases, rows) = (cases(), rows());
    assert!(cases.len() >= 222, "only {} recordings", cases.len());
    let mut differences = Vec::new();
    for (name, mut case) in cases {
        let answered = replay(&case).unwrap();
        rows.iter()
            .filter(|row| row["case"] == *name)
            .for_each(|row| apply(row, &mut case));
        let difference = first_difference(&said(&case.exchanges), &said(&answered.exchanges));
        differences.extend(difference.map(|difference| format!("{name}: {difference}")));
    }
    assert!(differences.is_empty(), "\n{}", differences.join("\n"));
}

/// A machine that has three axes answers the same, to the byte, whether it is built for three axes
/// or for four.
#[test]
fn an_axis_that_is_absent_is_never_heard_of() {
    let written = cases_in(&folder().join("written"));
    for (name, case) in cases().into_iter().chain(written) {
        let (three, four) = (replay(&case).unwrap(), replay_on::<4>(&case).unwrap());
        assert_eq!(three.exchanges.len(), four.exchanges.len(), "{name}");
        for (three, four) in three.exchanges.iter().zip(&four.exchanges) {
            assert_eq!(three.recv, four.recv, "{name}: {}", three.op);
        }
    }
}

/// All lines that were heard. If the case depends on time, reports keep all fields (state,
/// switches, overrides), but without the numbers that change with time.
fn heard(case: &Case, exchanges: &[Exchange]) -> Vec<String> {
    let timing = case.other["timing"] == true;
    let all = exchanges.iter().flat_map(|exchange| &exchange.recv);
    let steady = |field: &str| match field.split_once(':') {
        Some((name @ ("MPos" | "WPos" | "FS" | "WCO"), _)) => name.to_owned(),
        Some(_) | None => field.to_owned(),
    };
    let shown = |line: &String| match line.starts_with('<') && timing {
        true => line.split('|').map(steady).collect::<Vec<_>>().join("|"),
        false => line.clone(),
    };
    all.map(shown).collect()
}

/// These conversations were never recorded. They combine things that no recording combines, and
/// their answers were written after Grbl's documents ("Grbl v1.1 Interface", "Commands",
/// "Configuration").
#[test]
fn every_conversation_written_from_grbl_s_documents_is_held_as_written() {
    let cases = cases_in(&folder().join("written"));
    assert!(cases.len() >= 50, "only {} conversations", cases.len());
    for (name, case) in cases {
        let answered = replay(&case).unwrap();
        let (expected, found) = (
            heard(&case, &case.exchanges),
            heard(&case, &answered.exchanges),
        );
        assert_eq!(expected, found, "{name}");
    }
}

/// `leadscrew replay --judge` must find a difference exactly if a row of known differences says
/// so.
#[test]
fn a_conversation_is_judged_to_differ_where_a_row_says_so_and_nowhere_else() {
    let rows = rows();
    for (name, case) in cases() {
        let of_case = rows.iter().filter(|row| row["case"] == *name);
        let differing: Vec<u64> = of_case.map(|row| row["op"].as_u64().unwrap()).collect();
        let told = judge(&case, &replay(&case).unwrap());
        match &told {
            None => {
                // A difference in the fields of a report does not count if they depend on time.
                let timing = case.other["timing"] == true;
                assert!(differing.is_empty() || timing, "{name}");
            }
            Some(told) => assert!(!differing.is_empty(), "{name}: {told}"),
        }
    }
}

#[test]
fn every_row_of_a_permitted_difference_belongs_to_a_recording() {
    let cases = cases();
    for row in rows() {
        assert!(cases.iter().any(|(name, _)| row["case"] == **name), "{row}");
    }
}

#[test]
fn positions_may_differ_by_a_unit_and_nothing_else_may() {
    assert!(agrees(
        "[G54:-0.000,1.000,0.000]",
        "[G54:0.000,1.001,0.000]"
    ));
    assert!(!agrees(
        "[G54:0.000,1.000,0.000]",
        "[G54:0.000,1.002,0.000]"
    ));
    assert!(!agrees(
        "[PRB:0.000,0.000,1.000:1]",
        "[PRB:0.000,0.000,1.000:0]"
    ));
    assert!(!agrees("[G54:0.000]", "[G54:0.0000]"));
    assert!(!agrees("$11=0.010", "$11=0.011"));
}
