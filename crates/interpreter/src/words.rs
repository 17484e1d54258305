//! The words of one line, gathered from left to right, each checked as it comes.
//!
//! A word is checked in GRBL's order: that it does not claim axis words that are taken (24), that
//! it exists (20, 38) and its number is whole if it must be (23), that neither its group nor its
//! letter was there before (21, 25), that it is not negative if it may not be (4).

use super::code::{Code, GWord, Group, Groups, Letters, MWord};
use super::context::{Context, OwnCodes};
use super::fault::Fault;
use super::modal_state::{Coolant, ModalState, Motion, OverrideControl};
use super::takers::{AxisCommand, Flow, NonModal, ToolLength};
use crate::own::Words;
use crate::{Dialect, Status};
use leadscrew_gcode::{words, Letter, Number, Word};

/// The words of one line, and the modal state with these words applied.
#[derive(Debug, Clone)]
pub(super) struct Block<const AXES: usize> {
    /// The modal state of the lines before, as this line's words change it. Its feed is still the
    /// old one.
    pub(super) modal: ModalState,
    /// The letters seen, except G and M.
    pub(super) letters: Letters,
    /// The modal groups seen.
    pub(super) groups: Groups,
    /// The command that takes the axis words.
    pub(super) axis_command: AxisCommand,
    /// The non-modal command.
    pub(super) non_modal: NonModal,
    /// The change of the tool length.
    pub(super) tool_length: ToolLength,
    /// The program flow at the end of the line.
    pub(super) flow: Flow,
    /// The axes that have a word, one bit an axis.
    pub(super) axis_mask: u8,
    /// The axis words, in units of the program.
    pub(super) axes: [Number; AXES],
    /// I, J, K, in units of the program; Q in the place of I. No line takes both. A place of its
    /// own for Q, which each line would have to zero, would cost 100 instructions a line.
    pub(super) centre: [Number; 3],
    pub(super) f: Number,
    pub(super) h: Number,
    pub(super) l: Number,
    pub(super) n: Number,
    pub(super) p: Number,
    pub(super) r: Number,
}

impl<const AXES: usize> Block<AXES> {
    /// Begins a line in this modal state.
    #[inline]
    pub(super) fn new(modal: &ModalState) -> Self {
        Self {
            modal: ModalState { tool: 0, ..*modal },
            letters: Letters::default(),
            groups: Groups::default(),
            axis_command: AxisCommand::None,
            non_modal: NonModal::None,
            tool_length: ToolLength::Keep,
            flow: Flow::Continue,
            axis_mask: 0,
            axes: [Number::default(); AXES],
            centre: [Number::default(); 3],
            f: Number::default(),
            h: Number::default(),
            l: Number::default(),
            n: Number::default(),
            p: Number::default(),
            r: Number::default(),
        }
    }

    /// Gathers the words of a line. `before`: the modal state of the lines before.
    ///
    /// # Errors
    ///
    /// The first fault from the left.
    #[inline]
    pub(super) fn read(
        &mut self,
        line: &[u8],
        context: &Context<'_, AXES>,
        before: &ModalState,
    ) -> Result<(), Fault> {
        for word in words(line) {
            let word = match word {
                Ok(word) => word,
                Err(_) if line == b"%" && context.dialect.has_linuxcnc() => break,
                Err(error) => return Err(Fault::from(error).named(line, context.dialect)),
            };
            self.take(&word, context).map_err(|status| {
                let column = word.column();
                Fault { status, column }.named(line, context.dialect)
            })?;
        }
        self.finish(context, before);
        Ok(())
    }

    #[inline]
    fn take(&mut self, word: &Word, context: &Context<'_, AXES>) -> Result<(), Status> {
        match word.letter() {
            Letter::G => self.take_g(Code::of(word.value()), context.dialect),
            Letter::M => self.take_m(Code::of(word.value()), context),
            letter => self.take_value(letter, word.value(), context),
        }
    }

    /// Applies the words whose meaning depends on the whole line.
    fn finish(&mut self, context: &Context<'_, AXES>, before: &ModalState) {
        let free = match self.axis_command {
            AxisCommand::None => true,
            // G53 says that the axis words are a place to go to.
            AxisCommand::CancelToolLength => self.non_modal == NonModal::MachineCoordinates,
            AxisCommand::Motion | AxisCommand::NonModal | AxisCommand::SetToolLength => false,
        };
        if free && self.axis_mask != 0 {
            self.axis_command = AxisCommand::Motion;
        }
        if self.groups.have_any(WITH_WORDS) {
            self.finish_m(context, before);
        }
    }

