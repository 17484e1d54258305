//! From `S` to a share of full power.
//!
//! ```text
//!   power
//!     1 |            ______      S0 is off. Up to $31: the least power that is not off.
//!       |          /             From $31 to $30: in proportion. If $30 is not above $31,
//!       |        /               any S above 0 is full power.
//!   min |__----/
//!     0 +------+-----+---- S
//!             $31   $30
//! ```

use fixed::types::U1F31;
use leadscrew_stepper::Power;

/// The least power that is not off: one of the 255 levels of Grbl's output.
const LEAST_SHARE: f32 = 1.0 / 255.0;

/// The mapping of `S` to power: settings `$30` and `$31`.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SpindleScale {
    /// Speed at full power (`$30`), RPM.
    pub max: f32,
    /// Speed at the least power (`$31`), RPM.
    pub min: f32,
}

impl SpindleScale {
    /// Returns the power for a speed in RPM: 0 to 1, rounded down to 2⁻²⁴ or better.
    pub fn power(&self, speed: f32) -> Power {
        if speed <= 0.0 {
            return Power::OFF;
        }
        if self.max <= self.min || speed >= self.max {
            return Power::FULL;
        }
        share((speed - self.min) / (self.max - self.min))
    }

    /// Limits a speed, RPM: no less than `$31`, unless it is 0, and no more than `$30`. With `$30=0`
    /// any speed is 1: it is full power, which reports must not show as off.
    pub fn within(&self, speed: f32) -> f32 {
        if speed <= 0.0 {
            0.0
        } else {
            seen(speed.max(self.min).min(self.max))
        }
    }

    /// Returns the speed in RPM that goes with a power: the inverse of [`SpindleScale::power`].
    pub fn speed(&self, power: Power) -> f32 {
        if power == Power::OFF {
            0.0
        } else {
            seen(self.min + (self.max - self.min) * power.share().to_num::<f32>())
        }
    }
}

/// A speed of an output that is on: 1 in place of 0.
fn seen(speed: f32) -> f32 {
    if speed > 0.0 {
        speed
    } else {
        1.0
    }
}

fn share(share: f32) -> Power {
    let share = share.clamp(LEAST_SHARE, 1.0);
    // 2³¹ is exact in f32 and the product at most 2³¹: the cast rounds down.
    Power::from_share(U1F31::from_bits((share * 2_147_483_648.0) as u32))
}
