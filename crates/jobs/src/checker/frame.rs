//! The facts that can be known about a program's place on the machine without running it: its
//! extent, the axes that it homes, and the home switches.

use super::{Checker, Finding, LineFaultKind};
use crate::remark::Remark;
use leadscrew_gcode::Number;
use leadscrew_machine::config::AxisKind;
use leadscrew_machine::home::{self, Bounds};
use leadscrew_machine::settings::table::{AxisSetting, Setting};
use leadscrew_machine::soft_limits;
use leadscrew_planner::Coordinate;

/// The way of each axis between its lowest and its highest target while one work zero is in force.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spans<const AXES: usize> {
    ends: [Option<(Coordinate, Coordinate)>; AXES],
    /// Axes that have been told to be too short.
    told: [bool; AXES],
}

impl<const AXES: usize> Spans<AXES> {
    /// The program begins: whoever runs it has set work zero, so that the machine can go there.
    pub(super) const BEGIN: Self = Self {
        ends: [Some((Coordinate::ZERO, Coordinate::ZERO)); AXES],
        told: [false; AXES],
    };

    /// Another work zero is in force from here on: the program sets it, and it may be anywhere.
    pub(super) fn begin(&mut self) {
        self.ends = [None; AXES];
    }

    /// Takes a target; returns an axis whose way has become longer than its travel, and that way.
    fn take(
        &mut self,
        target: &[Coordinate; AXES],
        travel: &[Coordinate; AXES],
    ) -> Option<(usize, Coordinate)> {
        let mut found = None;
        for axis in 0..AXES {
            let at = target[axis];
            let (low, high) =
                self.ends[axis].map_or((at, at), |(low, high)| (low.min(at), high.max(at)));
            self.ends[axis] = Some((low, high));
            let way = high - low;
            if way > travel[axis] && !self.told[axis] {
                self.told[axis] = true;
                found = found.or(Some((axis, way)));
            }
        }
        found
    }
}

impl<const AXES: usize> Checker<AXES> {
    /// Checks that a place can be reached: within the travel, in the frame, and from a work zero
    /// within the travel. With soft limits the machine refuses a place outside the travel itself.
    pub(super) fn check_place(&mut self, target: &[Coordinate; AXES]) -> Finding {
        let travel = self.check_travel(target);
        if self.settings.is_on(Setting::SoftLimits) {
            travel?;
            self.check_frame(target)?;
        } else {
            self.check_frame(target)?;
            travel?;
        }
        self.check_span(target)
    }

    /// Checks that a move in work coordinates fits the travel, wherever in it work zero is.
    fn check_span(&mut self, target: &[Coordinate; AXES]) -> Finding {
        if self.travel_counts || self.in_machine_coordinates || self.is_checking() {
            return Ok(());
        }
        let mut travel = self.measures.travel;
        for (axis, travel) in travel.iter_mut().enumerate() {
            if !self.knows_travel(axis) {
                *travel = Coordinate::from_nanos(i64::MAX);
            }
        }
        let Some((axis, way)) = self.spans.take(target, &travel) else {
            return Ok(());
        };
        let name = self.letters.get(axis).copied().unwrap_or('?');
        let detail = format!(
            "{name} goes over {:.3} mm, its travel is {:.3} mm",
            way.to_mm(),
            travel[axis].to_mm()
        );
        Err((LineFaultKind::CannotFit, Some(detail)))
    }

    /// Returns true if the travel of an axis is known. Grbl's own value says nothing on a machine
    /// that does not home: nobody has to set it there.
    fn knows_travel(&self, axis: usize) -> bool {
        let travel = self.settings.axes(AxisSetting::Travel)[axis];
        let is_set = travel != AxisSetting::Travel.row().default;
        self.config.axes[axis] == AxisKind::Linear
            && (is_set || self.settings.is_on(Setting::Homing))
    }

    /// A probe has moved from `start` towards `target`: where it has touched is not known.
    pub(super) fn forget_way(&mut self, start: &[Coordinate; AXES], target: &[Coordinate; AXES]) {
        for axis in (0..AXES).filter(|axis| start[*axis] != target[*axis]) {
            self.homed &= !(1 << axis);
            self.spans.ends[axis] = None;
        }
    }

