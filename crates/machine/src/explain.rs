//! The planning of a job, for a listener that explains the job: it draws the job, or tells why the
//! job slows down.

use leadscrew_planner::{Coordinate, MoveKind};
use leadscrew_stepper::Power;

/// Learns how motion is planned. The machine calls it from `Machine::poll`.
pub trait Explain {
    /// A move of the program is planned.
    fn move_planned(&mut self, planned: &PlannedMove<'_>);

    /// `count` segments, 1 or more, were made for the step interrupt. `committed` computes the
    /// speed at the end of the last one and the reason for its bound.
    fn segments_made(&mut self, count: u32, committed: &dyn Fn() -> Committed);
}

/// A move of the program that has just been planned.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PlannedMove<'a> {
    /// The position at which it begins, machine coordinates. It is not the end of the move before
    /// if the machine has moved by itself since.
    pub begin: &'a [Coordinate],
    /// The position at which it ends, machine coordinates.
    pub target: &'a [Coordinate],
    /// The kind of motion.
    pub kind: MoveKind,
    /// Power as programmed, at the programmed feed.
    pub power: Power,
    /// Laser mode (`$32`).
    pub is_laser: bool,
    /// The limit from an arc's curvature, mm/s.
    pub speed_limit: Option<f32>,
    /// The line that asked for it, counted as [`Work::lines`](crate::work::Work::lines) does.
    pub line: u32,
    /// Signed steps of each motor in the whole planned move. It may consist of several moves of the
    /// program.
    pub steps: &'a [i32],
    /// Highest acceleration along the path, mm/s².
    pub acceleration: f32,
    /// Highest speed along the path whatever the override, mm/s.
    pub rate: f32,
    /// Speed along the path as programmed, mm/s.
    pub feed: f32,
}

/// The motion at the end of the segment that was made last.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Committed {
    /// Speed along the path, mm/s.
    pub speed: f32,
    /// The reason why motion slows down from there on.
    pub ahead: Ahead,
}

/// The reason why motion slows down.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Ahead {
    /// The program asks for rest: a dwell, a spindle that is switched, a pause, the end.
    Stop,
    /// The end of the look-ahead: the queue is full.
    LookAhead,
    /// No further line has come yet.
    NoLine,
    /// A corner.
    Corner,
    /// The curvature of the path: an arc, or a curve of short moves.
    Curve,
    /// A move that is slower.
    SlowerMove,
}