    /// Gives M codes the words that belong to them.
    fn finish_m(&mut self, context: &Context<'_, AXES>, before: &ModalState) {
        if self.groups.contains(Group::Parking) {
            self.modal.parking = self.is_on();
        }
        let found = context.own.found();
        let Some((code, _)) = found.filter(|_| self.groups.contains(Group::Own)) else {
            return;
        };
        // A tool that an earlier line has selected counts as a T word of this line.
        let keeps = |letter| letter == Letter::T && context.dialect.tools;
        let takes = |letter| code.takes(letter) && (self.letters.contains(letter) || keeps(letter));
        let values = [
            (Letter::L, self.l),
            (Letter::P, self.p),
            (Letter::R, self.r),
            (Letter::S, self.modal.speed),
            (Letter::T, whole_number(self.modal.tool)),
        ];
        let mut words = Words::NONE;
        for (letter, value) in values.into_iter().filter(|(letter, _)| takes(*letter)) {
            words.insert(letter, value);
        }
        context.own.set_words(words);
        if takes(Letter::S) {
            self.modal.speed = before.speed;
        }
        if takes(Letter::T) && !keeps(Letter::T) {
            self.modal.tool = 0;
        }
    }

    /// Returns true if P is not 0, or is left out.
    fn is_on(&self) -> bool {
        !self.letters.contains(Letter::P) || self.p != Number::default()
    }

    /// The overrides that act after a line of M48 to M51.
    pub(super) fn overrides(&self, before: OverrideControl) -> OverrideControl {
        let of = |group| match self.groups.contains(Group::Overrides) {
            true if self.groups.contains(group) => Some(self.is_on()),
            _ => None,
        };
        let both = of(Group::AllOverrides).or(of(Group::NoOverrides).map(|_| false));
        OverrideControl {
            feed: of(Group::FeedOverride).or(both).unwrap_or(before.feed),
            spindle: of(Group::SpindleOverride)
                .or(both)
                .unwrap_or(before.spindle),
        }
    }

    /// Checks M70 to M73, which stand alone.
    pub(super) fn check_modes(&self) -> Result<(), Status> {
        let has = |group| self.groups.contains(group);
        match () {
            // Both control overrides: RS274/NGC's group of M48 and M49.
            () if has(Group::Parking) && has(Group::Overrides) => Err(Status::ModalGroupTwice),
            () if !has(Group::Modes) => Ok(()),
            () if !self.groups.without(OF_MODES).is_empty() => Err(Status::ModalGroupTwice),
            () if !self.letters.without(N).is_empty() => Err(Status::UnusedWords),
            () => Ok(()),
        }
    }

    /// Returns true if an M code of the line comes first, and the line has other words besides.
    pub(super) fn has_rest(&self, own: OwnCodes<'_>) -> bool {
        if !self.groups.contains(Group::Own) {
            return false;
        }
        own.found().is_some_and(|(code, _)| {
            let words = self.letters.without(Letters::taken_by(code)).without(N);
            code.is_first() && (!words.is_empty() || !self.groups.without(OWN).is_empty())
        })
    }

    /// Returns true if the line has nothing but probing, G4, G10 L1 or L20, tool length and G words
    /// of modes.
    pub(super) fn serves_operator(&self) -> bool {
        let probes = matches!(self.modal.motion, Motion::Probe(_));
        let moves = self.axis_command == AxisCommand::Motion && self.axis_mask != 0;
        let effect = match self.non_modal {
            NonModal::None | NonModal::Dwell => true,
            NonModal::SetOrigin => matches!(self.l.trunc(), 1 | 20),
            NonModal::GoTo(_)
            | NonModal::Store(_)
            | NonModal::MachineCoordinates
            | NonModal::SetG92
            | NonModal::LocalOrigin
            | NonModal::UseG92(_)
            | NonModal::ClearG92 => false,
        };
        effect && (probes || !moves) && !self.groups.have_any(OF_M_CODES)
    }

    fn take_g(&mut self, code: Code, dialect: &Dialect) -> Result<(), Status> {
        if let Some(command) = code.claims(dialect) {
            self.axis_command = self.axis_command.and(command)?;
        }
        let word = code.g(dialect)?;
        self.groups.insert(word.group())?;
        match word {
            GWord::NonModal(command) => self.non_modal = command,
            GWord::Motion(motion) => self.modal.motion = motion,
            GWord::Plane(plane) => self.modal.plane = plane,
            GWord::Distance(distance) => self.take_distance(distance),
            GWord::FeedMode(mode) => self.modal.feed_mode = mode,
            GWord::Retract(retract) => self.modal.retract = retract,
            GWord::Units(units) => self.modal.units = units,
            GWord::System(system) => self.modal.system = system,
            GWord::ToolLength(length) => self.tool_length = length,
            GWord::PathControl(true) => self.groups.insert(Group::Blend)?,
            GWord::ArcDistance | GWord::CutterCompensation | GWord::PathControl(false) => {}
        }
        Ok(())
    }

