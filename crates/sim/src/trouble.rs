//! Late events, which can happen under load, and violations, which must never happen.

use crate::clock::{micros, Cycle};
use core::fmt;
use leadscrew_stepper::MotorMask;

/// The reason why motion did not keep its schedule.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LateReason {
    /// A tick was due before the previous step interrupt had armed the timer for it.
    TickPassed,
    /// The main loop did not bring the next segment in time.
    Underrun,
    /// The receive queue was full: a byte was lost.
    ByteLost,
}

/// A late event.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Late {
    /// The time at which it was noticed.
    pub cycle: Cycle,
    /// The reason.
    pub reason: LateReason,
}

impl fmt::Display for Late {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reason = match self.reason {
            LateReason::TickPassed => "a tick was due before it was armed",
            LateReason::Underrun => "segments ran out in motion",
            LateReason::ByteLost => {
                "a byte was lost: the sender has sent more than the receive buffer holds"
            }
        };
        write!(f, "{}: {reason}", self.cycle)
    }
}

/// An event that must never happen, whatever the load.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Violation {
    /// A step pin was raised while it was still high: the driver saw no edge.
    StepLost {
        /// The time at which it was raised.
        cycle: Cycle,
        /// The motors whose step was lost.
        motors: MotorMask,
    },
    /// A pulse was shorter than `$0`.
    PulseTooShort {
        /// The pulse's end.
        cycle: Cycle,
        /// Its width in cycles.
        width: u64,
    },
    /// A motor stepped too soon after its direction pin had changed.
    DirectionNotSettled {
        /// The step.
        cycle: Cycle,
        /// Cycles since the change.
        setup: u64,
    },
    /// A direction pin changed while its motor's step pin was high.
    DirectionInPulse {
        /// The change.
        cycle: Cycle,
        /// The motors concerned.
        motors: MotorMask,
    },
    /// The carriage is not at the position that the controller has counted.
    Position {
        /// The time at which it was noticed.
        cycle: Cycle,
        /// The motor.
        motor: usize,
        /// Steps that the controller has counted.
        counted: i32,
        /// Steps that the carriage has made.
        made: i32,
    },
    /// Laser power was on when it has to be off: at rest (except under M3), in a hold, with the
    /// door open, while homing, locked, in check mode or asleep.
    LaserOn {
        /// The time at which it was noticed.
        cycle: Cycle,
    },
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StepLost { cycle, motors } => {
                write!(
                    f,
                    "{cycle}: step of motors {:#b} lost, pin still high",
                    motors.bits()
                )
            }
            Self::PulseTooShort { cycle, width } => {
                write!(f, "{cycle}: pulse of {:.3} µs is too short", micros(*width))
            }
            Self::DirectionNotSettled { cycle, setup } => {
                write!(
                    f,
                    "{cycle}: step {:.3} µs after its direction",
                    micros(*setup)
                )
            }
            Self::DirectionInPulse { cycle, motors } => {
                write!(
                    f,
                    "{cycle}: direction of motors {:#b} changed in a pulse",
                    motors.bits()
                )
            }
            Self::Position {
                cycle,
                motor,
                counted,
                made,
            } => {
                write!(
                    f,
                    "{cycle}: motor {motor} counted {counted} steps and made {made}"
                )
            }
            Self::LaserOn { cycle } => write!(f, "{cycle}: laser on where it has to be off"),
        }
    }
}

/// A list of the first entries, and the count of all.
#[derive(Clone, PartialEq, Debug)]
pub struct Record<T> {
    count: u64,
    first: Vec<T>,
}

/// The number of entries that are kept.
const KEPT: usize = 100;

impl<T> Default for Record<T> {
    fn default() -> Self {
        Self {
            count: 0,
            first: Vec::new(),
        }
    }
}

impl<T> Record<T> {
    /// Returns the number of entries.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Returns the first hundred entries.
    pub fn first(&self) -> &[T] {
        &self.first
    }

    /// Returns true if there were no entries.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    pub(crate) fn push(&mut self, item: T) {
        self.count += 1;
        if self.first.len() < KEPT {
            self.first.push(item);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_are_counted_and_the_first_are_kept() {
        let mut record = Record::default();
        (0..1000).for_each(|n| record.push(n));
        assert_eq!(record.count(), 1000);
        assert_eq!(record.first().len(), KEPT);
        assert_eq!(record.first()[KEPT - 1], 99);
    }
}
