//! The step list: one row of CSV for each instant at which a motor steps.
//!
//! ```text
//! cycle,step,dir,power
//! 5042118,1,0,0.000
//! ```
//!
//! `cycle` is the CPU cycle of the rising edges, counted from power-up. `step` is a mask of the
//! motors that step (X = 1, Y = 2, Z = 4, A = 8, …). `dir` is a mask of all motors that turn in the
//! negative direction. `power` is the spindle or laser output at that moment in S units, to 3
//! decimals.

use leadscrew_stepper::MotorMask;
use std::io::{self, Write};

/// Writes the step list.
#[derive(Debug)]
pub(crate) struct StepsCsv<W> {
    out: W,
}

impl<W: Write> StepsCsv<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// The error of `out`.
    pub(crate) fn new(mut out: W) -> io::Result<Self> {
        out.write_all(b"cycle,step,dir,power\n")?;
        Ok(Self { out })
    }

    /// Writes the row of one step event.
    ///
    /// # Errors
    /// The error of `out`.
    pub(crate) fn step(
        &mut self,
        cycle: u64,
        step: MotorMask,
        direction: MotorMask,
        power_s: f64,
    ) -> io::Result<()> {
        let milli_s = (power_s * 1000.0).round() as u64;
        writeln!(
            self.out,
            "{cycle},{},{},{}.{:03}",
            step.bits(),
            direction.bits(),
            milli_s / 1000,
            milli_s % 1000
        )
    }

    /// Flushes the output.
    ///
    /// # Errors
    /// The error of `out`.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_has_cycle_masks_and_power_to_three_decimals() {
        let mut out = Vec::new();
        let mut csv = StepsCsv::new(&mut out).unwrap();
        let (x, y) = (MotorMask::only(0), MotorMask::only(1));
        csv.step(42, x.with(y), y, 12.3456).unwrap();
        csv.finish().unwrap();
        assert_eq!(
            String::from_utf8(out).unwrap(),
            "cycle,step,dir,power\n42,3,2,12.346\n"
        );
    }
}
