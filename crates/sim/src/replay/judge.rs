//! Compares a machine's answers with the answers of the recorded machine.
//!
//! * Lines that are no status report are the same, in the same order, through the whole
//!   conversation. In a line with positions (`[G54:`, `[PRB:`, ...), a number may differ by one
//!   unit of its last place.
//! * Status reports are compared one by one, with the same tolerance. In a conversation that is
//!   marked `timing`, the contents of a report depend on its instant. There only the states are
//!   compared, exchange by exchange, if the recorded exchange shows a state.

use super::case::{Case, Exchange};
use std::fmt;

/// The first place at which the answers of two machines differ.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Disagreement {
    /// The exchange's number, from 0.
    pub exchange: usize,
    /// The operation.
    pub op: String,
    /// The answer of the recorded machine.
    pub expected: String,
    /// The answer of this machine.
    pub found: String,
}

impl fmt::Display for Disagreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            exchange,
            op,
            expected,
            found,
        } = self;
        write!(
            f,
            "exchange {exchange}, `{op}`: expected {expected}, got {found}"
        )
    }
}

/// A line with the exchange that it came in.
type Line<'a> = (usize, &'a str);

/// Compares a machine's answers, `answered`, with the `recorded` ones; `None` if they agree.
pub fn judge(recorded: &Case, answered: &Case) -> Option<Disagreement> {
    let [expected, found] = [recorded, answered].map(|case| lines(&case.exchanges));
    let timing = recorded
        .other
        .get("timing")
        .is_some_and(|timing| timing == true);
    let said = differ(&only(&expected, false), &only(&found, false));
    let reported = || match timing {
        true => other_states(&recorded.exchanges, &answered.exchanges),
        false => differ(&only(&expected, true), &only(&found, true)),
    };
    let (exchange, expected, found) = said.or_else(reported)?;
    Some(Disagreement {
        exchange,
        op: recorded
            .exchanges
            .get(exchange)
            .map_or(String::new(), |at| at.op.clone()),
        expected,
        found,
    })
}

fn lines(exchanges: &[Exchange]) -> Vec<Line<'_>> {
    let all = exchanges.iter().enumerate();
    all.flat_map(|(number, exchange)| {
        exchange
            .recv
            .iter()
            .map(move |line| (number, line.as_str()))
    })
    .collect()
}

fn only<'a>(lines: &[Line<'a>], reports: bool) -> Vec<Line<'a>> {
    let chosen = lines.iter().filter(|(_, line)| is_report(line) == reports);
    chosen.copied().collect()
}

fn is_report(line: &str) -> bool {
    line.starts_with('<') && line.ends_with('>')
}

/// The first line that differs: its exchange, the expected text, and the text found.
fn differ(expected: &[Line<'_>], found: &[Line<'_>]) -> Option<(usize, String, String)> {
    let words =
        |line: Option<&Line<'_>>| line.map_or("nothing".into(), |(_, line)| format!("{line:?}"));
    let count = expected.len().max(found.len());
    (0..count).find_map(|at| match (expected.get(at), found.get(at)) {
        (Some((_, one)), Some((_, other))) if is_same(one, other) => None,
        (one, other) => {
            let exchange = one.or(other).map_or(0, |(exchange, _)| *exchange);
            Some((exchange, words(one), words(other)))
        }
    })
}

/// The first exchange in which the states differ. Exchanges in which the recorded machine shows no
/// state are left out.
fn other_states(expected: &[Exchange], found: &[Exchange]) -> Option<(usize, String, String)> {
    let pairs = expected.iter().zip(found).enumerate();
    let differ = |(number, (one, other)): (usize, (&Exchange, &Exchange))| {
        let [one, other] = [one, other].map(reports);
        let agree = one
            .iter()
            .all(|state| other.iter().any(|other| shows(state, other)))
            && other
                .iter()
                .all(|other| one.iter().any(|state| shows(state, other)));
        (!one.is_empty() && !agree).then(|| (number, format!("{one:?}"), format!("{other:?}")))
    };
    pairs.filter_map(differ).next()
}

fn reports(exchange: &Exchange) -> Vec<&str> {
    let all = exchange.recv.iter().map(String::as_str);
    all.filter(|line| is_report(line)).collect()
}

/// Returns true if two reports, the recorded one first, show the same state. A recorded `Hold:1` or
/// `Door:2` agrees with any `Hold` or `Door`, because the machines go on to the next state after
/// different times. A recorded `Run` or `Jog` at speed 0 begins or ends at this instant, so it
/// agrees with `Idle` too.
fn shows(one: &str, other: &str) -> bool {
    let state = |report| {
        str::trim_start_matches(report, '<')
            .split(['|', '>'])
            .next()
    };
    let [Some(recorded), Some(found)] = [one, other].map(state) else {
        return false;
    };
    let word = |state: &'_ str| state.split(':').next().unwrap_or_default().to_owned();
    match recorded {
        "Hold:1" | "Door:2" => word(recorded) == word(found),
        "Run" | "Jog" if one.contains("|FS:0,") => found == recorded || found == "Idle",
        _ => recorded == found,
    }
}