    fn take_m(&mut self, code: Code, context: &Context<'_, AXES>) -> Result<(), Status> {
        if code.exact().is_some_and(|code| context.own.take(code)) {
            return self.groups.insert(Group::Own);
        }
        if let Some(extrusion) = context.extrusion(code) {
            self.modal.extrusion = Some(extrusion);
            return self.groups.insert(Group::Extrusion);
        }
        let word = code.m(context.dialect)?;
        self.groups.insert(word.group())?;
        match word {
            MWord::Flow(flow) => self.flow = flow,
            MWord::Spindle(rotation) => self.modal.rotation = rotation,
            MWord::Mist => self.modal.coolant.mist = true,
            MWord::Flood => self.modal.coolant.flood = true,
            MWord::CoolantOff => self.modal.coolant = Coolant::OFF,
            MWord::Parking => {}
            MWord::Overrides(code) => self.take_overrides(code)?,
            MWord::Modes(70 | 73) => self.groups.insert(Group::Keep)?,
            MWord::Modes(72) => self.groups.insert(Group::Recall)?,
            MWord::Modes(_) => {}
        }
        Ok(())
    }

    /// M48 and M49 for both overrides, M50 and M51 for one.
    fn take_overrides(&mut self, code: u8) -> Result<(), Status> {
        match code {
            48 => self.groups.insert(Group::AllOverrides),
            49 => self.groups.insert(Group::NoOverrides),
            50 => self.groups.insert(Group::FeedOverride),
            _ => self.groups.insert(Group::SpindleOverride),
        }
    }

    fn take_value(
        &mut self,
        letter: Letter,
        value: Number,
        context: &Context<'_, AXES>,
    ) -> Result<(), Status> {
        match letter {
            Letter::X => *self.axis(0)? = value,
            Letter::Y => *self.axis(1)? = value,
            Letter::Z => *self.axis(2)? = value,
            Letter::A | Letter::B | Letter::C | Letter::E => {
                *self.further_axis(letter, context)? = value;
            }
            Letter::F => self.f = value,
            Letter::S => self.modal.speed = value,
            Letter::T => self.modal.tool = tool_number(value, context.dialect)?,
            _ => *self.rare_slot(letter, context.dialect)? = value,
        }
        self.letters.insert(letter)?;
        if value < Number::default() && MAY_NOT_BE_NEGATIVE.contains(letter) {
            return Err(Status::NegativeValue);
        }
        Ok(())
    }

    /// Notes that an axis has a word and answers the place for its value.
    pub(super) fn axis(&mut self, index: usize) -> Result<&mut Number, Status> {
        let slot = self.axes.get_mut(index).ok_or(Status::UnsupportedCommand)?;
        self.axis_mask |= 1 << index;
        Ok(slot)
    }

    fn rare_slot(&mut self, letter: Letter, dialect: &Dialect) -> Result<&mut Number, Status> {
        let [i, j, k] = &mut self.centre;
        match letter {
            Letter::I => Ok(i),
            Letter::J => Ok(j),
            Letter::K => Ok(k),
            Letter::L => Ok(&mut self.l),
            Letter::H if dialect.tools => Ok(&mut self.h),
            Letter::N => Ok(&mut self.n),
            Letter::P => Ok(&mut self.p),
            Letter::Q if dialect.cycles || dialect.has_linuxcnc() => Ok(i),
            Letter::R => Ok(&mut self.r),
            _ => Err(Status::UnsupportedCommand),
        }
    }
}

/// Groups of M codes.
const OF_M_CODES: Groups = Groups::of(&[
    Group::Flow,
    Group::Spindle,
    Group::Coolant,
    Group::Parking,
    Group::Own,
    Group::Overrides,
    Group::Modes,
]);

/// The groups of M70 to M73.
const OF_MODES: Groups = Groups::of(&[Group::Modes, Group::Keep, Group::Recall]);

const OWN: Groups = Groups::of(&[Group::Own]);
const N: Letters = Letters::of(&[Letter::N]);

/// Groups of M codes that take words; G64.
pub(super) const WITH_WORDS: Groups =
    Groups::of(&[Group::Parking, Group::Own, Group::Overrides, Group::Blend]);

/// Groups of which few lines have one, so that all others need only one question.
pub(super) const RARE: Groups = match cfg!(feature = "linuxcnc") {
    true => Groups::of(&[Group::Own, Group::Overrides, Group::Modes]),
    false => OWN,
};

const MAY_NOT_BE_NEGATIVE: Letters =
    Letters::of(&[Letter::F, Letter::N, Letter::P, Letter::S, Letter::T]);

/// The largest T word: GRBL's is a byte. If tools are changed, a program may have the numbers of
/// its own library.
fn largest_tool(dialect: &Dialect) -> u32 {
    match dialect.tools {
        true => u32::MAX,
        false => 255,
    }
}

/// The whole part of a T word. [`Block::take_value`] refuses a negative one.
fn tool_number(value: Number, dialect: &Dialect) -> Result<u32, Status> {
    if value > whole_number(largest_tool(dialect)) {
        return Err(Status::ToolTooLarge);
    }
    Ok(u32::try_from(value.trunc()).unwrap_or(0))
}

fn whole_number(number: u32) -> Number {
    Number::from_nanos(i64::from(number) * 1_000_000_000)
}
