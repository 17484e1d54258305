//! G10 and G92 need axis words (error 26), for G10 P or L (28), a system that exists (29), and the
//! right L (20).

use super::{pick, storable, Check, Effect, L, P, R};
use crate::command::OffsetId;
use crate::fault::Refusal;
use crate::modal_state::WorkSystem;
use crate::offsets::TOOL_AXIS;
use crate::Coordinate;
use crate::Status;

impl<const AXES: usize> Check<'_, AXES> {
    /// G10 L2 (the words are the origin) and L20 (the words are where the axes shall be).
    pub(super) fn set_origin(
        &mut self,
        tool_length: Option<Coordinate>,
    ) -> Result<Effect<AXES>, Refusal> {
        let fault = |status| Refusal::g(status, 10);
        if self.block.axis_mask == 0 {
            return Err(fault(Status::NoAxisWords));
        }
        if !self.gives(P) && !self.gives(L) {
            return Err(fault(Status::MissingWord));
        }
        let l = self.block.l.trunc();
        if matches!(l, 1 | 10 | 11) && self.gives(L) && self.context.dialect.tools {
            return self.set_tool(l);
        }
        let system = self.named_system()?;
        let others = match self.block.l.trunc() {
            2 if !self.gives(R) => None,
            20 => Some(self.state.offsets.without_system(tool_length)),
            _ => return Err(Refusal::words(Status::UnsupportedCommand, L)),
        };
        self.unused = self.unused.without(P).without(L);
        let old = self.state.offsets.get(OffsetId::Work(system));
        let origin = match others {
            None => self.merge(old, |_, word| word)?,
            Some(others) => self.merge(old, |axis, word| self.shift(&others, axis, word))?,
        };
        Ok(Effect::SetOrigin(system, origin))
    }

    /// The length of tool P. G10 L1: the word; G10 L10: with it the axis stands at the word now; G10
    /// L11: the same in G59.3 without G92.
    fn set_tool(&mut self, l: i64) -> Result<Effect<AXES>, Refusal> {
        if self.block.axis_mask != 1 << TOOL_AXIS {
            return Err(Refusal::g(Status::ToolLengthAxis, 10));
        }
        let tool = u32::try_from(self.block.p.trunc()).unwrap_or(u32::MAX);
        if tool == 0 || self.context.tools.length(Some(tool)).is_none() {
            return Err(Refusal::words(Status::NoSuchTool, P));
        }
        self.unused = self.unused.without(P).without(L);
        let none = Some(Coordinate::ZERO);
        let offsets = &self.state.offsets;
        let word = self.word(TOOL_AXIS);
        let length = match l {
            1 => word,
            10 => {
                let others = offsets.work_offset_with(self.block.modal.system, none);
                self.shift(&others, TOOL_AXIS, word)
            }
            _ => {
                let others = offsets.without_g92(WorkSystem::G59_3, none);
                self.shift(&others, TOOL_AXIS, word)
            }
        };
        let length = storable(TOOL_AXIS, length)?;
        Ok(Effect::SetTool(tool, length))
    }

    /// The system that P names; the one in force if it is 0 or missing.
    fn named_system(&self) -> Result<WorkSystem, Refusal> {
        let there = match self.context.dialect.has_linuxcnc() {
            true => WorkSystem::ALL.len(),
            false => WorkSystem::GRBL,
        };
        match usize::try_from(self.block.p.trunc()) {
            Ok(0) => Some(self.block.modal.system),
            Ok(number) if number <= there => WorkSystem::ALL.get(number - 1).copied(),
            Ok(_) => None,
            Err(_) => None,
        }
        .ok_or(Refusal::words(Status::UnsupportedSystem, P))
    }

    /// G52: the words are the offset.
    pub(super) fn set_local_origin(&self) -> Result<Effect<AXES>, Refusal> {
        if !cfg!(feature = "linuxcnc") {
            return Ok(Effect::None);
        }
        if self.block.axis_mask == 0 {
            return Err(Refusal::g(Status::NoAxisWords, 52));
        }
        let offset = self.merge(self.state.offsets.g92(), |_, word| word)?;
        Ok(Effect::SetG92(offset))
    }

    pub(super) fn set_g92(&self, tool_length: Option<Coordinate>) -> Result<Effect<AXES>, Refusal> {
        if self.block.axis_mask == 0 {
            return Err(Refusal::g(Status::NoAxisWords, 92));
        }
        let offsets = &self.state.offsets;
        let others = offsets.without_g92(self.block.modal.system, tool_length);
        let offset = self.merge(offsets.g92(), |axis, word| self.shift(&others, axis, word))?;
        Ok(Effect::SetG92(offset))
    }

    /// The offset that, with the others, makes the present position read as `word`.
    fn shift(&self, others: &[Coordinate; AXES], axis: usize, word: Coordinate) -> Coordinate {
        pick(&self.state.position, axis) - pick(others, axis) - word
    }

    /// The old offsets, with new ones on axes that have a word. One beyond
    /// [`MAX_WORD`](crate::MAX_WORD) is refused.
    fn merge(
        &self,
        old: &[Coordinate; AXES],
        new: impl Fn(usize, Coordinate) -> Coordinate,
    ) -> Result<[Coordinate; AXES], Refusal> {
        let mut merged = *old;
        for (axis, merged) in merged.iter_mut().enumerate() {
            if self.moves(axis) {
                *merged = storable(axis, new(axis, self.word(axis)))?;
            }
        }
        Ok(merged)
    }
}
