//! The checks that need the whole line, in GRBL's order, and the plan of a line that passes.
//!
//! The order, with the numbers of the errors in brackets: line number (27), feed mode (22), dwell
//! (28), tool length (37), G10 and G92 (26, 28, 29, 20), targets that nothing reaches (52), G53
//! (30), axis words in G80 (31), feed rate (22), arcs (26, 32, then R: 33, 34, or I, J, K: 35, 33),
//! probing (26, 33), canned cycles (see [`cycle`]), words that nobody took (36).

mod cycle;
mod extruder;
mod offsets;
mod path;

use super::code::{Group, Groups, Letters, GROUPS_IN_JOGS};
use super::command::{ArcShape, OffsetId};
use super::context::Context;
use super::cycle::holes::Cycle;
use super::cycle::series::Series;
use super::fault::Refusal;
use super::modal_state::{Distance, FeedMode, Motion, ProbeKind, Units, WorkSystem};
use super::offsets::TOOL_AXIS;
use super::takers::{AxisCommand, NonModal, ToolLength};
use super::units::inches_to_millimetres;
use super::words::{Block, WITH_WORDS};
use super::{Coordinate, Interpreter, MAX_WORD};
use crate::AxisKind;
use crate::Status;
use leadscrew_gcode::{Letter, Number};

/// The commands of a checked line. Carrying them out cannot fail.
#[derive(Debug, Clone)]
pub(super) struct Plan<const AXES: usize> {
    pub(super) line_number: Option<u32>,
    /// The F that stays in force.
    pub(super) feed: Number,
    pub(super) tool_length: Option<Coordinate>,
    pub(super) effect: Effect<AXES>,
    pub(super) path: Path,
    /// The holes, and the words that the next line of the series need not repeat.
    pub(super) cycle: Option<(Cycle, Series)>,
    /// The axis words' target, machine coordinates; the present position if they name none.
    pub(super) target: [Coordinate; AXES],
}

impl<const AXES: usize> Plan<AXES> {
    /// Begins with nothing to do, at this position.
    #[inline]
    pub(super) fn new(position: &[Coordinate; AXES]) -> Self {
        Self {
            line_number: None,
            feed: Number::default(),
            tool_length: None,
            effect: Effect::None,
            path: Path::None,
            cycle: None,
            target: *position,
        }
    }
}

/// The effect of the non-modal command.
#[derive(Debug, Clone)]
pub(super) enum Effect<const AXES: usize> {
    None,
    Dwell(Number),
    SetOrigin(WorkSystem, [Coordinate; AXES]),
    SetG92([Coordinate; AXES]),
    /// G92.2 and G92.3.
    UseG92(bool),
    /// The length of a tool in the table.
    SetTool(u32, Coordinate),
    /// Stores the position at which the line begins.
    Store(OffsetId),
    /// Goes to this position, by way of the target if there are axis words.
    GoTo([Coordinate; AXES]),
}

/// The path of a line to its target.
#[derive(Debug, Clone)]
pub(super) enum Path {
    /// Not at all.
    None,
    Straight,
    Arc(ArcShape),
    Probe(ProbeKind),
    /// As [`Plan::cycle`] says.
    Cycle,
}

/// The purpose of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// To be carried out.
    Program,
    /// To jog: it may change no mode.
    Jog,
}

impl Purpose {
    /// Words that a line may have without a use: they set lasting values, or mean nothing.
    const fn free_words(self) -> Letters {
        match self {
            Self::Program => Letters::of(&[Letter::F, Letter::N, Letter::S, Letter::T]),
            Self::Jog => Letters::of(&[Letter::F, Letter::N]),
        }
    }
}

const AXIS_LETTERS: [Letter; 7] = [
    Letter::X,
    Letter::Y,
    Letter::Z,
    Letter::A,
    Letter::B,
    Letter::C,
    Letter::E,
];
const AXIS_WORDS: Letters = Letters::of(&AXIS_LETTERS);
const CENTRE_WORDS: Letters = Letters::of(&[Letter::I, Letter::J, Letter::K]);
const F: Letters = Letters::of(&[Letter::F]);
const H: Letters = Letters::of(&[Letter::H]);
const L: Letters = Letters::of(&[Letter::L]);
const M: Letters = Letters::of(&[Letter::M]);
const T: Letters = Letters::of(&[Letter::T]);
const N: Letters = Letters::of(&[Letter::N]);
const P: Letters = Letters::of(&[Letter::P]);
const Q: Letters = Letters::of(&[Letter::Q]);
const R: Letters = Letters::of(&[Letter::R]);

/// GRBL's largest N word.
const MAX_LINE_NUMBER: Number = Number::from_int(10_000_000);

