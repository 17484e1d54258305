//! Keys that contradict others: the order of homing, the depths of drilling.

use super::Profile;

/// The axes of a mask, in the order of its bits.
const MASK: &str = "XYZABCE";

/// The most cycles of homing.
const MOST_CYCLES: usize = 4;

impl Profile {
    /// A wrong `homing.order`, and the expected value.
    pub(super) fn contradiction_of_order(&self) -> Option<(&'static str, &'static str)> {
        let order = self.homing.order.iter().flatten();
        let letters = self.letters();
        let there = MASK.chars().enumerate().fold(0, |all, (bit, letter)| {
            all | u8::from(letters.contains(&letter)) << bit
        });
        let (mut seen, mut is_doubled) = (0, false);
        for cycle in order.clone() {
            is_doubled |= seen & cycle.0 != 0;
            seen |= cycle.0;
        }
        let expected = if seen & !there != 0 {
            "expected axes that the machine has in `order`"
        } else if is_doubled {
            "expected each axis once in `order`"
        } else if order.count() > MOST_CYCLES {
            "expected four cycles at most in `order`"
        } else {
            return None;
        };
        Some(("homing", expected))
    }

    /// A wrong depth of drilling, and the expected value.
    pub(super) fn contradiction_of_drill(&self) -> Option<(&'static str, &'static str)> {
        let depth = self.drill.depth_mm?;
        let expected = if depth.mm() >= 0.0 {
            "expected `depth_mm` below 0"
        } else if self
            .drill
            .clearance_mm
            .is_some_and(|clearance| depth >= clearance)
        {
            "expected `depth_mm` below `clearance_mm`"
        } else {
            return None;
        };
        Some(("drill", expected))
    }
}
