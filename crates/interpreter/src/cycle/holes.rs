//! The holes that a line asks for.

use super::kind::CycleKind;
use crate::modal_state::Plane;
use leadscrew_gcode::Number;
use leadscrew_planner::Coordinate;

/// The most repeats that an L word may ask for, and the most pecks of a hole.
pub(crate) const MOST: u16 = 10_000;

/// The holes of one line, in machine coordinates. The travel of its command ends at the last of
/// them, at the level to which the tool goes back.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Cycle {
    /// The kind of the cycle.
    pub kind: CycleKind,
    /// True if the series began below the R level. Then a tool that is below the R level goes
    /// straight up to it before it goes to the first hole. Otherwise the tool goes up and to the
    /// hole in one move.
    pub lifts: bool,
    /// The plane of the holes: the tool goes along the axis across it.
    pub plane: Plane,
    /// The number of holes: the L word, 1 to 10 000.
    pub repeats: u16,
    /// From a hole to the next, along the two axes of [`Plane::axes`].
    pub step: [Coordinate; 2],
    /// The R level: rapids end and feeds begin here.
    pub clear: Coordinate,
    /// The bottom of the holes, no higher than the R level.
    pub bottom: Coordinate,
    /// The dwell at the bottom, s, or the depth of a peck, mm; 0 for a cycle that has neither.
    pub value: Number,
}

impl Cycle {
    /// Returns two opposite corners of the box in which the cycle stays once it is over its first
    /// hole. `end`: the end of the cycle.
    pub fn corners<const AXES: usize>(&self, end: &[Coordinate; AXES]) -> [[Coordinate; AXES]; 2] {
        let top = self.clear.max(self.level(end));
        [
            self.at_level(end, self.bottom),
            self.hole(end, self.repeats.saturating_sub(1), top),
        ]
    }

    /// The place of the hole after which `left` holes follow, at a level of the tool's axis.
    pub(super) fn hole<const AXES: usize>(
        &self,
        end: &[Coordinate; AXES],
        left: u16,
        level: Coordinate,
    ) -> [Coordinate; AXES] {
        let (first, second) = self.plane.axes();
        let [x, y] = self.step;
        let mut hole = self.at_level(end, level);
        for (axis, step) in [(first, x), (second, y)] {
            if let Some(hole) = hole.get_mut(axis) {
                let back = step.nanos().saturating_mul(i64::from(left));
                *hole = *hole - Coordinate::from_nanos(back);
            }
        }
        hole
    }

    /// The same place at another level of the tool's axis.
    pub(super) fn at_level<const AXES: usize>(
        &self,
        at: &[Coordinate; AXES],
        level: Coordinate,
    ) -> [Coordinate; AXES] {
        let mut moved = *at;
        if let Some(slot) = moved.get_mut(self.plane.across()) {
            *slot = level;
        }
        moved
    }

    /// The coordinate of the tool's axis at a place.
    pub(super) fn level<const AXES: usize>(&self, at: &[Coordinate; AXES]) -> Coordinate {
        at.get(self.plane.across()).copied().unwrap_or_default()
    }
}
