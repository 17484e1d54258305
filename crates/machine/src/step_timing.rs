//! The highest rate of steps: one function of board, pulse width, direction set-up and
//! number of motors.
//!
//! ```text
//!  tick      |------------ shortest tick ------------|
//!  interrupt |== step ==|  |= end =|                  |== step ==|
//!  step pin   ______________                           ______________
//!         ___|     pulse    |_________________________|
//!  direction                   X  new |--- set-up ----|
//!                           |--| pulse end
//! ```
//!
//! Two things bound the rate: the time that the board's interrupts take, and the pins, which must
//! have fallen, with new directions settled, before they rise again. Motion is capped at the rate
//! that both allow. Step smoothing keeps to this rate, too.

use crate::settings::values::StepLimits;
use core::fmt;
use leadscrew_stepper::MAX_MOTORS;

/// The longest time from one tick to the next, ns, with the longest pulse and as many motors as
/// there can be. A tick has to fit into the shortest of segments: see [`crate::config::COMMITTED`].
const LONGEST_TICK_NS: u32 = 390_000;

/// The value of a [`StepTiming`] with which no board makes steps.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum TimingError {
    /// `tick_ns` is 0: no tick takes no time.
    Tick,
    /// With pulses of 255 µs or eight motors, ticks would be more than 390 µs apart.
    TooLong,
    /// The shortest pulse has no length.
    Pulse,
}

impl fmt::Display for TimingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Tick => "step_timing.tick_ns: a tick takes time",
            Self::TooLong => {
                "step_timing: with eight motors or the longest pulse, a tick takes 390 µs at most"
            }
            Self::Pulse => "step_timing.shortest_pulse_us: a pulse takes time",
        })
    }
}

impl core::error::Error for TimingError {}

/// The times of making steps on a board.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StepTiming {
    /// The shortest time from one tick to the next, without the share of each motor, ns.
    pub tick_ns: u32,
    /// The time that each motor adds to `tick_ns`, ns.
    pub motor_ns: u32,
    /// The duration of the longest tick, ns: the tick that begins a line (a
    /// [`leadscrew_stepper::Line`], one straight move). A pulse that is to end during this tick
    /// ends after it.
    pub line_ns: u32,
    /// The time from the instant at which a pulse is to end until its pins are low and new
    /// directions are out, ns.
    pub pulse_end_ns: u32,
    /// The least time from a change of direction to the step, and from the end of a pulse to the
    /// next pulse, ns.
    pub setup_ns: u32,
    /// The shortest pulse that `$0` may ask for, µs.
    pub shortest_pulse_us: u8,
}

impl StepTiming {
    /// An STM32F407 at 168 MHz: three motors at 370 kHz with pulses of 1 µs.
    ///
    /// Tick: the rate is 26 % below 500 kHz, at which no tick of three motors was late in an
    /// emulated chip (`cargo fw-test --highest-rate`). The emulator's cycles are estimated to be
    /// right to within 15 %, and the main loop needs its share. A line: 476 cycles, 519 with four
    /// motors on three ports (`cargo fw-test record-interrupt`), rounded up. A motor: 20
    /// instructions of 1.65 cycles each, rounded to 0.2 µs. A pulse's end: entry, and 25
    /// instructions before the last pin is written. Set-up: 650 ns (TI DRV8825, SLVSA73F).
    pub const F407: Self = Self {
        tick_ns: 2_100,
        motor_ns: 200,
        line_ns: 3_200,
        pulse_end_ns: 350,
        setup_ns: 650,
        shortest_pulse_us: 1,
    };

    /// An STM32F407 board that its record describes: with tables in place of pins that are compiled
    /// in.
    ///
    /// A line: 523 cycles with the step pins on three ports. A pulse's end: 104 cycles until the
    /// last of the directions on three ports is written (`cargo fw-test record-interrupt`). Both
    /// are rounded up.
    pub const F407_RECORD: Self = Self {
        line_ns: 3_300,
        pulse_end_ns: 650,
        ..Self::F407
    };

