//! The steps of the door's sequence, and the parking place.

use crate::board::Instant;
use crate::config::ParkingConfig;
use leadscrew_planner::Coordinate;

/// The steps of the door's sequence.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Step {
    PullOut,
    Park,
    Parked,
    Unpark,
    SpindleRunsUp(Instant),
    CoolantFlows(Instant),
    Plunge,
}

/// The door's sequence under way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DoorCycle<const AXES: usize> {
    pub(crate) step: Step,
    /// The time at which the sequence began, with the machine at rest; `None` once a report has
    /// shown that it is over.
    pub(crate) since: Option<Instant>,
    /// The position at which the machine left its path; `None` if it does not park.
    pub(crate) left_at: Option<[Coordinate; AXES]>,
}

impl<const AXES: usize> DoorCycle<AXES> {
    /// Returns true if the sequence goes on as soon as motion rests.
    pub(crate) fn can_advance(&self) -> bool {
        match self.step {
            Step::PullOut | Step::Park | Step::Unpark | Step::Plunge => true,
            Step::Parked | Step::SpindleRunsUp(_) | Step::CoolantFlows(_) => false,
        }
    }

    /// Returns when `Machine::poll` is to look again.
    pub(crate) fn waits_until(&self) -> Option<Instant> {
        match self.step {
            Step::SpindleRunsUp(instant) | Step::CoolantFlows(instant) => Some(instant),
            Step::PullOut | Step::Park | Step::Parked | Step::Unpark | Step::Plunge => None,
        }
    }
}

impl ParkingConfig {
    /// The coordinate of the spindle axis in `position`.
    pub(crate) fn of<const AXES: usize>(&self, position: &[Coordinate; AXES]) -> Coordinate {
        position.get(self.axis).copied().unwrap_or_default()
    }

    pub(crate) fn target(&self) -> Coordinate {
        Coordinate::from_mm(self.target_mm).unwrap_or_default()
    }

    /// Returns true if the spindle axis is below the place to park.
    pub(crate) fn is_worth_it<const AXES: usize>(&self, position: &[Coordinate; AXES]) -> bool {
        self.axis < AXES && self.of(position) < self.target()
    }

    /// The height at which the tool is out of the work, no higher than the place to park.
    pub(crate) fn pulled_out<const AXES: usize>(&self, left_at: &[Coordinate; AXES]) -> Coordinate {
        let out = self.of(left_at) + Coordinate::from_mm(self.pull_out_mm).unwrap_or_default();
        out.min(self.target())
    }
}
