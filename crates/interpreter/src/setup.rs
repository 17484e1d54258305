//! The state that one line leaves to the next.

use super::command::OffsetId;
use super::cycle::series::Series;
use super::decimals::Decimals;
use super::modal_state::{Coolant, ModalState, OverrideControl, Rotation};
use super::offsets::Offsets;
use core::cell::Cell;
use leadscrew_planner::Coordinate;

/// The state that G-code leaves from line to line: modes, offsets, and where the program has got
/// to.
///
/// Its position runs ahead of the machine: it is the exact end of the last command,
/// before any rounding to steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpreter<const AXES: usize> {
    pub(super) modal: ModalState,
    /// The overrides that M48 to M51 let act.
    pub(super) overrides: OverrideControl,
    /// The state that M70 has kept for M72.
    pub(super) kept: Option<(ModalState, OverrideControl)>,
    pub(super) offsets: Offsets<AXES>,
    /// `offsets.work_offset(modal.system)`, which every line needs.
    pub(super) work_offset: [Coordinate; AXES],
    pub(super) position: [Coordinate; AXES],
    /// The series of cycles under way: `None` in other motion modes.
    pub(super) series: Option<Series>,
    /// The decimals of the program.
    pub(super) decimals: Decimals,
    /// The length that the last refused arc lacked.
    pub(super) apart: Apart,
}

/// The length that a refused arc lacked. It is said, and changes nothing: two states that differ in
/// it are the same.
#[derive(Debug, Clone, Default)]
pub(super) struct Apart(Cell<Coordinate>);

impl Apart {
    pub(super) fn note(&self, apart: Coordinate) {
        self.0.set(apart);
    }
}

impl PartialEq for Apart {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl<const AXES: usize> Interpreter<AXES> {
    /// Makes an interpreter as at power-up, at the machine's origin and without offsets.
    pub fn new() -> Self {
        Self {
            modal: ModalState::default(),
            overrides: OverrideControl::ALL,
            kept: None,
            offsets: Offsets::new(),
            work_offset: [Coordinate::ZERO; AXES],
            position: [Coordinate::ZERO; AXES],
            series: None,
            decimals: Decimals::UNKNOWN,
            apart: Apart::default(),
        }
    }

    /// Takes an offset from the store. Main loop, at boot and after `$RST`.
    pub fn load_offset(&mut self, id: OffsetId, value: [Coordinate; AXES]) {
        self.offsets.set(id, value);
        self.work_offset = self.offsets.work_offset(self.modal.system);
    }

    /// Takes how much farther from its centre one end of an arc was than the other, mm, if an arc
    /// was refused for that.
    pub fn take_mismatch(&self) -> Option<Coordinate> {
        Some(self.apart.0.take()).filter(|apart| *apart > Coordinate::ZERO)
    }

    /// Returns the modal state.
    pub fn modal(&self) -> &ModalState {
        &self.modal
    }

    /// Notes the state of the valves, set by the program or the operator, so that `$G` shows it.
    pub fn set_coolant(&mut self, coolant: Coolant) {
        self.modal.coolant = coolant;
    }

    /// Notes that the spindle was switched off without a line, as if by M5.
    pub fn stop_spindle(&mut self) {
        self.modal.rotation = Rotation::Off;
    }

    /// Returns the offsets.
    pub fn offsets(&self) -> &Offsets<AXES> {
        &self.offsets
    }

    /// Returns the work offset for the next line. Reports show the offset of the last
    /// [`Command::WorkOffset`](super::Command::WorkOffset) that was carried out, which may be an
    /// older one.
    pub fn work_offset(&self) -> &[Coordinate; AXES] {
        &self.work_offset
    }

    /// Returns the end of the last command, machine coordinates.
    pub fn position(&self) -> &[Coordinate; AXES] {
        &self.position
    }

    /// Returns how far the rounding of the program's numbers may have moved the end of the last
    /// motion on each axis, mm.
    pub fn rounding(&self) -> f32 {
        self.decimals.rounding(self.modal.units)
    }

    /// Sets where the next line begins: after a jog was accepted, and wherever motion ended early
    /// (reset, homing, probing, jog cancel).
    pub fn set_position(&mut self, position: [Coordinate; AXES]) {
        self.position = position;
    }

    /// Puts the modes `modal` in force again. Offsets stay, the tool length among them.
    pub fn restore_modes(&mut self, modal: &ModalState) {
        self.modal = *modal;
        self.work_offset = self.offsets.work_offset(self.modal.system);
    }

    /// Forgets as a soft reset does: modal state, kept modes, G92, tool length. The position stays.
    pub fn reset(&mut self) {
        self.modal = ModalState::default();
        self.overrides = OverrideControl::ALL;
        self.kept = None;
        self.offsets.reset();
        self.series = None;
        self.decimals = Decimals::UNKNOWN;
        self.work_offset = self.offsets.work_offset(self.modal.system);
    }
}

impl<const AXES: usize> Default for Interpreter<AXES> {
    fn default() -> Self {
        Self::new()
    }
}
