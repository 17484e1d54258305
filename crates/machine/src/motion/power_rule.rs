//! The power that goes out with a segment.

use fixed::types::U1F31;
use leadscrew_stepper::{Power, PowerChange, Segment};

/// The rule for the power that goes out. It turns the power that a segment was planned with into
/// the power of the committed segment. The spindle override acts here.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum PowerRule {
    /// A spindle: this power in motion and at rest, whatever the moves were planned with.
    Spindle(Power),
    /// A laser: the power of the moves, in percent of full power.
    Laser {
        /// The spindle override.
        percent: u8,
    },
}

impl PowerRule {
    /// Puts the rule into effect.
    pub(super) fn apply<const MOTORS: usize>(self, segment: &mut Segment<MOTORS>) {
        match self {
            Self::Spindle(power) => {
                segment.power = power;
                segment.power_change = PowerChange::ZERO;
                segment.at_rest = segment.at_rest.map(|_| power);
            }
            Self::Laser { percent: 100 } => {}
            Self::Laser { percent } => {
                segment.power = scaled(segment.power, percent);
                segment.at_rest = segment.at_rest.map(|power| scaled(power, percent));
                let change = i64::from(segment.power_change.to_bits()) * i64::from(percent) / 100;
                let limit = i64::from(i32::MAX);
                let change = change.clamp(-limit, limit) as i32;
                segment.power_change = PowerChange::from_bits(change);
            }
        }
    }
}

/// `percent` of `power`, full power at most.
fn scaled(power: Power, percent: u8) -> Power {
    let bits = u64::from(power.share().to_bits()) * u64::from(percent) / 100;
    Power::from_share(U1F31::from_bits(u32::try_from(bits).unwrap_or(u32::MAX)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_stepper::PowerScale;

    #[test]
    fn the_override_scales_power_up_to_full() {
        let half = scaled(Power::FULL, 50);
        assert_eq!(half.level(PowerScale::new(1000)), 500);
        assert_eq!(scaled(half, 150).level(PowerScale::new(1000)), 750);
        assert_eq!(scaled(half, 200), Power::FULL);
        assert_eq!(scaled(Power::FULL, 200), Power::FULL);
    }
}
