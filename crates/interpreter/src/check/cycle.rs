//! Canned cycles, checked in LinuxCNC's order; in brackets are the numbers of the errors. Axis
//! words (26) and feed rate (22) as in [`path`](super::path), then axes that no cycle moves (36),
//! G93 (201), R (28), L (23, 52), the depth (28), R below it (200), P or Q (28, 52), the spindle of
//! G86 (202), and levels or holes that steps cannot count (52).
//!
//! R, the depth, P and Q of the line before stay in force as long as cycle, plane and distance mode
//! stay the same. The level of G98 stays for a whole series: cycles of any kind in one plane.

use super::{out_of_range, pick, sum_within, Check, AXIS_WORDS, L, P, Q, R};
use crate::code::Letters;
use crate::cycle::holes::{Cycle, MOST};
use crate::cycle::kind::CycleKind;
use crate::cycle::series::Series;
use crate::fault::Refusal;
use crate::modal_state::{Distance, FeedMode, Retract, Rotation};
use crate::Coordinate;
use crate::Status;
use leadscrew_gcode::{Letter, Number};

/// The axes that a cycle moves.
const X_Y_Z: Letters = Letters::of(&[Letter::X, Letter::Y, Letter::Z]);

/// A cycle that has passed the checks.
pub(super) struct Drilled<const AXES: usize> {
    pub(super) cycle: Cycle,
    pub(super) series: Series,
    /// The end of the cycle.
    pub(super) end: [Coordinate; AXES],
    /// Words that nobody has taken yet.
    pub(super) unused: Letters,
}

