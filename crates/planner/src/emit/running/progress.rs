//! How far the running move was handed out.

use super::parts::Parts;
use crate::speed::profile::Place;
use leadscrew_stepper::MotorMask;

/// The end of the segments handed out.
///
/// Most step events are handed out as a whole. One that takes long is handed out in spans, and a
/// span in parts (see `parts`).
#[derive(Clone, Debug)]
pub(super) struct Progress<const MOTORS: usize> {
    /// Whole steps of the dominant motor handed out.
    pub(super) done: u32,
    /// The share of the next step event that was handed out in whole spans, 0 to below 1.
    pub(super) way: f32,
    /// The motors that have already been advanced by that step event.
    pub(super) made: MotorMask,
    /// The span that is being handed out in parts.
    pub(super) parts: Option<Parts<MOTORS>>,
}

impl<const MOTORS: usize> Default for Progress<MOTORS> {
    /// The start of a move.
    fn default() -> Self {
        Self {
            done: 0,
            way: 0.0,
            made: MotorMask::NONE,
            parts: None,
        }
    }
}

impl<const MOTORS: usize> Progress<MOTORS> {
    /// The end of the segments handed out. Parts of a span that is not finished do not count.
    pub(super) const fn here(&self) -> Place {
        Place {
            step: self.done,
            part: self.way,
        }
    }

    /// Whether the move has not begun.
    pub(super) fn at_start(&self) -> bool {
        self.done == 0 && self.way <= 0.0
    }

    /// Whether no step event is handed out in part.
    pub(super) fn at_step(&self) -> bool {
        self.parts.is_none() && self.way <= 0.0
    }

    /// The span ends at the share `to` of its step event: the event is over if that is all of it.
    pub(super) fn end_span(&mut self, to: f32) {
        self.parts = None;
        if to < 1.0 {
            self.way = to;
        } else {
            self.way = 0.0;
            self.made = MotorMask::NONE;
            self.done += 1;
        }
    }
}
