//! What is checked, by name.
mod motion;
mod planted;
mod raster;
mod realtime;
mod streams;
mod timing;

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
    Check {
        name: "full-queue",
        what: "jobs longer than the queue on a line that keeps it full: every interval equal to the tick",
        subset: false,
        run: streams::full_queue,
    },
    Check {
        name: "stream-short",
        what: "recorded programs at 115200 baud: the same path, time within 1 %",
        subset: true,
        run: streams::short,
    },
    Check {
        name: "stream-traces",
        what: "all recorded programs at 115200 baud: the same path, time within 1 %",
        subset: false,
        run: streams::traces,
    },
    Check {
        name: "stream-examples",
        what: "example jobs at 115200 baud: the same path, time within 1 %",
        subset: false,
        run: streams::examples,
    },
    Check {
        name: "stream-fast",
        what: "example jobs at 2 Mbaud: the same path, time within 1 %",
        subset: false,
        run: streams::fast_examples,
    },
    Check {
        name: "step-interrupt",
        what: "three motors, cold flash caches: at most 180 cycles from entry to exit",
        subset: false,
        run: timing::step_interrupt,
    },
    Check {
        name: "jitter",
        what: "step edges against the schedule at every ratio of period to pulse: at most 40 cycles",
        subset: false,
        run: timing::jitter_at_every_ratio,
    },
    Check {
        name: "rate",
        what: "three motors at 250 kHz with the shortest pulses: no late event",
        subset: true,
        run: timing::highest_rate,
    },
    Check {
        name: "reset-byte",
        what: "0x18 in motion: last step edge within 1 ms, power off",
        subset: true,
        run: realtime::reset_byte,
    },
    Check {
        name: "raster",
        what: "at least 10 000 lines of 14 bytes a second",
        subset: false,
        run: raster::raster_lines,
    },
    Check {
        name: "planted",
        what: "faults planted in the firmware are found",
        subset: true,
        run: planted::planted_faults,
    },
];