    /// As [`Self::F407_RECORD`], with four motors.
    ///
    /// A line: 564 cycles with the step pins on three ports. A tick that is a little longer ends a
    /// pulse of 3 µs as well, which takes 130 cycles more. A pulse's end: 13 cycles more than with
    /// three motors (`cargo fw-test record-interrupt`). Both are rounded up.
    pub const F407_RECORD_FOUR: Self = Self {
        line_ns: 4_300,
        pulse_end_ns: 750,
        ..Self::F407
    };

    /// A board without any bound beyond Grbl's, so that the same settings get the same answers.
    /// Pulses have Grbl's least width.
    pub const GRBL: Self = Self {
        tick_ns: 2_000,
        motor_ns: 0,
        shortest_pulse_us: 3,
        ..Self::F407
    };

    /// Checks that a board can make steps in these times. [`crate::machine::Machine::new`] asks,
    /// by [`crate::config::MachineConfig::validate`].
    ///
    /// # Errors
    /// The first time that is none.
    pub const fn validate(&self) -> Result<(), TimingError> {
        let ticks = self.shortest_tick_ns(u8::MAX, MAX_MOTORS);
        if self.tick_ns == 0 {
            Err(TimingError::Tick)
        } else if self.shortest_pulse_us == 0 {
            Err(TimingError::Pulse)
        } else if ticks > LONGEST_TICK_NS || self.line_ns > LONGEST_TICK_NS {
            Err(TimingError::TooLong)
        } else {
            Ok(())
        }
    }

    /// Returns the least time from one tick to the next, ns: with pulses of `pulse_us` on `motors`
    /// motors.
    pub const fn shortest_tick_ns(&self, pulse_us: u8, motors: usize) -> u32 {
        let work = self.work_ns(motors);
        let edges = self.pulse_end_ns.saturating_add(self.setup_ns);
        let pins = edges.saturating_add(pulse_us as u32 * 1_000);
        if work > pins {
            work
        } else {
            pins
        }
    }

    /// Returns the highest step rate with pulses of `pulse_us` on `motors` motors, steps/s.
    pub const fn highest_rate(&self, pulse_us: u8, motors: usize) -> u32 {
        1_000_000_000 / self.shortest_tick_ns(pulse_us, motors)
    }

    /// Returns the bounds of `$0` and of rates, for any values of the other settings. No pulse is
    /// too long: the longest, 255 µs, leaves 3900 steps/s, and rates above that are capped.
    pub const fn limits(&self, motors: usize) -> StepLimits {
        StepLimits {
            shortest_pulse_us: self.shortest_pulse_us,
            highest_rate: 1_000_000_000 / self.work_ns(motors),
        }
    }

    /// The time from a tick that begins a line until the line's directions are out, ns: the tick
    /// and its pulse are both over by then.
    pub(crate) fn direction_out_ns(&self, pulse_us: u8) -> u32 {
        let pulse = u32::from(pulse_us) * 1_000;
        pulse.max(self.line_ns).saturating_add(self.pulse_end_ns)
    }

    const fn work_ns(&self, motors: usize) -> u32 {
        let motors = self.motor_ns.saturating_mul(motors as u32); // eight motors at most
        let work = self.tick_ns.saturating_add(motors);
        if work > 0 {
            work
        } else {
            1
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const F407: StepTiming = StepTiming::F407;

    #[test]
    fn three_motors_make_370_000_steps_a_second_with_the_shortest_pulses() {
        let rates = [1, 2, 3].map(|us| F407.highest_rate(us, 3));
        assert_eq!(rates, [370_370, 333_333, 250_000]);
        assert_eq!(F407.limits(3).highest_rate, 370_370);
    }

    #[test]
    fn longer_pulses_and_more_motors_are_slower() {
        assert_eq!(F407.highest_rate(10, 3), 90_909);
        assert_eq!(F407.highest_rate(255, 3), 3906);
        assert!(F407.highest_rate(1, 4) < 370_370 && F407.highest_rate(1, 1) > 370_370);
    }
}