/// Returns true if two lines are the same. Numbers of positions may differ by one unit of their
/// last place.
fn is_same(one: &str, other: &str) -> bool {
    one == other || tells_positions(one) && same_but_for_last_places(one, other)
}

fn tells_positions(line: &str) -> bool {
    const NAMES: [&str; 6] = ["[G5", "[G28:", "[G30:", "[G92:", "[TLO:", "[PRB:"];
    is_report(line) || NAMES.iter().any(|name| line.starts_with(name))
}

fn same_but_for_last_places(one: &str, other: &str) -> bool {
    let [mut one, mut other] = [one, other].map(pieces);
    loop {
        match (one.next(), other.next()) {
            (None, None) => return true,
            (Some(one), Some(other)) if one == other || is_near(one, other) => {}
            _ => return false,
        }
    }
}

/// Splits a line into its numbers and the text between them.
fn pieces(line: &str) -> impl Iterator<Item = &str> {
    let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-');
    let mut rest = line;
    std::iter::from_fn(move || {
        let first = rest.chars().next()?;
        let end = rest
            .find(|c| is_number(c) != is_number(first))
            .unwrap_or(rest.len());
        let (piece, after) = rest.split_at(end);
        rest = after;
        Some(piece)
    })
}

/// Returns true if two numbers with the same count of decimals, 3 or 4, differ by at most one unit
/// of the last one.
fn is_near(one: &str, other: &str) -> bool {
    let decimals = |text: &str| {
        text.split_once('.')
            .map_or(0, |(_, decimals)| decimals.len())
    };
    let places = decimals(one);
    let alike = (3..=4).contains(&places) && decimals(other) == places;
    match (one.parse::<f64>(), other.parse::<f64>()) {
        (Ok(one), Ok(other)) if alike => {
            (one - other).abs() <= 1.001 * 10f64.powi(-(places as i32))
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(timing: bool, received: &[&[&str]]) -> Case {
        let exchange = |lines: &&[&str]| Exchange {
            op: "cmd ?".into(),
            t_ms: None,
            recv: lines.iter().map(ToString::to_string).collect(),
        };
        let mut case: Case = serde_json::from_str(r#"{"exchanges":[]}"#).unwrap();
        case.other.insert("timing".into(), timing.into());
        case.exchanges = received.iter().map(exchange).collect();
        case
    }

    fn agree(timing: bool, one: &[&[&str]], other: &[&[&str]]) -> bool {
        judge(&case(timing, one), &case(timing, other)).is_none()
    }

    #[test]
    fn lines_are_the_same_in_order_whenever_they_come() {
        assert!(agree(
            false,
            &[&["ok"], &["[PRB:1.000:1]"]],
            &[&["ok", "[PRB:1.001:1]"], &[]]
        ));
        assert!(!agree(
            false,
            &[&["ok"], &["[PRB:1.000:1]"]],
            &[&["ok"], &["[PRB:1.002:1]"]]
        ));
        assert!(!agree(false, &[&["ok", "error:1"]], &[&["error:1", "ok"]]));
        assert!(!agree(false, &[&["ok"]], &[&["ok", "ok"]]));
        assert!(!agree(false, &[&["$110=500.000"]], &[&["$110=500.001"]]));
    }

    #[test]
    fn reports_are_the_same_and_where_time_matters_their_states() {
        let run: &[&[&str]] = &[&["<Run|MPos:1.000|FS:500,0>"]];
        assert!(agree(false, run, &[&["<Run|MPos:1.001|FS:500,0>"]]));
        assert!(!agree(false, run, &[&["<Run|MPos:1.200|FS:500,0>"]]));
        assert!(!agree(false, run, &[&["<Run|MPos:1.000|FS:501,0>"]]));
        assert!(agree(true, run, &[&["<Run|MPos:3.200|FS:480,0>"]]));
        assert!(!agree(true, run, &[&["<Idle|MPos:3.200|FS:480,0>"]]));
    }

    #[test]
    fn a_disagreement_says_where_and_what() {
        let told = judge(
            &case(false, &[&["ok"], &["ok"]]),
            &case(false, &[&["ok"], &["error:9"]]),
        );
        let told = told.unwrap().to_string();
        assert_eq!(
            told,
            "exchange 1, `cmd ?`: expected \"ok\", got \"error:9\""
        );
    }
}