/// A line under examination.
#[derive(Clone, Copy)]
pub(super) struct Check<'a, const AXES: usize> {
    pub(super) state: &'a Interpreter<AXES>,
    pub(super) block: &'a Block<AXES>,
    pub(super) context: &'a Context<'a, AXES>,
    purpose: Purpose,
    /// Words that nobody has taken yet.
    unused: Letters,
}

impl<'a, const AXES: usize> Check<'a, AXES> {
    /// Begins with a block that starts where `state` is.
    #[inline]
    pub(super) fn new(
        state: &'a Interpreter<AXES>,
        block: &'a Block<AXES>,
        context: &'a Context<'a, AXES>,
        purpose: Purpose,
    ) -> Self {
        let mut unused = block.letters.without(purpose.free_words());
        unused = unused.without(AXIS_WORDS);
        if block.groups.have_any(WITH_WORDS) {
            unused = left_by_m(unused, block, context);
        }
        Self {
            state,
            block,
            context,
            purpose,
            unused,
        }
    }

    /// Checks the line as a whole and fills in its commands.
    ///
    /// # Errors
    ///
    /// The first fault in GRBL's order. The plan is then worthless.
    #[inline]
    pub(super) fn plan(mut self, plan: &mut Plan<AXES>) -> Result<(), Refusal> {
        plan.line_number = self.line_number()?;
        plan.feed = self.feed()?;
        self.check_dwell()?;
        plan.tool_length = self.tool_length()?;
        if self.block.non_modal != NonModal::None {
            plan.effect = self.effect(plan.tool_length)?;
        }
        self.aim(&mut plan.target, plan.tool_length)?;
        self.check_machine_coordinates()?;
        if let Effect::GoTo(end) = &mut plan.effect {
            self.keep_others(end, &plan.target);
        }
        plan.path = self.path(plan.feed, &plan.target)?;
        match (&plan.path, self.block.modal.motion) {
            (Path::Cycle, Motion::Cycle(kind)) if cfg!(feature = "cycles") => {
                // Passed by value, for the reason given at [`beyond`].
                let drilled = self.cycle(kind, plan.target)?;
                plan.cycle = Some((drilled.cycle, drilled.series));
                plan.target = drilled.end;
                self.unused = drilled.unused;
            }
            _ => {}
        }
        self.check_leftovers()?;
        if self.block.groups.contains(Group::Own) {
            let checked = self.context.own.check();
            checked.map_err(|status| match status {
                Status::ToolTooLarge => Refusal::words(status, T),
                _ => Refusal::words(status, M),
            })?;
        }
        Ok(())
    }

    fn line_number(&self) -> Result<Option<u32>, Refusal> {
        if !self.gives(N) {
            return Ok(None);
        }
        let number = u32::try_from(self.block.n.trunc()).unwrap_or(u32::MAX);
        if i64::from(number) > MAX_LINE_NUMBER.trunc() {
            return Err(Refusal::words(Status::InvalidLineNumber, N));
        }
        Ok(Some(number))
    }

    /// The F in force, mm/min or 1/min. In G93 it never outlasts its line.
    fn feed(&self) -> Result<Number, Refusal> {
        let modal = &self.block.modal;
        match modal.feed_mode {
            FeedMode::InverseTime if self.needs_feed() && !self.gives(F) => {
                Err(self.feed_undefined())
            }
            FeedMode::InverseTime => Ok(self.block.f),
            FeedMode::PerMinute if self.gives(F) => Ok(self.in_millimetres(self.block.f)),
            FeedMode::PerMinute if self.purpose == Purpose::Jog => Err(self.feed_undefined()),
            FeedMode::PerMinute => Ok(match self.state.modal.feed_mode {
                FeedMode::InverseTime => Number::default(),
                FeedMode::PerMinute => self.state.modal.feed,
            }),
        }
    }

    fn needs_feed(&self) -> bool {
        self.block.axis_command == AxisCommand::Motion && self.block.modal.motion.needs_feed()
    }

    fn feed_undefined(&self) -> Refusal {
        Refusal::words(Status::FeedUndefined, F)
    }

    fn check_dwell(&mut self) -> Result<(), Refusal> {
        if self.block.non_modal != NonModal::Dwell {
            return Ok(());
        }
        if !self.gives(P) {
            return Err(Refusal::g(Status::MissingWord, 4));
        }
        self.unused = self.unused.without(P);
        Ok(())
    }

    #[inline]
    fn tool_length(&mut self) -> Result<Option<Coordinate>, Refusal> {
        match self.block.tool_length {
            ToolLength::Keep => Ok(None),
            ToolLength::Cancel => Ok(Some(Coordinate::ZERO)),
            ToolLength::FromTable => self.table_length().map(Some),
            ToolLength::FromWord if self.block.axis_mask != 1 << TOOL_AXIS => {
                Err(Refusal::g(Status::ToolLengthAxis, 43))
            }
            ToolLength::FromWord => storable(TOOL_AXIS, self.word(TOOL_AXIS)).map(Some),
        }
    }

