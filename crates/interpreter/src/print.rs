//! Commands in words, for people and golden files: a name, then words as G-code writes them, in
//! machine coordinates.
//!
//! ```text
//! FEED X1 Y0 Z-0.5 F1500 M3 S800      ARC G2 G17 X2 Y0 Z0 I1 J0 F500      STORE G55 X9 Y0 Z0
//! ```

use super::command::{ArcShape, Command, Feed, Spindle, Travel};
use super::cycle::holes::Cycle;
use super::modal_state::{Plane, Rotation};
use super::Coordinate;
use crate::own::Words;
use core::fmt::{self, Display, Formatter};
use leadscrew_gcode::Number;

impl<const AXES: usize> Display for Command<AXES> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Spindle(spindle) => write!(f, "SPINDLE{spindle}"),
            Self::Coolant(coolant) => write!(f, "COOLANT {coolant}"),
            Self::ParkingControl(true) => f.write_str("PARKING on"),
            Self::ParkingControl(false) => f.write_str("PARKING off"),
            Self::OverrideControl(acts) => {
                let word = |acts| if acts { "on" } else { "off" };
                let (feed, spindle) = (word(acts.feed), word(acts.spindle));
                write!(f, "OVERRIDES feed {feed} spindle {spindle}")
            }
            Self::Own(call) => write!(f, "OWN M{}{}", call.code, OwnWords(&call.words)),
            Self::Dwell(seconds) => write!(f, "DWELL {seconds} s"),
            Self::StoreOffset { id, value } => write!(f, "STORE {id}{}", Axes(value)),
            Self::StoreTool { tool, length } => {
                write!(f, "STORE T{tool} {}", Number::from_nanos(length.nanos()))
            }
            Self::WorkOffset(offset) => write!(f, "WORK OFFSET{}", Axes(offset)),
            Self::Line(travel) if travel.feed == Feed::Rapid => write!(f, "RAPID{travel}"),
            Self::Line(travel) => write!(f, "FEED{travel}"),
            Self::Arc { travel, arc } => write!(f, "ARC {arc}{travel}"),
            Self::Cycle { travel, cycle } => write!(f, "CYCLE {cycle}{travel}"),
            Self::Probe { travel, kind } => write!(f, "PROBE {kind}{travel}"),
            Self::Pause => f.write_str("PAUSE"),
            Self::ProgramEnd => f.write_str("PROGRAM END"),
        }
    }
}

struct OwnWords<'a>(&'a Words);

impl Display for OwnWords<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for letter in Words::LETTERS {
            if let Some(value) = self.0.get(letter) {
                write!(f, " {letter}{value}")?;
            }
        }
        Ok(())
    }
}

impl<const AXES: usize> Display for Travel<AXES> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}", Axes(&self.target))?;
        match self.feed {
            Feed::Rapid => {}
            Feed::PerMinute(feed) => write!(f, " F{feed}")?,
            Feed::InverseTime(feed) => write!(f, " G93 F{feed}")?,
        }
        if self.spindle.rotation != Rotation::Off {
            write!(f, "{}", self.spindle)?;
        }
        match self.line_number {
            Some(number) => write!(f, " N{number}"),
            None => Ok(()),
        }
    }
}

impl Display for Spindle {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let cutting = if self.cutting { " cutting" } else { "" };
        write!(f, " {} S{}{cutting}", self.rotation, self.speed)
    }
}

impl Display for ArcShape {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (first, second) = match self.plane {
            Plane::Xy => ('I', 'J'),
            Plane::Zx => ('K', 'I'),
            Plane::Yz => ('J', 'K'),
        };
        let [i, j] = self.centre.map(number);
        write!(f, "{} {} {first}{i} {second}{j}", self.turn, self.plane)?;
        match self.more_turns {
            0 => Ok(()),
            more => write!(f, " P{}", more + 1),
        }
    }
}

impl Display for Cycle {
    /// The R level, the bottom, Q or P, and for repeats L with the way from hole to hole.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (clear, bottom) = (number(self.clear), number(self.bottom));
        write!(f, "{} {} from {clear} to {bottom}", self.kind, self.plane)?;
        if self.kind.pecks() {
            write!(f, " Q{}", self.value)?;
        } else if self.kind.dwells() {
            write!(f, " P{}", self.value)?;
        }
        if self.repeats > 1 {
            let [x, y] = self.step.map(number);
            write!(f, " L{} by {x}, {y}", self.repeats)?;
        }
        Ok(())
    }
}

/// The letters of the axes, in their order.
const LETTERS: [char; 6] = ['X', 'Y', 'Z', 'A', 'B', 'C'];

struct Axes<'a, const AXES: usize>(&'a [Coordinate; AXES]);

impl<const AXES: usize> Display for Axes<'_, AXES> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for (letter, value) in LETTERS.iter().zip(self.0) {
            write!(f, " {letter}{}", number(*value))?;
        }
        Ok(())
    }
}

fn number(value: Coordinate) -> Number {
    Number::from_nanos(value.nanos())
}
