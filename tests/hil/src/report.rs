//! The report: one file to read and to send in.
use std::{fmt, ops::RangeInclusive};

/// One measurement.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    /// The measured thing.
    pub(crate) what: String,
    /// The expected value.
    pub(crate) expected: String,
    /// The measured value.
    pub(crate) measured: String,
    pub(crate) holds: bool,
}

impl Row {
    /// A figure that has to lie from `least` to `most`.
    pub(crate) fn within(what: &str, figure: f64, least: f64, most: f64, unit: &str) -> Self {
        Row {
            what: what.into(),
            expected: format!("{least:.3} to {most:.3} {unit}"),
            measured: format!("{figure:.3} {unit}"),
            holds: (least..=most).contains(&figure),
        }
    }

    /// The same row with a remark beside its figure.
    pub(crate) fn noting(mut self, remark: impl fmt::Display) -> Self {
        self.measured = format!("{}, {remark}", self.measured);
        self
    }

    /// A figure that has to be `least` or more.
    pub(crate) fn at_least(what: &str, figure: f64, least: f64, unit: &str) -> Self {
        Row {
            what: what.into(),
            expected: format!("{least:.3} {unit} or more"),
            measured: format!("{figure:.3} {unit}"),
            holds: figure >= least,
        }
    }

    /// A count that has to be in a range.
    pub(crate) fn count(what: &str, found: usize, expected: RangeInclusive<usize>) -> Self {
        let (least, most) = (expected.start(), expected.end());
        Row {
            what: what.into(),
            expected: match least == most {
                true => least.to_string(),
                false => format!("{least} to {most}"),
            },
            measured: found.to_string(),
            holds: expected.contains(&found),
        }
    }

    /// A count that has to be `expected`.
    pub(crate) fn equal(what: &str, found: usize, expected: usize) -> Self {
        Row::count(what, found, expected..=expected)
    }
}

/// The measures of one subject.
pub(crate) struct Section {
    pub(crate) name: &'static str,
    /// The way in which it was measured, in a sentence.
    pub(crate) how: &'static str,
    pub(crate) rows: Vec<Row>,
}

impl Section {
    /// Returns true if all rows hold.
    pub(crate) fn holds(&self) -> bool {
        self.rows.iter().all(|row| row.holds)
    }
}

/// The whole report.
pub(crate) struct Report {
    /// The version of this program's sources, as git names it.
    pub(crate) sources: String,
    /// The line to the board.
    pub(crate) link: String,
    /// The board's own words about its build.
    pub(crate) build: Vec<String>,
    /// True if the board was emulated: the report then explains what that means.
    pub(crate) is_emulated: bool,
    pub(crate) sections: Vec<Section>,
}

/// The properties that this test cannot show.
const UNSEEN: &str = "\
Not seen by this test:
  all that is common to the edge and to the timer that captures it: both count the same clock. Only its mean rate is compared,
    with this computer's clock, and only to half a percent
  what the captures change: each takes DMA and the bus of TIM2 for some cycles, and the core may wait for it
  a schedule that is wrong by less than the bounds above, such as each tick a count late
  levels, slopes and noise of the pins under load: an edge is the instant at which an input takes it for one
  the steps and directions of Z, the direction of Y, limit switches, probe, door, hold and start, USB, the enable pin, the spindle's
    pins, mist
  starts, failures, lost power: cargo fw-test has them in the emulator
  motors, drivers, the laser
";

/// The meaning of the report of an emulated board.
const EMULATED: &str = "\
THE BOARD WAS EMULATED. That this report passes shows that the test measures, and that firmware and simulator agree. It shows
nothing about a chip.
";

impl Report {
    /// Returns true if all sections hold.
    pub(crate) fn holds(&self) -> bool {
        self.sections.iter().all(Section::holds)
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "leadscrew: the board's own edges against the simulator's\n"
        )?;
        writeln!(f, "tool    {}", self.sources)?;
        writeln!(f, "line    {}", self.link)?;
        for line in &self.build {
            writeln!(f, "board   {line}")?;
        }
        let verdict = if self.holds() { "PASSED" } else { "FAILED" };
        writeln!(f, "result  {verdict}\n")?;
        if self.is_emulated {
            writeln!(f, "{EMULATED}")?;
        }
        for section in &self.sections {
            writeln!(f, "{}: {}", section.name, section.how)?;
            for row in &section.rows {
                let verdict = if row.holds { "ok    " } else { "FAILED" };
                writeln!(
                    f,
                    "  {verdict} {:<68} {:<32} expected {}",
                    row.what, row.measured, row.expected
                )?;
            }
            writeln!(f)?;
        }
        f.write_str(UNSEEN)
    }
}
