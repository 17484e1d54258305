//! Feed, rapid and spindle overrides: factors on the programmed values, in percent.

use crate::protocol::realtime::{OverrideStep, RapidOverride};

/// The overrides in force.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Overrides {
    /// Factor on feed rates, 10 to 200 percent.
    pub feed: u8,
    /// Factor on rapids: 100, 50 or 25 percent.
    pub rapid: u8,
    /// Factor on spindle speed or laser power, 10 to 200 percent.
    pub spindle: u8,
}

impl Overrides {
    /// Everything as programmed.
    pub const NONE: Self = Self {
        feed: 100,
        rapid: 100,
        spindle: 100,
    };

    /// Takes one step of the feed override; returns whether that changed it.
    pub fn step_feed(&mut self, step: OverrideStep) -> bool {
        let next = step.apply(self.feed);
        replace(&mut self.feed, next)
    }

    /// Sets the rapid override; returns whether that changed it.
    pub fn set_rapid(&mut self, rapid: RapidOverride) -> bool {
        replace(&mut self.rapid, rapid.percent())
    }

    /// Takes one step of the spindle override; returns whether that changed it.
    pub fn step_spindle(&mut self, step: OverrideStep) -> bool {
        let next = step.apply(self.spindle);
        replace(&mut self.spindle, next)
    }
}

impl Default for Overrides {
    fn default() -> Self {
        Self::NONE
    }
}

/// Stores `new`; returns whether it differs from the old value.
fn replace(old: &mut u8, new: u8) -> bool {
    let changed = *old != new;
    *old = new;
    changed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_override_that_stays_as_it_is_has_not_changed() {
        let mut overrides = Overrides::NONE;
        assert!(!overrides.step_feed(OverrideStep::Reset));
        assert!(!overrides.set_rapid(RapidOverride::Full));
        assert!(overrides.set_rapid(RapidOverride::Quarter));
        assert!(overrides.step_spindle(OverrideStep::CoarseUp));
        assert_eq!((overrides.rapid, overrides.spindle), (25, 110));
    }
}