    /// G43: the length of tool H, or of the one in the spindle.
    fn table_length(&mut self) -> Result<Coordinate, Refusal> {
        let tool = match self.gives(H) {
            true => Some(u32::try_from(self.block.h.trunc()).unwrap_or(u32::MAX)),
            false => None,
        };
        self.unused = self.unused.without(H);
        let missing = match tool {
            Some(0) => return Ok(Coordinate::ZERO),
            Some(_) => Refusal::words(Status::NoSuchTool, H),
            None => Refusal::g(Status::NoSuchTool, 43),
        };
        self.context.tools.length(tool).ok_or(missing)
    }

    /// The effect of the non-modal command, after the change of the tool length.
    fn effect(&mut self, tool_length: Option<Coordinate>) -> Result<Effect<AXES>, Refusal> {
        Ok(match self.block.non_modal {
            NonModal::None | NonModal::MachineCoordinates => Effect::None,
            NonModal::Dwell => Effect::Dwell(self.block.p),
            NonModal::SetOrigin => self.set_origin(tool_length)?,
            NonModal::GoTo(id) => Effect::GoTo(*self.state.offsets.get(id)),
            NonModal::Store(id) => Effect::Store(id),
            NonModal::SetG92 => self.set_g92(tool_length)?,
            NonModal::LocalOrigin => self.set_local_origin()?,
            NonModal::UseG92(again) => Effect::UseG92(again),
            NonModal::ClearG92 => Effect::SetG92([Coordinate::ZERO; AXES]),
        })
    }

    /// Sets the target to the place that the axis words name, if they are not an offset.
    #[inline]
    fn aim(
        &self,
        target: &mut [Coordinate; AXES],
        tool_length: Option<Coordinate>,
    ) -> Result<(), Refusal> {
        if self.block.axis_mask == 0 || !self.has_target() {
            return Ok(());
        }
        let modal = &self.block.modal;
        let other_system;
        let origin = if self.block.non_modal == NonModal::MachineCoordinates {
            &[Coordinate::ZERO; AXES]
        } else if modal.distance == Distance::Incremental {
            &self.state.position
        } else if modal.system == self.state.modal.system && tool_length.is_none() {
            &self.state.work_offset
        } else {
            let offsets = &self.state.offsets;
            other_system = offsets.work_offset_with(modal.system, tool_length);
            &other_system
        };
        let (extruder, origin_of_e) = (self.context.extruder(), self.extruder_origin());
        let axes = target.iter_mut().zip(origin).zip(self.context.reach);
        for (axis, ((target, origin), reach)) in axes.enumerate() {
            if self.moves(axis) {
                let word = self.word(axis);
                let origin = match origin_of_e {
                    Some(of_e) if extruder == Some(axis) => of_e,
                    _ => *origin,
                };
                let soft_limits = self.context.soft_limits;
                *target = sum_within(origin, word, *reach)
                    .or_else(|| soft_limits.then(|| beyond(origin, word, *reach)))
                    .ok_or_else(|| self.beyond_reach(axis))?;
            }
        }
        Ok(())
    }

    /// Returns true if axis words say where to go.
    fn has_target(&self) -> bool {
        match self.block.axis_command {
            AxisCommand::None | AxisCommand::Motion => true,
            AxisCommand::NonModal => {
                let of = self.block.non_modal;
                !matches!(
                    of,
                    NonModal::SetOrigin | NonModal::SetG92 | NonModal::LocalOrigin
                )
            }
            AxisCommand::SetToolLength | AxisCommand::CancelToolLength => false,
        }
    }

    /// For G28 and G30: sets `end` to `target` on each axis that the second move leaves alone. If
    /// the line has axis words, these are the axes without one. The extruder is always one: G28 and
    /// G30 have no place for it.
    fn keep_others(&self, end: &mut [Coordinate; AXES], target: &[Coordinate; AXES]) {
        let extruder = self.context.extruder();
        if self.block.axis_mask == 0 && extruder.is_none() {
            return;
        }
        for (axis, (end, target)) in end.iter_mut().zip(target).enumerate() {
            let stays = self.block.axis_mask != 0 && !self.moves(axis);
            if stays || extruder == Some(axis) {
                *end = *target;
            }
        }
    }

    #[inline]
    fn check_machine_coordinates(&self) -> Result<(), Refusal> {
        if self.block.non_modal != NonModal::MachineCoordinates {
            return Ok(());
        }
        match self.block.modal.motion {
            Motion::Rapid | Motion::Feed => Ok(()),
            Motion::Cancelled if self.block.axis_mask == 0 => Ok(()), // nothing to go to
            Motion::Arc(_) | Motion::Probe(_) | Motion::Cycle(_) | Motion::Cancelled => {
                Err(Refusal::g(Status::MachineCoordinatesNeedStraight, 53))
            }
        }
    }

