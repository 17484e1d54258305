//! What is checked, by name.
mod motion;

use crate::{bench::Failure, firmware::Firmware};
use std::fmt::{self, Write};

/// One check.
pub(crate) struct Check {
    pub(crate) name: &'static str,
    /// What must hold.
    pub(crate) what: &'static str,
    /// It runs in `.ci/run firmware`.
    pub(crate) subset: bool,
    pub(crate) run: fn(&Firmware) -> Result<Figures, Failure>,
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let subset = if self.subset { "subset" } else { "" };
        write!(f, "{:<16} {subset:<7} {}", self.name, self.what)
    }
}

/// Measured on the way: printed, and written down in `docs/benchmarks.md`.
#[derive(Default)]
pub(crate) struct Figures(String);

impl Figures {
    /// Adds a row.
    pub(crate) fn add(&mut self, name: impl fmt::Display, value: impl fmt::Display) {
        // Writing to a string does not fail.
        let _ = writeln!(self.0, "    {name}: {value}");
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// All checks.
pub(crate) const CHECKS: &[Check] = &[
    Check {
        name: "queued-traces",
        what: "recorded programs, wholly queued before the start: every interval equal to the tick",
        subset: true,
        run: motion::queued_traces,
    },
    Check {
        name: "queued-examples",
        what: "example jobs of up to 1000 moves, wholly queued: every interval equal to the tick",
        subset: false,
        run: motion::queued_examples,
    },
];