    /// Checks that a target lies within the travel: with soft limits, if `travel_counts`, and for
    /// the axes that the program has homed.
    pub(super) fn check_travel(&self, target: &[Coordinate; AXES]) -> Finding {
        if !self.settings.is_on(Setting::SoftLimits) && !self.travel_counts && self.homed == 0 {
            return Ok(());
        }
        let ends = &self.measures.ends;
        let target = self.judged(target, ends);
        if soft_limits::allow(&target, ends, &self.config.axes) {
            return Ok(());
        }
        Err((LineFaultKind::OutOfTravel, Some(self.beyond(&target, ends))))
    }

    /// The sentence that tells which axes would leave their travel, and by how much.
    fn beyond(&self, target: &[Coordinate; AXES], ends: &[Bounds; AXES]) -> String {
        let kinds = self.config.axes.iter();
        let axes = self.letters.iter().zip(kinds).zip(target.iter().zip(ends));
        let parts: Vec<String> = axes
            .filter(|((_, kind), (at, ends))| {
                **kind != AxisKind::Extruder && !(ends.low..=ends.high).contains(at)
            })
            .map(|((name, _), (at, ends))| {
                format!(
                    "{name} would be at {:.3} mm, its travel is {:.3} to {}",
                    at.to_mm(),
                    ends.low.to_mm(),
                    Number::from_nanos(ends.high.nanos())
                )
            })
            .collect();
        parts.join("; ")
    }

    /// Notes a line in machine coordinates that leads onto a home switch: hard limits would stop
    /// the machine there.
    pub(super) fn see_switches(&mut self, line: &[u8]) {
        if !self.settings.is_on(Setting::HardLimits) || !self.settings.is_on(Setting::Homing) {
            return;
        }
        let homed = self
            .config
            .homing_cycles
            .iter()
            .fold(0, |all, cycle| all | cycle);
        let negative = self.settings.mask(Setting::HomingDirection);
        let ends = &self.measures.ends;
        let is_named =
            |letter: &char| u8::try_from(*letter).is_ok_and(|letter| line.contains(&letter));
        // G28 and G30 alone move all axes.
        let names_none = !self.letters.iter().any(is_named);
        for (axis, letter) in self.letters.iter().enumerate() {
            if !(names_none || is_named(letter)) || homed >> axis & 1 == 0 {
                continue;
            }
            let is_negative = negative >> axis & 1 == 1;
            let switch = ends[axis].place(Coordinate::ZERO, is_negative);
            let pull_off = Number::from_nanos(home::pull_off(&self.settings, axis).nanos());
            let at = self.interpreter.position()[axis];
            let is_on_it = if is_negative {
                at <= switch
            } else {
                at >= switch
            };
            if is_on_it {
                let (letter, switch) = (*letter, switch.to_mm());
                self.habits.note(Remark::OntoSwitch, || {
                    format!("the switch of {letter} closes at machine position {switch:.3}; $H leaves it by {pull_off} mm")
                });
            }
        }
    }

    /// Returns the coordinates that count against the travel. Without soft limits and a known
    /// origin only homed axes count; the others are at an end, which lies within the travel.
    pub(super) fn judged(
        &self,
        target: &[Coordinate; AXES],
        ends: &[Bounds; AXES],
    ) -> [Coordinate; AXES] {
        let counts_all = self.settings.is_on(Setting::SoftLimits) || self.travel_counts;
        std::array::from_fn(|axis| match counts_all || self.homed >> axis & 1 == 1 {
            true => target[axis],
            false => ends[axis].high,
        })
    }
}

/// Returns true if a line gives the present place other coordinates: G92, or G10 L20.
pub(super) fn counts_from_here(line: &[u8]) -> bool {
    let has = |code: &[u8; 3]| has(line, |word| word == code);
    has(b"G92") || has(b"G10") && has(b"L20")
}

/// Returns true if a line moves in machine coordinates (G53), or to a stored place (G28, G30).
pub(super) fn is_in_machine_coordinates(line: &[u8]) -> bool {
    has(line, |word| matches!(word, b"G53" | b"G28" | b"G30"))
}

/// Returns true if a line has a word of a letter and two digits that `is_code`, and no more digits
/// behind it.
fn has(line: &[u8], is_code: impl Fn(&[u8]) -> bool) -> bool {
    let mut words = line.windows(3).enumerate();
    words.any(|(at, word)| {
        let next = line.get(at + 3);
        is_code(word) && !next.is_some_and(|byte| byte.is_ascii_digit() || *byte == b'.')
    })
}
