//! The request for a profile, places in it, and stretches of it.

/// A place in a move: steps of the dominant motor from its start, in units of 2⁻³² steps.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Place(u64);

/// A unit of [`Place`], steps.
const UNIT: f32 = 1.0 / 4_294_967_296.0;

impl Place {
    /// Makes the place of a whole step.
    pub const fn at(step: u32) -> Self {
        Self((step as u64) << 32)
    }

    /// Makes the place of so many units.
    pub(crate) const fn of(units: u64) -> Self {
        Self(units)
    }

    /// Returns the whole steps from the move's start.
    pub const fn step(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// Units from the move's start.
    pub const fn units(self) -> u64 {
        self.0
    }

    /// The share of the step under way that is done, rounded down: 0 to below 1.
    pub(crate) const fn part(self) -> f32 {
        (self.0 as u32 & !0xFF) as f32 * UNIT
    }

    /// Returns true if it is a whole step.
    pub(crate) const fn is_whole(self) -> bool {
        self.0 as u32 == 0
    }

    /// The place `steps` after this one; `steps` is at least 0.
    #[inline(never)] // this and the next inlined, a record of four motors takes 1024 bytes more
    pub(crate) const fn moved(self, steps: f32) -> Self {
        let whole = steps as u32;
        let part = ((steps - whole as f32) / UNIT) as u32;
        Self(self.0.saturating_add(((whole as u64) << 32) | part as u64))
    }

    /// Steps from `start` to here, which is not before it.
    #[inline(never)]
    pub(crate) const fn after(self, start: Self) -> f32 {
        let units = self.0.saturating_sub(start.0);
        (units >> 32) as u32 as f32 + units as u32 as f32 * UNIT
    }

    /// Steps from here to the whole step `end`, which is not before it.
    pub(crate) const fn before(self, end: u32) -> f32 {
        Self::at(end).after(self)
    }

    /// As [`Place::before`], exactly.
    #[cfg(test)]
    pub(crate) fn exact_before(self, end: u32) -> f64 {
        (Self::at(end).0 - self.0) as f64 * f64::from(UNIT)
    }
}

/// The input of a profile: steps of the dominant motor, steps/s, steps/s².
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Plan {
    /// Place at which the profile begins.
    pub start: Place,
    /// Step at which it ends in this move, after `start`.
    pub end: u32,
    /// Squared speed at the start.
    pub entry_v2: f32,
    /// Speed to cruise at, above 0.
    pub cruise: f32,
    /// Squared speed wanted at the end. It is higher if the distance does not suffice to brake,
    /// lower if it does not suffice to accelerate.
    pub exit_v2: f32,
    /// Acceleration while the speed rises, above 0.
    pub up: f32,
    /// Acceleration while it falls, above 0.
    pub down: f32,
}

/// A stretch of a profile in which the acceleration does not change. The segmenter cuts a move at
/// its ends.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Stretch {
    /// Whole steps that are left of it; 0 if it ends within the next step.
    pub(crate) steps: u32,
    /// Acceleration in it, steps/s², negative if it slows down.
    pub(crate) acceleration: f32,
}
