//! What a motion without G-code does beyond moves: holds, stops, a probe, homing.

use crate::motion_words::End;
use leadscrew_stepper::MotorMask;

/// The course that was asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Course<const AXES: usize> {
    Going,
    /// A hold: `resume` goes on.
    Holding,
    /// A stop: the queue is forgotten at rest.
    Stopping,
    /// The way to the place at which the probe touches.
    Probing,
    Homing(Homing<AXES>),
}

/// Where homing is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Homing<const AXES: usize> {
    /// The switch of each axis that is still to be homed.
    pub(crate) ends: [Option<End>; AXES],
    pub(crate) phase: Phase,
    /// The phase's move is planned.
    pub(crate) moves: bool,
    /// All switches are closed: the step interrupt comes to rest, and nothing is handed to it.
    pub(crate) halts: bool,
}

/// The motions of homing, in order.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Phase {
    Search,
    PullOff,
    Locate,
    LastPullOff,
}

impl Phase {
    pub(crate) const fn approaches(self) -> bool {
        matches!(self, Self::Search | Self::Locate)
    }

    pub(crate) const fn next(self) -> Option<Self> {
        match self {
            Self::Search => Some(Self::PullOff),
            Self::PullOff => Some(Self::Locate),
            Self::Locate => Some(Self::LastPullOff),
            Self::LastPullOff => None,
        }
    }
}

impl<const AXES: usize> Homing<AXES> {
    /// The axes that home now: all together, but one by one those that share motors.
    pub(crate) fn group(&self, sharing: MotorMask) -> MotorMask {
        let left = self.ends.iter().enumerate();
        let left = left.filter_map(|(axis, end)| end.map(|_| MotorMask::only(axis)));
        let alone = left.clone().find(|axis| sharing.without(*axis) != sharing);
        alone.unwrap_or_else(|| left.fold(MotorMask::NONE, MotorMask::with))
    }
}
