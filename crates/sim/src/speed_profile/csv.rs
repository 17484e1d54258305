//! The list of stretches as CSV.
//!
//! ```text
//! line,begin_s,end_s,phase,length_mm,begin_mm_min,end_mm_min,acceleration_mm_s2,begin_power_percent,…
//! 2,0.010021,0.843354321,accelerate,3.472,0.000,500.000,10.000,0.000,0.000,acceleration X,stop,$120
//! ```
//!
//! Times are seconds since the first byte of the job, with nine decimals: finer than a CPU cycle.
//! Each row begins when the one before ends; the last one ends at the job's time.

use super::Stretch;
use crate::clock::{seconds, Cycle};
use std::io::{self, Write};

const HEADER: &str =
    "line,begin_s,end_s,phase,length_mm,begin_mm_min,end_mm_min,acceleration_mm_s2,\
    begin_power_percent,end_power_percent,limit,because,held_by";

/// Writes the stretches of a job that began at `begin`, on a machine whose axes have these letters.
///
/// # Errors
/// The error of `out`.
pub fn write_csv<W: Write>(
    mut out: W,
    begin: Cycle,
    stretches: &[Stretch],
    letters: &[char],
) -> io::Result<()> {
    writeln!(out, "{HEADER}")?;
    for stretch in stretches {
        let [from, to] = [stretch.begin, stretch.end].map(|cycle| seconds(cycle - begin));
        let [v0, v1] = stretch.speed.map(|speed| speed * 60.0);
        let [p0, p1] = stretch.power.map(|share| share * 100.0);
        writeln!(
            out,
            "{},{from:.9},{to:.9},{},{:.4},{v0:.3},{v1:.3},{:.3},{p0:.2},{p1:.2},{},{},{}",
            stretch.line,
            stretch.phase.name(),
            stretch.length,
            stretch.acceleration(),
            stretch.limit.name(letters),
            stretch.limit.because(letters),
            stretch.limit.held_by(),
        )?;
    }
    out.flush()
}
