//! Digital outputs that change in step with the motion.

/// A change of up to eight digital outputs, one bit each. An output in neither mask stays as it is.
///
/// An output that M64 switches at once while this change waits keeps its level, unless this change
/// names the output.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OutputChange {
    /// The outputs that go on.
    pub set: u8,
    /// The outputs that go off. None of them is in `set`.
    pub clear: u8,
}

impl OutputChange {
    /// All outputs stay as they are.
    pub const NONE: Self = Self { set: 0, clear: 0 };

    /// Makes a change by which output `index`, 0 to 7, goes on or off; a larger index changes
    /// nothing.
    pub const fn of(index: u8, on: bool) -> Self {
        let bit = if index < 8 { 1 << index } else { 0 };
        match on {
            true => Self { set: bit, clear: 0 },
            false => Self { set: 0, clear: bit },
        }
    }

    /// Returns true if all outputs stay as they are.
    pub const fn is_none(self) -> bool {
        self.set | self.clear == 0
    }

    /// This change, then `later`.
    #[must_use]
    pub const fn then(self, later: Self) -> Self {
        Self {
            set: self.set & !later.clear | later.set,
            clear: self.clear & !later.set | later.clear,
        }
    }

    /// Returns the levels after this change, if they were `levels`.
    pub const fn applied_to(self, levels: u8) -> u8 {
        levels & !self.clear | self.set
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn an_output_beyond_the_eighth_changes_nothing() {
        assert_eq!(OutputChange::of(8, true), OutputChange::NONE);
        assert_eq!(OutputChange::of(2, true).applied_to(0b1), 0b101);
        assert_eq!(OutputChange::of(0, false).applied_to(0b101), 0b100);
    }

    proptest! {
        /// Two changes made into one have the same effect on any levels as one after the other.
        #[test]
        fn a_change_and_a_later_one_are_one_change(levels: u8, changes in prop::collection::vec((0u8..8, any::<bool>()), 0..12)) {
            let changes = changes.iter().map(|(index, on)| OutputChange::of(*index, *on));
            let one_by_one = changes.clone().fold(levels, |levels, change| change.applied_to(levels));
            let at_once = changes.fold(OutputChange::NONE, OutputChange::then);
            prop_assert_eq!(at_once.applied_to(levels), one_by_one);
            prop_assert_eq!(at_once.set & at_once.clear, 0);
        }
    }
}
