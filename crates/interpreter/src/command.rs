//! Canonical commands: a line's work for the machine, in machine coordinates, with all modes
//! resolved.
//!
//! The machine needs no modal state to carry commands out. Tests print the commands and compare
//! them with golden files.

use super::cycle::holes::Cycle;
use super::modal_state::{Coolant, OverrideControl, Plane, ProbeKind, Rotation, Turn, WorkSystem};
use super::Coordinate;
use crate::own::Call;
use core::fmt::{self, Display, Formatter};
use heapless::Vec;
use leadscrew_gcode::Number;

/// The most commands that one line can ask for:
///
/// - four that switch: spindle, coolant, parking or override control, an extension's M code (M72
///   switches the first four, and stands alone);
/// - two for offsets: a dwell or a stored offset, and another work offset;
/// - three that move: two rapids of G28 or G30, and a motion or a cycle;
/// - two at its end: a pause, or the program's end and another work offset.
pub const MAX_COMMANDS: usize = 4 + 2 + 3 + 2;

/// The commands of one line, in the order in which they are carried out.
pub type Commands<const AXES: usize> = Vec<Command<AXES>, MAX_COMMANDS>;

/// One thing for the machine to do.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command<const AXES: usize> {
    /// Wait until motion has ended, then set the spindle so. (A laser under M4 is off at rest, so
    /// another speed need not wait.) A line makes this command only if it changes the spindle: see
    /// [`Spindle`].
    Spindle(Spindle),
    /// Wait until motion has ended, then set the coolant so.
    Coolant(Coolant),
    /// Allow (M56) or forbid (M56 P0) parking.
    ParkingControl(bool),
    /// Wait until motion has ended, then let these overrides act (M48 to M51). One that does not
    /// act is 100 %.
    OverrideControl(OverrideControl),
    /// Have an extension carry out one of its M codes.
    Own(Call),
    /// Wait until motion has ended, then for this time, s.
    Dwell(Number),
    /// Wait until motion has ended, then write this to the store, which outlasts power (G10, G28.1,
    /// G30.1).
    StoreOffset {
        /// The offset that is stored.
        id: OffsetId,
        /// Its value, machine coordinates.
        value: [Coordinate; AXES],
    },
    /// Wait until motion has ended, then write the length of a tool to the table (G10 L1).
    StoreTool {
        /// The tool's number, from 1.
        tool: u32,
        /// Its length.
        length: Coordinate,
    },
    /// Wait until motion has ended; from then on this is the work offset that reports subtract and
    /// show as `WCO`.
    WorkOffset([Coordinate; AXES]),
    /// Go straight to the target.
    Line(Travel<AXES>),
    /// Go to the target on an arc or helix.
    Arc {
        /// The target and the feed.
        travel: Travel<AXES>,
        /// The way round.
        arc: ArcShape,
    },
    /// Drill or bore holes: the cycle's [`Strokes`](super::Strokes), one after the other. The
    /// target is the end of the cycle.
    Cycle {
        /// The target, and the feed in the material.
        travel: Travel<AXES>,
        /// The holes.
        cycle: Cycle,
    },
    /// Go straight towards the target until the probe says stop. The machine then sets the
    /// position, with [`Interpreter::set_position`](super::Interpreter::set_position).
    Probe {
        /// The target, which is the farthest place, and the feed.
        travel: Travel<AXES>,
        /// The event to wait for.
        kind: ProbeKind,
    },
    /// Wait until motion has ended, then hold until resumed (M0).
    Pause,
    /// Wait until motion has ended, then switch spindle and coolant off, set all overrides to 100 %
    /// and report the end (M2, M30).
    ProgramEnd,
}

/// The target of a motion, and its manner.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Travel<const AXES: usize> {
    /// The end, machine coordinates. It may be the end of the last motion.
    pub target: [Coordinate; AXES],
    /// The feed.
    pub feed: Feed,
    /// The spindle meanwhile: in laser mode the beam's power belongs to the motion.
    pub spindle: Spindle,
    /// The N word of the line.
    pub line_number: Option<u32>,
}

/// The speed of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Feed {
    /// As fast as the axes can; rapid overrides apply.
    Rapid,
    /// The speed along the path of the axes that are lengths, mm/min; degrees/min if only axes
    /// move that turn (NIST RS274/NGC, 2.1.2.5). Above zero.
    PerMinute(Number),
    /// The whole motion takes one minute divided by this number, which is above zero. For an arc,
    /// all chords together take this time.
    InverseTime(Number),
}

/// The command to the spindle, or to the laser.
///
/// Without laser mode only [`Command::Spindle`] sets the output. In laser mode a motion sets it for
/// its own duration: `speed` under M3, `speed` scaled by actual over programmed speed under M4,
/// nothing if it is not `cutting`. At rest the output is `speed` under M3 if `cutting`, and
/// otherwise off. A [`Command::Line`] that turns out shorter than a step still sets the output at
/// rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Spindle {
    /// M3, M4 or M5.
    pub rotation: Rotation,
    /// The S word in force.
    pub speed: Number,
    /// The motion mode is G1, G2 or G3: a laser may be on.
    pub cutting: bool,
}

/// The way round an arc.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ArcShape {
    /// The plane in which it turns; the other axes move along evenly.
    pub plane: Plane,
    /// The direction of the turn. If target and start have the same place in the plane, the arc is
    /// a full circle.
    pub turn: Turn,
    /// From the start to the centre, along the two axes of [`Plane::axes`].
    pub centre: [Coordinate; 2],
    /// Whole turns before the arc, which the other axes share (P of the line, less one).
    pub more_turns: u8,
}

/// A straight move that changes no modal state (`$J=`).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Jog<const AXES: usize> {
    /// The target and the feed, which is always [`Feed::PerMinute`]. No override applies.
    pub travel: Travel<AXES>,
}

/// A set of coordinates that outlasts power.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum OffsetId {
    /// The origin of a work coordinate system.
    Work(WorkSystem),
    /// The target of G28.
    G28,
    /// The target of G30.
    G30,
}

impl OffsetId {
    /// All of them, in the order of their numbers in the store.
    pub const ALL: [Self; 11] = [
        Self::Work(WorkSystem::G54),
        Self::Work(WorkSystem::G55),
        Self::Work(WorkSystem::G56),
        Self::Work(WorkSystem::G57),
        Self::Work(WorkSystem::G58),
        Self::Work(WorkSystem::G59),
        Self::G28,
        Self::G30,
        Self::Work(WorkSystem::G59_1),
        Self::Work(WorkSystem::G59_2),
        Self::Work(WorkSystem::G59_3),
    ];

    /// Returns its place in [`OffsetId::ALL`].
    pub const fn index(self) -> u8 {
        match self {
            Self::Work(system) if (system as usize) < WorkSystem::GRBL => system as u8,
            Self::Work(system) => system as u8 + 2,
            Self::G28 => 6,
            Self::G30 => 7,
        }
    }
}

impl Display for OffsetId {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Work(system) => system.fmt(f),
            Self::G28 => f.write_str("G28"),
            Self::G30 => f.write_str("G30"),
        }
    }
}
