//! The request for a profile, places in it, and stretches of it: the same for either law of speed.

/// A place in a move: whole steps of the dominant motor from its start, and the part of the next
/// one.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Place {
    /// Whole steps.
    pub step: u32,
    /// Part of the next step, from 0 to below 1.
    pub part: f32,
}

impl Place {
    /// Makes the place of a whole step.
    pub const fn at(step: u32) -> Self {
        Self { step, part: 0.0 }
    }

    /// Steps from `start` to here, which is not before it.
    pub(crate) fn after(self, start: Self) -> f32 {
        self.step.saturating_sub(start.step) as f32 + (self.part - start.part)
    }

    /// Steps from here to the whole step `end`, which is not before it.
    pub(crate) fn before(self, end: u32) -> f32 {
        end.saturating_sub(self.step) as f32 - self.part
    }
}

/// The input of a profile: steps of the dominant motor, steps/s, steps/s².
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Plan {
    /// Place at which the profile begins.
    pub start: Place,
    /// Step at which it ends in this move, after `start`.
    pub end: u32,
    /// Steps that it goes on in later moves, under a jerk limit; 0 for a trapezoid.
    pub beyond: f32,
    /// Squared speed at the start.
    pub entry_v2: f32,
    /// Speed to cruise at, above 0.
    pub cruise: f32,
    /// Squared speed wanted at the end. It is higher where the distance does not suffice to brake,
    /// lower where it does not suffice to accelerate.
    pub exit_v2: f32,
    /// Acceleration where the speed rises, above 0.
    pub up: f32,
    /// Acceleration where it falls, above 0.
    pub down: f32,
}

/// A stretch of a profile in which the acceleration does not change. The segmenter cuts a move at
/// its ends.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Stretch {
    /// Whole steps that are left of it; 0 where it ends within the next step.
    pub(crate) steps: u32,
    /// Acceleration in it, steps/s², negative where it slows down.
    pub(crate) acceleration: f32,
}
