//! The checks, in the order in which they run.
mod clock;
mod power;
mod steps;
mod stop;
mod stores;
mod wiring;

use crate::{
    board::Board,
    failure::Failure,
    report::{Row, Section},
};

/// A check.
pub(crate) struct Check {
    pub(crate) name: &'static str,
    how: &'static str,
    run: fn(&mut Board<'_>) -> Result<Vec<Row>, Failure>,
}

/// All checks.
pub(crate) const CHECKS: &[Check] = &[
    Check {
        name: "wires",
        how: "a short job for each wire: the edges that come by it",
        run: wiring::each,
    },
    Check {
        name: "clock",
        how: "counts of the board's timer in two seconds of this computer's clock",
        run: clock::rate,
    },
    Check {
        name: "steps",
        how: "a job with ramps and turns: each edge of X and each level of its direction against the simulator's",
        run: steps::with_direction,
    },
    Check {
        name: "second motor",
        how: "the same job: each edge of Y",
        run: steps::second_motor,
    },
    Check {
        name: "highest rate",
        how: "three motors at 370 000 steps/s with pulses of 1 us: each edge of X",
        run: steps::highest_rate,
    },
    Check {
        name: "duty",
        how: "power at rest, periods of the PWM at some values of S: high counts, of 8400",
        run: power::duty,
    },
    Check {
        name: "laser",
        how: "a laser move under M4: power against the steps of X",
        run: power::in_motion,
    },
    Check {
        name: "stop",
        how: "flood coolant presses the reset button in motion, by a wire: from its edge on; the latest of three",
        run: stop::by_button,
    },
    Check {
        name: "flash",
        how: "M8, a setting, M9: the time from edge to edge of flood coolant, with a new value beyond that with the old one",
        run: stores::stall,
    },
];

/// The lines with which every check begins: the machine's defaults, except for full power at S1000
/// and no reserve for a stalled sender. No setting of an earlier check stays.
const FRESH: &str = "$RST=$\n$30=1000\n$710=0\n";

impl Check {
    /// Runs the check on a board that is on. A check that cannot measure does not hold.
    pub(crate) fn run(&self, board: &mut Board<'_>) -> Section {
        let rows = fresh(board).and_then(|()| (self.run)(board));
        let rows = rows.unwrap_or_else(|Failure(words)| {
            vec![Row {
                what: "not measured".into(),
                expected: "measured".into(),
                measured: words,
                holds: false,
            }]
        });
        Section {
            name: self.name,
            how: self.how,
            rows,
        }
    }
}

/// Brings the machine to rest with the settings [`FRESH`].
fn fresh(board: &mut Board<'_>) -> Result<(), Failure> {
    board.reset()?;
    board.stream(FRESH)?;
    board.reset()
}
