//! Says which status report carries the work offset, which the overrides.
//!
//! Both change seldom, and senders keep the last values that they saw. So each comes only now and
//! then:
//!
//! - The work offset comes in the first report after a reset or a change, and then in every 10th
//!   (every 30th while busy).
//! - The overrides come in the second report after a reset, in the next one after a change, and
//!   then in every 10th (every 20th while busy).
//!
//! No report carries both: the work offset goes first.

/// The occasional fields of a status report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Extra {
    /// Nothing.
    None,
    /// `WCO:`.
    WorkOffset,
    /// `Ov:`, and `A:` if anything is on.
    Overrides,
}

/// The work offset comes in every n-th report. The two values of n: at rest, and while busy.
const WORK_OFFSET_EVERY: (u8, u8) = (10, 30);
/// The overrides come in every n-th report. The two values of n: at rest, and while busy.
const OVERRIDES_EVERY: (u8, u8) = (10, 20);

/// The number of reports that go before the next one with each occasional field; 0: the field is
/// due.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Cadence {
    work_offset: u8,
    overrides: u8,
}

impl Cadence {
    /// Begins afresh, as after power-up and reset.
    pub const fn new() -> Self {
        Self {
            work_offset: 0,
            overrides: 0,
        }
    }

    /// Makes the work offset due: it changed, or the unit of reports did.
    pub fn work_offset_changed(&mut self) {
        self.work_offset = 0;
    }

    /// Makes the overrides due: one of them, the spindle or the coolant changed.
    pub fn overrides_changed(&mut self) {
        self.overrides = 0;
    }

    /// Returns the occasional fields of the next report. `busy`: running, jogging, held, homing or
    /// with an open door.
    pub fn next(&mut self, busy: bool) -> Extra {
        let every = |(rest, moving)| if busy { moving } else { rest };
        let extra = if self.work_offset == 0 {
            self.work_offset = every(WORK_OFFSET_EVERY);
            Extra::WorkOffset
        } else if self.overrides == 0 {
            self.overrides = every(OVERRIDES_EVERY);
            Extra::Overrides
        } else {
            Extra::None
        };
        self.work_offset = self.work_offset.saturating_sub(1);
        self.overrides = self.overrides.saturating_sub(1);
        extra
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// The reports, counted from 1, that carry `extra`.
    fn reports_with(extra: Extra, busy: bool, count: usize) -> Vec<usize> {
        let mut cadence = Cadence::new();
        (1..=count)
            .filter(|_| cadence.next(busy) == extra)
            .collect()
    }

    /// As in the recording `status_cadence_run`.
    #[test]
    fn while_busy_the_work_offset_comes_every_30th_and_the_overrides_every_20th_time() {
        assert_eq!(reports_with(Extra::WorkOffset, true, 66), [1, 31, 61]);
        assert_eq!(reports_with(Extra::Overrides, true, 66), [2, 22, 42, 62]);
    }

    #[test]
    fn at_rest_both_come_every_10th_time() {
        assert_eq!(reports_with(Extra::WorkOffset, false, 25), [1, 11, 21]);
        assert_eq!(reports_with(Extra::Overrides, false, 25), [2, 12, 22]);
    }

    #[test]
    fn changes_are_told_at_once_and_the_work_offset_first() {
        let mut cadence = Cadence::new();
        for _ in 0..5 {
            cadence.next(false);
        }
        cadence.overrides_changed();
        cadence.work_offset_changed();
        let extras = [(); 3].map(|()| cadence.next(false));
        assert_eq!(extras, [Extra::WorkOffset, Extra::Overrides, Extra::None]);
    }
}
