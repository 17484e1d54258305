//! The look-ahead planner: exact targets in, step segments out.
//!
//! ```text
//!  Move ---> Planner::push ---> queue of planned moves ---> Segmenter::next ---> stepper::Segment
//!  (exact    (motor steps,      (squared speeds, a          (profile of the
//!   target)   limits along the   blocks of moves: the        running move; hold,
//!             line, junction)    reverse pass)               resume, overrides)
//!
//!  Arc ---> chords, each of them a Move
//! ```
//!
//! Speed along the path is a trapezoid in each move: ramp, cruise, ramp; with a jerk limit the
//! ramps are rounded. Three rules bound the speed:
//!
//! * no axis is faster, or accelerates more, than [`Config`] allows: along the unit vector `u` of a
//!   move the rate is `min(rate_i / |u_i|)` and the acceleration `min(acceleration_i / |u_i|)`;
//! * corners obey *junction deviation* (see `junction`), and when the path turns, each axis has
//!   its acceleration for both the turn and the change of speed (see `polygon` and `path`);
//! * at every instant the queued path is long enough to stop on (see `lookahead`).
//!
//! Units: mm, mm/s, mm/s² along the path; whole steps of the dominant motor, steps/s, steps/s² in a
//! [`Trapezoid`]; timer counts in a segment. `v2` names a squared speed. All real numbers are
//! `f32`, without `mul_add` and without `f64`, so that every machine computes the same bits.
//!
//! Everything here is called from the main loop; no call waits.
#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(
    not(feature = "jerk"),
    allow(unreachable_code, reason = "a part that is left out has no values")
)]

mod ahead;
mod built;
mod config;
mod ease;
mod emit;
#[cfg(test)]
mod exactness;
mod explain;
mod moves;
mod path;
mod planner;
mod real;
mod space;
mod speed;
mod valid;

pub use ahead::lookahead::USUAL_BLOCKS;
pub use ahead::queue::{PixelQueue, Queue, Room, SmallQueue};
pub use ahead::time_left::TimeLeft;
pub use config::{Config, CornerRule, Overrides, DEFAULT_TIMER_HZ, THREE_DECIMALS};
pub use emit::segmenter::{PowerLead, Segmenter, LONGEST_LEAD};
pub use explain::{Ahead, Outline};
pub use moves::{Feed, Move, MoveKind, MovePower};
pub use path::arc::{Arc, ArcError};
pub use path::curve::Curve;
pub use planner::{Planner, PushError, Pushed};
pub use space::target::{
    Cartesian, Coordinate, CoreXy, Ganged, Kinematics, StepsPerMm, NANOS_PER_MM,
};
pub use space::train::Train;
pub(crate) use speed::mean::Mean;
pub(crate) use speed::plan::Place;
pub(crate) use speed::profile::{Profile, Trapezoid};
pub use valid::{ConfigError, MoveError, OverrideError};

#[cfg(test)]
extern crate std;
#[cfg(test)]
mod borders_tests;
#[cfg(test)]
mod chords_tests;
#[cfg(test)]
mod coarse_tests;
#[cfg(test)]
mod corners_tests;
#[cfg(test)]
mod cut_line_tests;
#[cfg(test)]
mod drift_tests;
#[cfg(test)]
mod edges_tests;
#[cfg(test)]
mod energy_tests;
#[cfg(test)]
mod limits_tests;
#[cfg(test)]
mod nonsense_tests;
#[cfg(test)]
mod outputs_tests;
#[cfg(test)]
mod reference;
#[cfg(test)]
mod rows_tests;

/// The examples of the package's README, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