    #[inline]
    fn check_leftovers(&self) -> Result<(), Refusal> {
        if !self.unused.is_empty() {
            return Err(Refusal::words(Status::UnusedWords, self.unused));
        }
        match self.purpose {
            Purpose::Program => Ok(()),
            Purpose::Jog if self.is_jog() => Ok(()),
            Purpose::Jog => Err(Refusal::not_in_jogs()),
        }
    }

    /// Returns true if a jog may have all words of the line. Besides its motion it may choose
    /// units, distance mode and machine coordinates.
    fn is_jog(&self) -> bool {
        let modes = self.block.groups.without(GROUPS_IN_JOGS).is_empty();
        let non_modal = self.block.non_modal;
        modes && matches!(non_modal, NonModal::None | NonModal::MachineCoordinates)
    }

    /// An axis word in mm or degrees.
    #[inline]
    fn word(&self, axis: usize) -> Coordinate {
        let word = self.block.axes.get(axis).copied().unwrap_or_default();
        let linear = self.context.axes.get(axis) != Some(&AxisKind::Rotary);
        let mm = match self.block.modal.units {
            Units::Inches if linear => inches_to_millimetres(word),
            Units::Inches | Units::Millimetres => word,
        };
        Coordinate::from_nanos(mm.nanos())
    }

    #[inline]
    fn in_millimetres(&self, value: Number) -> Number {
        match self.block.modal.units {
            Units::Millimetres => value,
            Units::Inches => inches_to_millimetres(value),
        }
    }

    /// Returns true if the line has any of these words.
    fn gives(&self, letters: Letters) -> bool {
        !self.block.letters.and(letters).is_empty()
    }

    /// Returns true if an axis has a word.
    fn moves(&self, axis: usize) -> bool {
        self.block.axis_mask & 1 << axis != 0
    }
}

/// Words that take a P.
const WITH_P: Groups = Groups::of(&[
    Group::Parking,
    Group::FeedOverride,
    Group::SpindleOverride,
    Group::Blend,
]);

/// The words that neither an M code nor G64 takes.
fn left_by_m<const AXES: usize>(
    unused: Letters,
    block: &Block<AXES>,
    context: &Context<'_, AXES>,
) -> Letters {
    let mut left = unused;
    let groups = block.groups;
    if groups.have_any(WITH_P) {
        left = left.without(P);
    }
    // Q stands in the place of I: a line that has both has one too many.
    if groups.contains(Group::Blend) && !block.letters.contains(Letter::I) {
        left = left.without(Q);
    }
    let found = context.own.found();
    let Some((code, _)) = found.filter(|_| block.groups.contains(Group::Own)) else {
        return left;
    };
    left.without(Letters::taken_by(code))
}

fn pick<const AXES: usize>(values: &[Coordinate; AXES], axis: usize) -> Coordinate {
    values.get(axis).copied().unwrap_or_default()
}

fn axis_letter(axis: usize) -> Letters {
    AXIS_LETTERS
        .get(axis)
        .map_or(AXIS_WORDS, |letter| Letters::of(&[*letter]))
}

/// The sum of two coordinates, unless it is beyond `limit` to either side.
#[inline]
fn sum_within(one: Coordinate, other: Coordinate, limit: Coordinate) -> Option<Coordinate> {
    let sum = one.nanos().checked_add(other.nanos())?;
    let within = sum.unsigned_abs() <= limit.nanos() as u64; // a limit is never negative
    within.then_some(Coordinate::from_nanos(sum))
}

/// A target outside every travel, on the side to which the sum of two coordinates leads beyond
/// `limit`. It takes values: a check that a function borrows cannot stay in registers, which costs
/// a tenth of a line's instructions.
#[cold]
fn beyond(one: Coordinate, other: Coordinate, limit: Coordinate) -> Coordinate {
    let outside = limit + Coordinate::from_nanos(1);
    if one.nanos().saturating_add(other.nanos()) < 0 {
        -outside
    } else {
        outside
    }
}

pub(super) fn out_of_range(axis: usize) -> Refusal {
    Refusal::words(Status::OutOfRange, axis_letter(axis))
}

/// An offset of an axis, or its refusal beyond ±[`MAX_WORD`]: GRBL stores another one in its place.
fn storable(axis: usize, offset: Coordinate) -> Result<Coordinate, Refusal> {
    match (-MAX_WORD..=MAX_WORD).contains(&offset) {
        true => Ok(offset),
        false => Err(out_of_range(axis)),
    }
}
