//! The waveform: a Value Change Dump (IEEE 1364, clause 18) that GTKWave opens.
//!
//! The step and direction pins of every motor, the motors' enable and each synchronised output (M62
//! to M65) have a wire each. The compare level of the spindle's or laser's PWM is a 16-bit value.
//! Time is in nanoseconds since power-up.

use leadscrew_stepper::MotorMask;
use std::io::{self, Write};
use vcd::{IdCode, SimulationCommand, TimescaleUnit, Value, VarType, Writer};

/// The conversion of CPU cycles to nanoseconds: 1000 / 168 MHz = 125 / 21.
const NANOSECONDS: u64 = 125;
const PER_CYCLES: u64 = 21;

/// Writes the waveform.
pub(crate) struct Waveform<W: Write> {
    out: Writer<W>,
    step: Vec<IdCode>,
    direction: Vec<IdCode>,
    enable: IdCode,
    pwm: IdCode,
    outputs: Vec<IdCode>,
    /// The nanosecond of the last change, `None` before the first.
    now: Option<u64>,
}

impl<W: Write> Waveform<W> {
    /// Writes the header and the levels at power-up, which are all low. `names` has a letter for
    /// each motor; `outputs` is the number of synchronised outputs.
    ///
    /// # Errors
    /// The error of `out`.
    pub(crate) fn new(out: W, names: &[char], outputs: u8) -> io::Result<Self> {
        let mut out = Writer::new(out);
        out.timescale(1, TimescaleUnit::NS)?;
        out.add_module("leadscrew")?;
        let step = wires(&mut out, names, "step")?;
        let direction = wires(&mut out, names, "direction")?;
        let enable = out.add_wire(1, "enable")?;
        let pwm = out.add_var(VarType::Wire, 16, "spindle_pwm", None)?;
        let outputs = (0..outputs).map(|index| out.add_wire(1, &format!("output_{index}")));
        let outputs = outputs.collect::<io::Result<_>>()?;
        out.upscope()?;
        out.enddefinitions()?;
        let mut waveform = Self {
            out,
            step,
            direction,
            enable,
            pwm,
            outputs,
            now: None,
        };
        waveform.power_up()?;
        Ok(waveform)
    }

    fn power_up(&mut self) -> io::Result<()> {
        self.out.begin(SimulationCommand::Dumpvars)?;
        let wires = self.step.iter().chain(&self.direction);
        for id in wires.chain(&self.outputs) {
            self.out.change_scalar(*id, Value::V0)?;
        }
        self.out.change_scalar(self.enable, Value::V0)?;
        self.out.change_vector(self.pwm, bits(0))?;
        self.out.end()
    }

    /// Writes that the step pins changed to the levels `high` (electrical).
    ///
    /// # Errors
    /// The error of `out`.
    pub(crate) fn step(
        &mut self,
        cycle: u64,
        changed: MotorMask,
        high: MotorMask,
    ) -> io::Result<()> {
        self.at(cycle)?;
        change(&mut self.out, &self.step, changed, high)
    }

    /// Writes that the direction pins changed to the levels `high` (electrical).
    ///
    /// # Errors
    /// The error of `out`.
    pub(crate) fn direction(
        &mut self,
        cycle: u64,
        changed: MotorMask,
        high: MotorMask,
    ) -> io::Result<()> {
        self.at(cycle)?;
        change(&mut self.out, &self.direction, changed, high)
    }

    /// Writes the level of the enable pin.
    ///
    /// # Errors
    /// The error of `out`.
    pub(crate) fn enable(&mut self, cycle: u64, high: bool) -> io::Result<()> {
        self.at(cycle)?;
        self.out.change_scalar(self.enable, high)
    }

    /// Writes the PWM's compare level.
    ///
    /// # Errors
    /// The error of `out`.
    pub(crate) fn pwm(&mut self, cycle: u64, level: u16) -> io::Result<()> {
        self.at(cycle)?;
        self.out.change_vector(self.pwm, bits(level))
    }

    /// Writes the levels of the synchronised outputs, one bit each.
    ///
    /// # Errors
    /// The error of `out`.
    pub(crate) fn outputs(&mut self, cycle: u64, levels: u8) -> io::Result<()> {
        self.at(cycle)?;
        for (index, id) in self.outputs.iter().enumerate() {
            self.out.change_scalar(*id, levels >> index & 1 == 1)?;
        }
        Ok(())
    }

    /// Flushes the output.
    ///
    /// # Errors
    /// The error of `out`.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        self.out.flush()
    }

    fn at(&mut self, cycle: u64) -> io::Result<()> {
        let now = cycle * NANOSECONDS / PER_CYCLES;
        if self.now == Some(now) {
            return Ok(());
        }
        self.now = Some(now);
        self.out.timestamp(now)
    }
}

fn wires<W: Write>(out: &mut Writer<W>, names: &[char], what: &str) -> io::Result<Vec<IdCode>> {
    names
        .iter()
        .map(|name| out.add_wire(1, &format!("{}_{what}", name.to_ascii_lowercase())))
        .collect()
}

fn change<W: Write>(
    out: &mut Writer<W>,
    wires: &[IdCode],
    changed: MotorMask,
    high: MotorMask,
) -> io::Result<()> {
    for (motor, id) in wires.iter().enumerate() {
        if changed.contains(motor) {
            out.change_scalar(*id, high.contains(motor))?;
        }
    }
    Ok(())
}

fn bits(level: u16) -> impl Iterator<Item = Value> {
    (0..16)
        .rev()
        .map(move |bit| Value::from(level >> bit & 1 == 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dump_reads_back_with_times_in_nanoseconds() {
        let mut out = Vec::new();
        let mut wave = Waveform::new(&mut out, &['X', 'Y'], 2).unwrap();
        let x = MotorMask::only(0);
        wave.step(168, x, x).unwrap();
        wave.step(336, x, MotorMask::NONE).unwrap();
        wave.pwm(336, 5).unwrap();
        wave.outputs(336, 0b10).unwrap();
        wave.finish().unwrap();
        let text = String::from_utf8(out).unwrap();
        for part in [
            "$timescale 1 ns $end",
            "x_step",
            "y_direction",
            "output_1",
            "#1000\n",
            "#2000\n",
            "b0000000000000101",
        ] {
            assert!(text.contains(part), "{part} in\n{text}");
        }
        assert_eq!(text.matches("#2000").count(), 1);
    }
}
