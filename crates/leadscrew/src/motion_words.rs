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

/// The end of an axis's travel at which its limit switch is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum End {
    /// The lowest place of `MotionConfig::with_travel_mm`.
    Low,
    /// The highest place.
    High,
}

/// The state of a motion.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum MotionStatus {
    /// It is at rest, and nothing is queued.
    Idle,
    /// It moves, or begins to: moves, homing, a probe.
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
    /// [`Motion::stop_now`](crate::motion::Motion::stop_now) was called in motion, or the reset
    /// button was pressed.
    StoppedNow,
    /// A limit switch has closed; [`Motion::closed`](crate::motion::Motion::closed) tells which.
    LimitSwitch,
    /// This axis has not met its limit switch: within one and a half of its travel, or at the
    /// second approach.
    NoSwitch(usize),
    /// The limit switch of this axis is still closed after the axis came back off it.
    SwitchStuck(usize),
    /// The switches of this axis's motors are farther apart than `MotionConfig::with_squaring`
    /// allows.
    Skewed(usize),
    /// The probe has touched nothing on its way. The position is known.
    NothingTouched,
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
            Self::LimitSwitch => f.write_str(
                "a limit switch has closed; Motion::recover, move off it, then home again",
            ),
            Self::NoSwitch(axis) => write!(
                f,
                "axis {axis} has not met its limit switch; look at its wires, at the end given to \
                 Motion::home, and at MotionConfig::with_travel_mm"
            ),
            Self::SwitchStuck(axis) => write!(
                f,
                "the limit switch of axis {axis} is still closed after the way back; look at the \
                 switch, or raise MotionConfig::with_pull_off_mm"
            ),
            Self::Skewed(axis) => write!(
                f,
                "the motors of axis {axis} meet their switches too far apart; square the axis, or \
                 raise MotionConfig::with_squaring"
            ),
            Self::NothingTouched => f.write_str(
                "the probe has touched nothing on its way; Motion::recover, then look for the part \
                 or probe farther",
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
    /// It is for a motion that is idle only: a position, homing, a probe. While homing or a probe
    /// goes on, nothing else is.
    NotIdle,
    /// The probe touches before it has moved.
    ProbeTouches,
    /// This axis cannot be homed: it has no travel, or it is shorter than the way back off the
    /// switch.
    NoTravel(usize),
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
            Self::NotIdle => f.write_str("the motion is not idle; poll until it is"),
            Self::ProbeTouches => {
                f.write_str("the probe touches already; lift it, or look at its wires")
            }
            Self::NoTravel(axis) => write!(
                f,
                "axis {axis} has no travel, or one shorter than MotionConfig::with_pull_off_mm; \
                 give MotionConfig::with_travel_mm"
            ),
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