impl<const AXES: usize> Check<'_, AXES> {
    /// The cycle of a line; the first hole is at `first`.
    ///
    /// Takes the check by value, because a borrowed check cannot stay in registers (see
    /// [`super::beyond`]).
    pub(super) fn cycle(
        mut self,
        kind: CycleKind,
        first: [Coordinate; AXES],
    ) -> Result<Drilled<AXES>, Refusal> {
        self.check_cycle_words(kind)?;
        let plane = self.block.modal.plane;
        let kept = self.kept_words(kind);
        let r = match self.take(R) {
            true => self.length(self.block.r, R)?,
            false => kept.ok_or(missing(kind))?.r,
        };
        let repeats = self.repeats()?;
        let depth = match self.moves(plane.across()) {
            true => self.word(plane.across()),
            false => kept.ok_or(missing(kind))?.depth,
        };
        let initial = self.initial_level();
        let (clear, bottom) = self.levels(initial, r, depth)?;
        if clear < bottom {
            return Err(Refusal::words(Status::CycleBelowBottom, R));
        }
        let value = self.value(kind, kept, clear - bottom)?;
        if kind == CycleKind::BoreStop && self.is_spindle_still() {
            return Err(Refusal::g(Status::CycleNeedsSpindle, kind.code()));
        }
        let level = match self.block.modal.retract {
            Retract::Initial => initial.max(clear),
            Retract::Clear => clear,
        };
        let mut end = first;
        let step = self.lead_to_last_hole(repeats, level, &mut end)?;
        let cycle = Cycle {
            kind,
            lifts: initial < clear,
            plane,
            repeats,
            step,
            clear,
            bottom,
            value,
        };
        let series = Series {
            kind,
            plane,
            distance: self.block.modal.distance,
            initial,
            r,
            depth,
            value,
        };
        Ok(Drilled {
            cycle,
            series,
            end,
            unused: self.unused,
        })
    }

    /// Checks the axis words and the feed mode.
    fn check_cycle_words(&self, kind: CycleKind) -> Result<(), Refusal> {
        let others = self.block.letters.and(AXIS_WORDS).without(X_Y_Z);
        if !others.is_empty() {
            return Err(Refusal::words(Status::UnusedWords, others));
        }
        if self.block.modal.feed_mode == FeedMode::InverseTime {
            return Err(Refusal::g(Status::CycleInverseTime, kind.code()));
        }
        Ok(())
    }

    fn is_spindle_still(&self) -> bool {
        let modal = &self.block.modal;
        modal.rotation == Rotation::Off || modal.speed == Number::default()
    }

    /// Takes a word, if the line has it and nothing else has taken it. Returns whether it does.
    fn take(&mut self, letter: Letters) -> bool {
        let there = !self.unused.and(letter).is_empty();
        self.unused = self.unused.without(letter);
        there
    }

    /// The series of the line before, if its words stay in force.
    fn kept_words(&self, kind: CycleKind) -> Option<Series> {
        let modal = &self.block.modal;
        self.state.series.filter(|last| {
            (last.kind, last.plane, last.distance) == (kind, modal.plane, modal.distance)
        })
    }

    /// The number of times that the cycle is repeated.
    fn repeats(&mut self) -> Result<u16, Refusal> {
        if !self.take(L) {
            return Ok(1);
        }
        let whole = self.block.l.trunc();
        if Number::from_nanos(whole.saturating_mul(1_000_000_000)) != self.block.l {
            return Err(Refusal::words(Status::NotWhole, L));
        }
        u16::try_from(whole)
            .ok()
            .filter(|repeats| (1..=MOST).contains(repeats))
            .ok_or(Refusal::words(Status::OutOfRange, L))
    }

    /// The coordinate of the tool's axis before the series; the present one, if the line begins a
    /// series.
    fn initial_level(&self) -> Coordinate {
        let plane = self.block.modal.plane;
        let series = self.state.series.filter(|last| last.plane == plane);
        let here = pick(&self.state.position, plane.across());
        series.map_or(here, |last| last.initial)
    }

    /// R level and bottom, machine coordinates.
    fn levels(
        &self,
        initial: Coordinate,
        r: Coordinate,
        depth: Coordinate,
    ) -> Result<(Coordinate, Coordinate), Refusal> {
        let modal = &self.block.modal;
        let axis = modal.plane.across();
        let reach = pick(self.context.reach, axis);
        let zero = pick(&self.state.offsets.work_offset(modal.system), axis);
        let origin = match modal.distance {
            Distance::Absolute => zero,
            Distance::Incremental => initial,
        };
        let clear = sum_within(origin, r, reach).ok_or(Refusal::words(Status::OutOfRange, R))?;
        let origin = match modal.distance {
            Distance::Absolute => zero,
            Distance::Incremental => clear,
        };
        let bottom = sum_within(origin, depth, reach).ok_or(out_of_range(axis))?;
        Ok((clear, bottom))
    }

    /// The dwell, s, or the depth of a peck, mm; 0 for a cycle that takes neither.
    fn value(
        &mut self,
        kind: CycleKind,
        kept: Option<Series>,
        depth: Coordinate,
    ) -> Result<Number, Refusal> {
        if kind.pecks() {
            return self.peck(kind, kept, depth);
        }
        if !kind.dwells() {
            return Ok(Number::default());
        }
        if !self.take(P) {
            return Ok(kept.ok_or(missing(kind))?.value);
        }
        Ok(self.block.p)
    }

    /// The depth of a peck: [`MOST`] of them at most.
    fn peck(
        &mut self,
        kind: CycleKind,
        kept: Option<Series>,
        depth: Coordinate,
    ) -> Result<Number, Refusal> {
        let peck = match self.take(Q) {
            true => self.length(self.block.centre[0], Q)?.nanos(),
            false => kept.ok_or(missing(kind))?.value.nanos(),
        };
        if peck <= 0 || peck.saturating_mul(i64::from(MOST)) < depth.nanos() {
            return Err(Refusal::words(Status::OutOfRange, Q));
        }
        Ok(Number::from_nanos(peck))
    }

    /// Leads the target from the first hole to the end of the cycle; returns the way from a hole to
    /// the next.
    fn lead_to_last_hole(
        &self,
        repeats: u16,
        level: Coordinate,
        target: &mut [Coordinate; AXES],
    ) -> Result<[Coordinate; 2], Refusal> {
        let modal = &self.block.modal;
        let (first, second) = modal.plane.axes();
        let mut steps = [Coordinate::ZERO; 2];
        for (axis, way) in [first, second].into_iter().zip(&mut steps) {
            let Some(target) = target.get_mut(axis) else {
                continue;
            };
            if modal.distance == Distance::Incremental {
                *way = *target - pick(&self.state.position, axis);
            }
            let further = way.nanos().saturating_mul(i64::from(repeats - 1));
            let reach = pick(self.context.reach, axis);
            let last = sum_within(*target, Coordinate::from_nanos(further), reach);
            *target = match repeats {
                1 => *target,
                _ => last.ok_or(out_of_range(axis))?,
            };
        }
        if let Some(target) = target.get_mut(modal.plane.across()) {
            *target = level;
        }
        Ok(steps)
    }
}

fn missing(kind: CycleKind) -> Refusal {
    Refusal::g(Status::MissingWord, kind.code())
}
