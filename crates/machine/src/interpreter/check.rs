//! The checks that need the whole line, in GRBL's order, and what the line comes to if it passes.
//!
//! Line number (27), feed mode (22), dwell (28), tool length (37), what G10 and G92 need (26, 28, 29, 20), targets that
//! nothing reaches (52), G53 (30), axis words in G80 (31), feed rate (22), arcs (26, 32, then R: 33, 34, or I, J, K: 35,
//! 33), probing (26, 33), words that nobody took (36).

use super::arc::{centre_from_radius, check_centre};
use super::command::{ArcShape, OffsetId};
use super::context::Context;
use super::fault::Refusal;
use super::letters::{Group, Letters, GROUPS_IN_JOGS};
use super::modal_state::{Distance, FeedMode, Motion, Plane, ProbeKind, Turn, Units, WorkSystem};
use super::offsets::TOOL_AXIS;
use super::units::{inches_to_millimetres, millimetres};
use super::words::{AxisCommand, Block, NonModal};
use super::{Coordinate, Interpreter, MAX_WORD};
use crate::config::AxisKind;
use crate::protocol::status::Status;
use core::array::from_fn;
use leadscrew_gcode::{Letter, Number};

/// What a line comes to. Carrying it out cannot fail.
#[derive(Debug, Clone)]
pub(super) struct Plan<const AXES: usize> {
    pub(super) line_number: Option<u32>,
    /// The F that stays in force.
    pub(super) feed: Number,
    pub(super) tool_length: Option<Coordinate>,
    pub(super) effect: Effect<AXES>,
    pub(super) path: Path,
    /// Where the axis words lead, machine coordinates; the position where they lead nowhere.
    pub(super) target: [Coordinate; AXES],
}

/// What the non-modal command does.
#[derive(Debug, Clone)]
pub(super) enum Effect<const AXES: usize> {
    None,
    Dwell(Number),
    SetOrigin(WorkSystem, [Coordinate; AXES]),
    SetG92([Coordinate; AXES]),
    /// Stores where the line begins.
    Store(OffsetId),
    /// Goes there, by way of the target where there are axis words.
    GoTo([Coordinate; AXES]),
}

/// How a line moves to its target.
#[derive(Debug, Clone)]
pub(super) enum Path {
    /// Not at all.
    None,
    Straight,
    Arc(ArcShape),
    Probe(ProbeKind),
}

/// What a line is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// To be carried out.
    Program,
    /// To jog: it may change no mode.
    Jog,
}

impl Purpose {
    /// Words that a line may have for nothing: they set what stays, or say nothing.
    const fn free_words(self) -> Letters {
        match self {
            Self::Program => Letters::of(&[Letter::F, Letter::N, Letter::S, Letter::T]),
            Self::Jog => Letters::of(&[Letter::F, Letter::N]),
        }
    }
}

const AXIS_LETTERS: [Letter; 6] = [
    Letter::X,
    Letter::Y,
    Letter::Z,
    Letter::A,
    Letter::B,
    Letter::C,
];
const AXIS_WORDS: Letters = Letters::of(&AXIS_LETTERS);
const CENTRE_WORDS: Letters = Letters::of(&[Letter::I, Letter::J, Letter::K]);
const F: Letters = Letters::of(&[Letter::F]);
const L: Letters = Letters::of(&[Letter::L]);
const N: Letters = Letters::of(&[Letter::N]);
const P: Letters = Letters::of(&[Letter::P]);
const R: Letters = Letters::of(&[Letter::R]);

/// GRBL's largest N word.
const MAX_LINE_NUMBER: Number = Number::from_int(10_000_000);

