//! The words of motion without G-code: speeds, states, and the reasons for which a move is refused.

use crate::fault::Fault;
use core::fmt;
use leadscrew_planner::{ArcError, Feed, MoveError, PushError};

/// A speed along the path.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Speed(pub(crate) Feed);

impl Speed {
    /// As fast as the axes allow.
    pub const RAPID: Self = Self(Feed::Rapid);

    /// Makes a speed in mm/s, above 0. On a rotary axis a millimetre is a degree.
    pub const fn mm_s(speed: f32) -> Self {
        Self(Feed::PerMinute(speed)) // which is in mm/s, as the planner has it
    }

    /// Makes a speed in mm/min, above 0.
    pub const fn mm_min(speed: f32) -> Self {
        Self(Feed::PerMinute(speed / 60.0))
    }
}

/// The way around an arc, seen with the second axis of its plane to the left of the first.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Turn {
    /// Clockwise, as G2.
    Clockwise,
    /// Counter-clockwise, as G3.
    CounterClockwise,
}

/// The state of a motion.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum MotionStatus {
    /// It is at rest, and nothing is queued.
    Idle,
    /// It moves, or begins to.
    Moving,
    /// It slows down for a hold or a stop.
    Stopping,
    /// It is held at rest: [`Motion::resume`](crate::motion::Motion::resume) goes on,
    /// [`Motion::stop`](crate::motion::Motion::stop) forgets the rest.
    Held,
    /// It has failed, and takes no move until [`Motion::recover`](crate::motion::Motion::recover).
    Failed(MotionFault),
}

/// The reason why a motion has failed. Its position counts the steps that were sent to the motors,
/// which may have lost some of them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum MotionFault {
    /// [`Motion::poll`](crate::motion::Motion::poll) was not called for 8 ms in motion.
    PollTooLate,
    /// [`Motion::stop_now`](crate::motion::Motion::stop_now) was called in motion.
    StoppedNow,
    /// A part of the board failed; only power-up helps.
    Board(Fault),
}

impl fmt::Display for MotionFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PollTooLate => f.write_str(
                "Motion::poll came too late in motion; call it every 4 ms, then Motion::recover",
            ),
            Self::StoppedNow => f.write_str(
                "motion was stopped without slowing down; find the position again, then \
                 Motion::recover",
            ),
            Self::Board(fault) => fault.fmt(f),
        }
    }
}

impl core::error::Error for MotionFault {}

/// The reason why a move was refused; nothing has changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum MotionError {
    /// The target of this axis is not a number, or beyond ±9·10⁹ mm.
    NoPlace(usize),
    /// The target of this axis is outside its travel, or an arc leads there.
    OutOfTravel(usize),
    /// The speed is not a number above 0.
    Speed,
    /// The queue has no room: poll until a move has ended.
    Full,
    /// The position can be declared at rest only.
    NotIdle,
    /// The target is too many steps away.
    TooFar,
    /// An arc has more chords than the queue has room for, even when it is empty.
    ArcTooLong {
        /// The chords that it has.
        chords: u32,
        /// The moves that the queue holds.
        room: usize,
    },
    /// An arc cannot be drawn.
    Arc(ArcError),
    /// The motion has failed before.
    Failed(MotionFault),
}

impl fmt::Display for MotionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoPlace(axis) => write!(f, "the target of axis {axis} is no place; give mm"),
            Self::OutOfTravel(axis) => write!(
                f,
                "axis {axis} would leave its travel; stay within MotionConfig::with_travel_mm"
            ),
            Self::Speed => f.write_str("the speed is not a number above 0; give mm/s"),
            Self::Full => f.write_str("the queue is full; poll until a move has ended"),
            Self::NotIdle => {
                f.write_str("the motion is not idle; poll until it is, then declare the position")
            }
            Self::TooFar => f.write_str("the target is too many steps away; give a nearer one"),
            Self::ArcTooLong { chords, room } => write!(
                f,
                "the arc has {chords} chords, the queue holds {room}; raise MOVES or \
                 MotionConfig::with_arc_tolerance_mm"
            ),
            Self::Arc(error) => error.fmt(f),
            Self::Failed(fault) => write!(f, "no move is taken: {fault}"),
        }
    }
}

impl core::error::Error for MotionError {}

impl From<PushError> for MotionError {
    fn from(error: PushError) -> Self {
        match error {
            PushError::Full => Self::Full,
            PushError::TooFar => Self::TooFar,
            PushError::Invalid(MoveError::Feed | MoveError::Rounding | MoveError::Curve) => {
                Self::Speed
            }
        }
    }
}
