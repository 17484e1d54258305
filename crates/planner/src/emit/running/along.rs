//! What goes along with the running move: power, outputs and line numbers.

use crate::config::SLOWEST;
use crate::emit::pixel::Pixel;
use crate::moves::{MovePower, PlannedMove};
use crate::real::max;
use core::num::NonZeroU16;
use fixed::types::U1F31;
use leadscrew_stepper::{OutputChange, Power, PowerChange};

/// Power, outputs and line number of the next segment, and the changes of power that follow in the
/// move.
#[derive(Clone, Debug)]
pub(super) struct Along {
    power: MovePower,
    /// 1 / programmed feed, s/step.
    per_feed: f32,
    line_number: Option<u32>,
    /// Outputs that change with the first segment, until that is handed out.
    outputs: OutputChange,
    /// How many changes of power the pool still holds for this move.
    pixels: u16,
    /// The next change of power, and the step at which it comes.
    next_pixel: Option<(u32, Pixel)>,
}

impl Along {
    /// The start of `planned`, which has `steps_per_mm` of the dominant motor.
    pub(super) fn new<const AXES: usize, const MOTORS: usize>(
        planned: &PlannedMove<AXES, MOTORS>,
        steps_per_mm: f32,
    ) -> Self {
        Self {
            power: planned.power,
            per_feed: 1.0 / (max(planned.feed, SLOWEST) * steps_per_mm),
            line_number: planned.line_number(),
            outputs: planned.outputs,
            pixels: planned.pixels,
            next_pixel: None,
        }
    }

    /// If the next pixel begins at the step `done`, takes its power and asks `next` for the pixel
    /// after it.
    pub(super) fn begin_pixel(&mut self, done: u32, mut next: impl FnMut() -> Option<Pixel>) {
        if let Some((_, pixel)) = self.next_pixel.take_if(|(at, _)| *at <= done) {
            self.power = self.power.with(pixel.power);
            self.line_number = pixel.line_number;
        }
        if self.next_pixel.is_none() && self.pixels > 0 {
            self.pixels -= 1;
            self.next_pixel = next().map(|pixel| (done + pixel.after, pixel));
        }
    }

    /// The line number of the pixel under way, or of the move.
    pub(super) const fn line_number(&self) -> Option<u32> {
        self.line_number
    }

    /// Steps from the step `done` to the next pixel; without end if there is none.
    pub(super) fn to_next_pixel(&self, done: u32) -> u32 {
        self.next_pixel.map_or(u32::MAX, |(at, _)| at - done)
    }

    /// The outputs that change with the next segment: with the first one only.
    pub(super) fn take_outputs(&mut self) -> OutputChange {
        core::mem::take(&mut self.outputs)
    }

    /// The power that the program asks for.
    pub(super) const fn power(&self) -> MovePower {
        self.power
    }

    /// The power of the first tick and its change from tick to tick, where the program asks for
    /// `power`. `speeds` are those in the first and in the last tick, steps/s.
    pub(super) fn power_over(
        &self,
        power: MovePower,
        speeds: [f32; 2],
        ticks: NonZeroU16,
    ) -> (Power, PowerChange) {
        match power {
            MovePower::Off => (Power::OFF, PowerChange::ZERO),
            MovePower::Spindle { power } | MovePower::Constant { power } => {
                (power, PowerChange::ZERO)
            }
            MovePower::Dynamic { power } => {
                let full = power.share().to_bits() as f32 * self.per_feed;
                let [first, last] = speeds.map(|speed| share(full * speed));
                let changes = i32::from(ticks.get() - 1).max(1);
                let change = (last as i32 - first as i32) / changes;
                (
                    Power::from_share(U1F31::from_bits(first)),
                    PowerChange::from_bits(change),
                )
            }
        }
    }
}

/// Full power in units of [`Power`].
const FULL: u32 = 1 << 31;

/// The bits of a power, at most full power.
fn share(bits: f32) -> u32 {
    (bits as u32).min(FULL - 1)
}
