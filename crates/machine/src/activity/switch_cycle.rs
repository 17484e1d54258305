//! The progress of a cycle at the limit switches: homing, or the way off a switch that has stopped
//! the machine.

use crate::activity::line::Origin;
use crate::board::Instant;
use crate::config::AxisMask;

/// The motions of one group of axes, in order.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Phase {
    Search,
    PullOff,
    Locate,
    /// On an axis with two motors, the second motor moves on by its offset (`$702`).
    Offset,
    FinalPullOff,
}

impl Phase {
    pub(crate) fn next(self, offset: bool) -> Option<Self> {
        match self {
            Self::Search => Some(Self::PullOff),
            Self::PullOff => Some(Self::Locate),
            Self::Locate if offset => Some(Self::Offset),
            Self::Locate | Self::Offset => Some(Self::FinalPullOff),
            Self::FinalPullOff => None,
        }
    }

    pub(crate) fn approaches(self) -> bool {
        matches!(self, Self::Search | Self::Locate)
    }
}

/// The event for which the cycle waits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Wait {
    /// The end of the time in which the switches settle.
    Settled(Instant),
    /// The end of the phase's motion.
    Motion,
}

/// The last step of a cycle, once all switches are found. On the way off a switch it is the only
/// step.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum LastMove {
    /// Nothing.
    None,
    /// Axes without a switch go to their zero.
    ToZero(AxisMask),
    /// Axes go off the limit switches that have stopped the machine.
    BackOff(AxisMask),
}

/// Homing, or the way off a limit switch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SwitchCycle {
    /// The origin of `$H`.
    pub(crate) origin: Origin,
    /// Groups of axes that are still to be homed, the present one first.
    pub(crate) groups: [AxisMask; 4],
    /// Axes that home one by one, whatever their group: those that share motors.
    pub(crate) one_by_one: AxisMask,
    pub(crate) last: LastMove,
    pub(crate) phase: Phase,
    pub(crate) wait: Wait,
}

impl SwitchCycle {
    /// The axes that home now. Groups that have no axis left are passed over.
    pub(crate) fn group(&self) -> Option<AxisMask> {
        let group = self.groups.iter().copied().find(|group| *group != 0)?;
        let alone = group & self.one_by_one;
        let lowest = alone & alone.wrapping_neg();
        Some(if lowest == 0 { group } else { lowest })
    }

    pub(crate) fn end_group(&mut self) {
        let done = self.group().unwrap_or(0);
        if let Some(group) = self.groups.iter_mut().find(|group| **group != 0) {
            *group &= !done;
        }
    }

    /// Returns when the switches have settled; `None` while the phase's motion goes on.
    pub(crate) fn settles_at(&self) -> Option<Instant> {
        match self.wait {
            Wait::Settled(instant) => Some(instant),
            Wait::Motion => None,
        }
    }
}