/// A line under examination.
pub(super) struct Check<'a, const AXES: usize> {
    state: &'a Interpreter<AXES>,
    block: &'a Block<AXES>,
    context: &'a Context<'a, AXES>,
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
        if block.groups.contains(Group::Parking) {
            unused = unused.without(P);
        }
        Self {
            state,
            block,
            context,
            purpose,
            unused: unused.without(AXIS_WORDS),
        }
    }

    /// Checks the line as a whole.
    ///
    /// # Errors
    ///
    /// The first fault in GRBL's order.
    #[inline]
    pub(super) fn plan(mut self) -> Result<Plan<AXES>, Refusal> {
        let line_number = self.line_number()?;
        let feed = self.feed()?;
        self.check_dwell()?;
        let words = self.axis_words()?;
        let tool_length = self.tool_length(&words)?;
        let (effect, target) = match self.block.non_modal {
            NonModal::None => (Effect::None, self.target(&words)?),
            command => self.non_modal(command, &words)?,
        };
        let path = self.path(feed, &target)?;
        if !self.unused.is_empty() {
            return Err(Refusal::words(Status::UnusedWords, self.unused));
        }
        if self.purpose == Purpose::Jog && !self.is_jog() {
            return Err(Refusal::not_in_jogs());
        }
        Ok(Plan {
            line_number,
            feed,
            tool_length,
            effect,
            path,
            target,
        })
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
            FeedMode::PerMinute if self.gives(F) => self.in_millimetres(self.block.f, F),
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

    /// The axis words in mm or degrees; zero where there is none.
    #[inline]
    fn axis_words(&self) -> Result<[Coordinate; AXES], Refusal> {
        let mut lengths = [Coordinate::ZERO; AXES];
        if self.block.axis_mask == 0 {
            return Ok(lengths);
        }
        for (axis, (length, word)) in lengths.iter_mut().zip(&self.block.axes).enumerate() {
            let letter = axis_letter(axis);
            *length = match self.context.axes.get(axis) {
                Some(AxisKind::Rotary) => in_range(*word, letter)?,
                Some(AxisKind::Linear) | None => self.length(*word, letter)?,
            };
        }
        Ok(lengths)
    }

    fn tool_length(&self, words: &[Coordinate; AXES]) -> Result<Option<Coordinate>, Refusal> {
        match self.block.axis_command {
            AxisCommand::SetToolLength if self.block.axis_mask != 1 << TOOL_AXIS => {
                Err(Refusal::g(Status::ToolLengthAxis, 43))
            }
            AxisCommand::SetToolLength => Ok(words.get(TOOL_AXIS).copied()),
            AxisCommand::CancelToolLength => Ok(Some(Coordinate::ZERO)),
            AxisCommand::None | AxisCommand::Motion | AxisCommand::NonModal => Ok(None),
        }
    }

    fn non_modal(
        &mut self,
        command: NonModal,
        words: &[Coordinate; AXES],
    ) -> Result<(Effect<AXES>, [Coordinate; AXES]), Refusal> {
        let here = self.state.position;
        Ok(match command {
            NonModal::None => (Effect::None, self.target(words)?),
            NonModal::Dwell => (Effect::Dwell(self.block.p), self.target(words)?),
            NonModal::SetOrigin => (self.set_origin(words)?, here),
            NonModal::GoTo(id) => {
                let target = self.target(words)?;
                (self.go_to(id, &target), target)
            }
            NonModal::Store(id) => (Effect::Store(id), self.target(words)?),
            NonModal::MachineCoordinates => {
                let target = self.target(words)?;
                self.check_machine_coordinates()?;
                (Effect::None, target)
            }
            NonModal::SetG92 => (self.set_g92(words)?, here),
            NonModal::ClearG92 => (
                Effect::SetG92([Coordinate::ZERO; AXES]),
                self.target(words)?,
            ),
        })
    }

    /// G10 L2 (the words are the origin) and L20 (the words are where the axes shall be).
    fn set_origin(&mut self, words: &[Coordinate; AXES]) -> Result<Effect<AXES>, Refusal> {
        let fault = |status| Refusal::g(status, 10);
        if self.block.axis_mask == 0 {
            return Err(fault(Status::NoAxisWords));
        }
        if !self.gives(P) && !self.gives(L) {
            return Err(fault(Status::MissingWord));
        }
        let system = self.named_system()?;
        let others = match self.block.l.trunc() {
            2 if !self.gives(R) => None,
            20 => Some(self.state.offsets.without_system()),
            _ => return Err(Refusal::words(Status::UnsupportedCommand, L)),
        };
        self.unused = self.unused.without(P).without(L);
        let old = self.state.offsets.get(OffsetId::Work(system));
        let origin = match others {
            None => self.merge(old, words)?,
            Some(others) => self.merge(old, &self.shift(&others, words))?,
        };
        Ok(Effect::SetOrigin(system, origin))
    }

    /// The system that P names; the one in force where it is 0 or missing.
    fn named_system(&self) -> Result<WorkSystem, Refusal> {
        match usize::try_from(self.block.p.trunc()) {
            Ok(0) => Some(self.block.modal.system),
            Ok(number) => WorkSystem::ALL.get(number - 1).copied(),
            Err(_) => None,
        }
        .ok_or(Refusal::words(Status::UnsupportedSystem, P))
    }

    fn set_g92(&self, words: &[Coordinate; AXES]) -> Result<Effect<AXES>, Refusal> {
        if self.block.axis_mask == 0 {
            return Err(Refusal::g(Status::NoAxisWords, 92));
        }
        let offsets = &self.state.offsets;
        let others = offsets.without_g92(self.block.modal.system);
        let offset = self.merge(offsets.g92(), &self.shift(&others, words))?;
        Ok(Effect::SetG92(offset))
    }

    /// The offsets that, with the others, make the present position read as `words`.
    fn shift(&self, others: &[Coordinate; AXES], words: &[Coordinate; AXES]) -> [Coordinate; AXES] {
        from_fn(|axis| pick(&self.state.position, axis) - pick(others, axis) - pick(words, axis))
    }

    /// The old offsets, and the new ones on axes that have a word.
    fn merge(
        &self,
        old: &[Coordinate; AXES],
        new: &[Coordinate; AXES],
    ) -> Result<[Coordinate; AXES], Refusal> {
        let mut merged = *old;
        for (axis, (merged, new)) in merged.iter_mut().zip(new).enumerate() {
            if self.moves(axis) {
                *merged = *new;
                check_magnitude(*new, MAX_WORD, axis)?;
            }
        }
        Ok(merged)
    }

    /// G28 and G30: the axes with a word go to the stored place, without any word all do.
    fn go_to(&self, id: OffsetId, target: &[Coordinate; AXES]) -> Effect<AXES> {
        let place = self.state.offsets.get(id);
        let all = self.block.axis_mask == 0;
        Effect::GoTo(from_fn(|axis| {
            let axes = if all || self.moves(axis) {
                place
            } else {
                target
            };
            pick(axes, axis)
        }))
    }

    fn check_machine_coordinates(&self) -> Result<(), Refusal> {
        match self.block.modal.motion {
            Motion::Rapid | Motion::Feed => Ok(()),
            Motion::Arc(_) | Motion::Probe(_) | Motion::Cancelled => {
                Err(Refusal::g(Status::MachineCoordinatesNeedStraight, 53))
            }
        }
    }

    /// Where the axis words lead.
    #[inline]
    fn target(&self, words: &[Coordinate; AXES]) -> Result<[Coordinate; AXES], Refusal> {
        let mut target = self.state.position;
        let modal = &self.block.modal;
        if self.block.axis_mask == 0 || self.block.axis_command == AxisCommand::SetToolLength {
            return Ok(target);
        }
        let zero = match (self.block.non_modal, modal.distance) {
            (NonModal::MachineCoordinates, _) => [Coordinate::ZERO; AXES],
            (_, Distance::Incremental) => target,
            (_, Distance::Absolute) if modal.system == self.state.modal.system => {
                self.state.work_offset
            }
            (_, Distance::Absolute) => self.state.offsets.work_offset(modal.system),
        };
        for (axis, target) in target.iter_mut().enumerate() {
            if self.moves(axis) {
                *target = pick(&zero, axis) + pick(words, axis);
                check_magnitude(*target, pick(self.context.reach, axis), axis)?;
            }
        }
        Ok(target)
    }

    /// What the motion mode makes of the line.
    #[inline]
    fn path(&mut self, feed: Number, target: &[Coordinate; AXES]) -> Result<Path, Refusal> {
        let (motion, still) = (self.block.modal.motion, self.block.axis_mask == 0);
        if motion == Motion::Cancelled && !still {
            return Err(Refusal::words(Status::AxisWordsUnused, AXIS_WORDS));
        }
        if self.block.axis_command != AxisCommand::Motion {
            return Ok(Path::None);
        }
        if motion.needs_feed() && feed == Number::default() {
            return Err(self.feed_undefined());
        }
        match motion {
            Motion::Rapid | Motion::Feed if still => Ok(Path::None),
            Motion::Rapid | Motion::Feed => Ok(Path::Straight),
            Motion::Arc(turn) => self.arc(turn, target).map(Path::Arc),
            Motion::Probe(_) if still => Err(Refusal::g(Status::NoAxisWords, 38)),
            Motion::Probe(_) if *target == self.state.position => {
                Err(Refusal::words(Status::InvalidTarget, AXIS_WORDS))
            }
            Motion::Probe(kind) => Ok(Path::Probe(kind)),
            Motion::Cancelled => Ok(Path::None),
        }
    }

    fn arc(&mut self, turn: Turn, target: &[Coordinate; AXES]) -> Result<ArcShape, Refusal> {
        let plane = self.block.modal.plane;
        let (first, second) = plane.axes();
        if self.block.axis_mask == 0 {
            let code = match turn {
                Turn::Clockwise => 2,
                Turn::Counterclockwise => 3,
            };
            return Err(Refusal::g(Status::NoAxisWords, code));
        }
        if !self.moves(first) && !self.moves(second) {
            return Err(Refusal::words(Status::NoAxisWordsInPlane, AXIS_WORDS));
        }
        let travel =
            [first, second].map(|axis| pick(target, axis) - pick(&self.state.position, axis));
        let centre = if self.gives(R) {
            self.centre_by_radius(travel, turn)?
        } else {
            self.centre_by_offset(travel, plane)?
        };
        Ok(ArcShape {
            plane,
            turn,
            centre,
        })
    }

    fn centre_by_radius(
        &mut self,
        travel: [Coordinate; 2],
        turn: Turn,
    ) -> Result<[Coordinate; 2], Refusal> {
        self.unused = self.unused.without(R);
        let radius = self.length(self.block.r, R)?;
        centre_from_radius(travel, radius, turn).map_err(|status| Refusal::words(status, R))
    }

    fn centre_by_offset(
        &mut self,
        travel: [Coordinate; 2],
        plane: Plane,
    ) -> Result<[Coordinate; 2], Refusal> {
        let in_plane = match plane {
            Plane::Xy => Letters::of(&[Letter::I, Letter::J]),
            Plane::Zx => Letters::of(&[Letter::K, Letter::I]),
            Plane::Yz => Letters::of(&[Letter::J, Letter::K]),
        };
        if !self.gives(in_plane) {
            return Err(Refusal::words(Status::ArcCentreMissing, AXIS_WORDS));
        }
        self.unused = self.unused.without(CENTRE_WORDS);
        let [i, j, k] = self.block.centre;
        let (first, second) = match plane {
            Plane::Xy => (i, j),
            Plane::Zx => (k, i),
            Plane::Yz => (j, k),
        };
        let centre = [
            self.length(first, CENTRE_WORDS)?,
            self.length(second, CENTRE_WORDS)?,
        ];
        check_centre(travel, centre)
            .map_err(|status| Refusal::words(status, CENTRE_WORDS))
            .map(|()| centre)
    }

    /// Whether a jog may say all this: it may choose units and distance mode for itself, and machine coordinates.
    fn is_jog(&self) -> bool {
        let modes = self.block.groups.without(GROUPS_IN_JOGS).is_empty();
        modes
            && matches!(
                self.block.non_modal,
                NonModal::None | NonModal::MachineCoordinates
            )
    }

    /// A length in units of the program.
    #[inline]
    fn length(&self, value: Number, letter: Letters) -> Result<Coordinate, Refusal> {
        in_range(self.in_millimetres(value, letter)?, letter)
    }

    #[inline]
    fn in_millimetres(&self, value: Number, letter: Letters) -> Result<Number, Refusal> {
        match self.block.modal.units {
            Units::Millimetres => Ok(value),
            Units::Inches => {
                inches_to_millimetres(value).map_err(|status| Refusal::words(status, letter))
            }
        }
    }

    /// Whether the line has any of these words.
    fn gives(&self, letters: Letters) -> bool {
        !self.block.letters.and(letters).is_empty()
    }

    /// Whether an axis has a word.
    fn moves(&self, axis: usize) -> bool {
        self.block.axis_mask & 1 << axis != 0
    }
}

fn pick<const AXES: usize>(values: &[Coordinate; AXES], axis: usize) -> Coordinate {
    values.get(axis).copied().unwrap_or_default()
}

fn axis_letter(axis: usize) -> Letters {
    AXIS_LETTERS
        .get(axis)
        .map_or(AXIS_WORDS, |letter| Letters::of(&[*letter]))
}

fn in_range(value: Number, letter: Letters) -> Result<Coordinate, Refusal> {
    millimetres(value).map_err(|status| Refusal::words(status, letter))
}

fn check_magnitude(value: Coordinate, limit: Coordinate, axis: usize) -> Result<(), Refusal> {
    if value.nanos().unsigned_abs() > limit.nanos().unsigned_abs() {
        return Err(Refusal::words(Status::OutOfRange, axis_letter(axis)));
    }
    Ok(())
}
