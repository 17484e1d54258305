//! Offsets that changed and are not in the store yet.
//!
//! Writing flash may stop the CPU for a while: it waits until the machine is at rest.

use crate::interpreter::OffsetId;

/// A set of offsets.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Unsaved(u8);

impl Unsaved {
    /// Adds an offset to the set.
    pub(crate) fn add(&mut self, id: OffsetId) {
        for (bit, offset) in OffsetId::ALL.iter().enumerate() {
            self.0 |= u8::from(*offset == id) << bit;
        }
    }

    /// Takes an offset out of the set.
    pub(crate) fn take(&mut self) -> Option<OffsetId> {
        let bit = self.0.trailing_zeros() as usize;
        let id = OffsetId::ALL.get(bit).copied()?;
        self.0 &= self.0 - 1;
        Some(id)
    }
}
