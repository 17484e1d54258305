//! The simulator's only clock: cycles of the CPU since power-up.
//!
//! Every other time is computed from it, as a whole multiple or by division rounded down, so that
//! nothing depends on the computer that runs the simulation.

use core::fmt;
use core::ops::{Add, Sub};
use leadscrew_machine::board::Instant;

/// CPU clock of the STM32F407 at its highest, Hz (data sheet DocID022152, table 14).
pub const CPU_HZ: u64 = 168_000_000;

/// Counts of the step timer (TIM2) a second: twice the clock of its bus (RM0090 section 7.2).
pub const TIMER_HZ: u32 = 84_000_000;

/// CPU cycles in one count of the step timer.
pub const CYCLES_PER_COUNT: u64 = CPU_HZ / TIMER_HZ as u64;

const CYCLES_PER_US: u64 = CPU_HZ / 1_000_000;

/// An instant: CPU cycles since power-up. Spans between two instants are plain `u64` cycles.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Hash)]
pub struct Cycle(pub u64);

impl Cycle {
    /// The instant of power-up.
    pub const ZERO: Self = Self(0);
    /// Later than everything (1700 years): an event at this time does not happen.
    pub const NEVER: Self = Self(u64::MAX / 2);

    /// Returns the first cycle of a microsecond since power-up; [`Cycle::NEVER`] if that is too
    /// late.
    pub const fn from_micros(micros: u64) -> Self {
        match micros.checked_mul(CYCLES_PER_US) {
            Some(cycles) if cycles < Self::NEVER.0 => Self(cycles),
            Some(_) | None => Self::NEVER,
        }
    }

    /// Returns the first cycle at which a clock of whole microseconds has reached `instant`.
    pub const fn from_instant(instant: Instant) -> Self {
        Self::from_micros(instant.ticks())
    }

    /// Returns the time on a clock of whole microseconds: rounded down.
    pub const fn instant(self) -> Instant {
        Instant::from_ticks(self.0 / CYCLES_PER_US)
    }

    /// Returns the seconds since power-up.
    pub fn seconds(self) -> f64 {
        seconds(self.0)
    }
}

/// Returns a span of `cycles` in seconds.
pub fn seconds(cycles: u64) -> f64 {
    cycles as f64 / CPU_HZ as f64
}

/// Returns a span of `cycles` in microseconds.
pub fn micros(cycles: u64) -> f64 {
    cycles as f64 / CYCLES_PER_US as f64
}

/// Returns the cycles in `micros` microseconds.
pub const fn cycles_of_micros(micros: u64) -> u64 {
    micros * CYCLES_PER_US
}

impl Add<u64> for Cycle {
    type Output = Self;
    /// The instant `cycles` later. [`Cycle::NEVER`] leaves room for this addition.
    #[inline]
    fn add(self, cycles: u64) -> Self {
        Self(self.0 + cycles)
    }
}

impl Sub for Cycle {
    type Output = u64;
    /// Cycles from `earlier` to this instant; 0 if `earlier` is not earlier.
    #[inline]
    fn sub(self, earlier: Self) -> u64 {
        self.0.saturating_sub(earlier.0)
    }
}

impl fmt::Display for Cycle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cycle {} ({:.6} s)", self.0, self.seconds())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deadline_in_microseconds_is_reached_at_its_first_cycle() {
        let deadline = Instant::from_ticks(1000);
        let cycle = Cycle::from_instant(deadline);
        assert_eq!(cycle.instant(), deadline);
        assert!(Cycle(cycle.0 - 1).instant() < deadline);
    }

    #[test]
    fn spans_are_never_negative_and_never_is_out_of_reach() {
        assert_eq!(Cycle::from_micros(u64::MAX), Cycle::NEVER);
        assert_eq!(Cycle(3) - Cycle(5), 0);
    }
}
