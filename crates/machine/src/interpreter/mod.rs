//! Lines of G-code to canonical commands.
//!
//! ```text
//!  line --words--> Block --check--> Plan --commit--> Commands
//!                    |                |                 |
//!             1, 2, 4, 20…25, 38   20, 22, 26…37    nothing can fail: modal state, offsets, position change
//! ```
//!
//! Read first: Kramer, Proctor, Messina, "The NIST RS274/NGC Interpreter, Version 3" (NISTIR 6556). Which of its words
//! exist, and which fault of a line is reported, is GRBL 1.1h's.
//!
//! Everything is checked before anything changes: a line is carried out wholly or not at all. The first fault from the
//! left is reported while words are read, then the first in the order of [`check`].

mod arc;
mod check;
mod code;
mod command;
mod commit;
mod context;
mod cycle;
mod fault;
mod jog;
mod letters;
mod modal_state;
mod offsets;
mod print;
mod takers;
mod units;
mod words;

pub use command::{
    ArcShape, Command, Commands, Feed, Jog, OffsetId, Spindle, Travel, MAX_COMMANDS,
};
pub use context::{Context, Own, OwnCodes};
pub use cycle::{Cycle, CycleKind, Strokes};
pub use fault::Fault;
pub use leadscrew_planner::Coordinate;
pub use modal_state::{
    Coolant, Distance, FeedMode, ModalState, Motion, Plane, ProbeKind, Retract, Rotation, Turn,
    Units, WorkSystem,
};
pub use offsets::Offsets;
pub use units::MAX_WORD;

use check::{Check, Plan, Purpose};
use cycle::series::Series;
use words::Block;

/// What G-code leaves from line to line: modal state, offsets, and where the program has got to.
///
/// Its position runs ahead of the machine: it is where the last command ends, exactly, however it was rounded to steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpreter<const AXES: usize> {
    modal: ModalState,
    offsets: Offsets<AXES>,
    /// `offsets.work_offset(modal.system)`, which every line needs.
    work_offset: [Coordinate; AXES],
    position: [Coordinate; AXES],
    /// The series of cycles under way: `None` in other motion modes.
    series: Option<Series>,
}

impl<const AXES: usize> Interpreter<AXES> {
    /// Makes an interpreter as at power-up, at the machine's origin and without offsets.
    pub fn new() -> Self {
        Self {
            modal: ModalState::default(),
            offsets: Offsets::new(),
            work_offset: [Coordinate::ZERO; AXES],
            position: [Coordinate::ZERO; AXES],
            series: None,
        }
    }

    /// Takes an offset from the store. Main loop, at boot and after `$RST`.
    pub fn load_offset(&mut self, id: OffsetId, value: [Coordinate; AXES]) {
        self.offsets.set(id, value);
        self.work_offset = self.offsets.work_offset(self.modal.system);
    }

    /// Reads a line, checks all of it, and carries it out: puts its commands in place of what is in `commands`.
    ///
    /// `line` comes without blanks, comments and line end, in capitals. Main loop; bounded by the line's length.
    ///
    /// # Errors
    ///
    /// The first fault in GRBL's order. Then nothing has changed, and there are no commands.
    #[inline]
    pub fn interpret(
        &mut self,
        line: &[u8],
        context: &Context<'_, AXES>,
        commands: &mut Commands<AXES>,
    ) -> Result<(), Fault> {
        commands.clear();
        let mut block = Block::new(&self.modal);
        block.read(line, context, &self.modal)?;
        let mut plan = Plan::new(&self.position);
        self.plan(&mut plan, &block, line, context)?;
        self.commit(&block, &plan, context, commands);
        Ok(())
    }

    /// Checks a line as [`Self::interpret`] would, and changes nothing. For startup lines when they are stored.
    ///
    /// # Errors
    ///
    /// As [`Self::interpret`].
    pub fn check(&self, line: &[u8], context: &Context<'_, AXES>) -> Result<(), Fault> {
        let mut block = Block::new(&self.modal);
        block.read(line, context, &self.modal)?;
        self.plan(&mut Plan::new(&self.position), &block, line, context)
    }

    /// Answers the modal state.
    pub fn modal(&self) -> &ModalState {
        &self.modal
    }

    /// Notes what the valves are set to, by whatever: `$G` follows.
    pub fn set_coolant(&mut self, coolant: Coolant) {
        self.modal.coolant = coolant;
    }

    /// Notes that the spindle was switched off by something else than a line: M5.
    pub fn stop_spindle(&mut self) {
        self.modal.rotation = Rotation::Off;
    }

    /// Answers the offsets.
    pub fn offsets(&self) -> &Offsets<AXES> {
        &self.offsets
    }

    /// Answers the work offset for the next line. Reports show that of [`Command::WorkOffset`], which may be behind.
    pub fn work_offset(&self) -> &[Coordinate; AXES] {
        &self.work_offset
    }

    /// Answers where the last command ends, machine coordinates.
    pub fn position(&self) -> &[Coordinate; AXES] {
        &self.position
    }

    /// Sets where the next line begins: after a jog was accepted, and wherever motion ended early (reset, homing,
    /// probing, jog cancel).
    pub fn set_position(&mut self, position: [Coordinate; AXES]) {
        self.position = position;
    }

    /// Forgets what a soft reset forgets: modal state, G92, tool length. The position stays.
    pub fn reset(&mut self) {
        self.modal = ModalState::default();
        self.offsets.reset();
        self.series = None;
        self.work_offset = self.offsets.work_offset(self.modal.system);
    }

    #[inline]
    fn plan(
        &self,
        plan: &mut Plan<AXES>,
        block: &Block<AXES>,
        line: &[u8],
        context: &Context<'_, AXES>,
    ) -> Result<(), Fault> {
        Check::new(self, block, context, Purpose::Program)
            .plan(plan)
            .map_err(|refusal| refusal.locate(line))
    }
}

impl<const AXES: usize> Default for Interpreter<AXES> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests;
