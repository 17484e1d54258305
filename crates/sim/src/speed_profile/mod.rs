//! The use of a job's time: its speed piece by piece, and which limit binds in each piece.
//!
//! ```text
//!  speed       feed            corner      rate of X             stop
//!          ___________                   ______________
//!         /           \                 /              \
//!        / acceleration \______________/                \
//!  -----|---|----------|---|----------|-|---------------|--|------   stretches
//!  rest                                                      rest
//! ```
//!
//! The job is cut into [`Stretch`]es without gaps. In each one acceleration is constant and one
//! [`Limit`] binds. Stretches are made from the segments that the step interrupt consumed, so that
//! their times add up exactly, in cycles, to the job's time. The speeds between them are the
//! planner's own. A slow place (a corner, a stop) takes no time itself: its cost is the time of the
//! ramps to and from it. So a ramp names its slow place ([`Slow`]).

mod csv;
mod limit;
mod recorder;
mod shares;

pub use csv::write_csv;
pub use limit::{Limit, Machine, Slow, SpeedLimit};
pub use recorder::Recorder;
pub use shares::{shares, Share};

use crate::clock::Cycle;

/// The course of the speed in a stretch.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Phase {
    /// Nothing moves.
    Rest,
    /// The speed rises.
    Accelerate,
    /// The speed stays the same.
    Cruise,
    /// The speed falls.
    Brake,
}

impl Phase {
    /// Returns the phase's name in the list.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Accelerate => "accelerate",
            Self::Cruise => "cruise",
            Self::Brake => "brake",
        }
    }
}

/// A part of the job in which one limit binds.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Stretch {
    /// The time at which it begins.
    pub begin: Cycle,
    /// The time at which it ends and the next one begins.
    pub end: Cycle,
    /// The line of the file that asked for the move, from 1; 0 at rest and if the machine moves
    /// by itself.
    pub line: u64,
    /// The course of the speed.
    pub phase: Phase,
    /// Length of the path, mm.
    pub length: f64,
    /// Speed along the path at the start and at the end, mm/s.
    pub speed: [f64; 2],
    /// Power at the start and at the end, shares of full power.
    pub power: [f64; 2],
    /// The limit that keeps the speed from being higher.
    pub limit: Limit,
}

impl Stretch {
    /// Returns the time of the stretch, CPU cycles.
    pub fn cycles(&self) -> u64 {
        self.end - self.begin
    }

    /// Returns the acceleration along the path, mm/s², negative if the speed falls:
    /// `(v1² − v0²) / 2s`.
    pub fn acceleration(&self) -> f64 {
        let [from, to] = self.speed;
        if self.length > 0.0 && self.phase != Phase::Cruise {
            (to * to - from * from) / (2.0 * self.length)
        } else {
            0.0
        }
    }
}
