//! Step smoothing: more ticks than steps where steps are slow.

/// The finest step smoothing: `2^4` ticks to a step of the dominant motor.
pub const MAX_SMOOTHING_LEVEL: u32 = 4;

/// Step smoothing: `2^level` ticks to a step of the dominant motor.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Smoothing {
    /// One tick a step.
    #[default]
    None = 0,
    /// Two ticks a step.
    Twofold = 1,
    /// Four ticks a step.
    Fourfold = 2,
    /// Eight ticks a step.
    Eightfold = 3,
    /// Sixteen ticks a step.
    Sixteenfold = 4,
}

impl Smoothing {
    /// Base-2 logarithm of the ticks to a step, 0 to [`MAX_SMOOTHING_LEVEL`].
    pub const fn level(self) -> u32 {
        self as u32
    }
}

/// How early motors other than the dominant one step: half a tick, so that they are early as often
/// as late; or not at all.
///
/// The same byte also tells whether the segment is a part of a step event. So the tick that loads a
/// segment needs one comparison to see whether anything is unusual.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Early {
    /// The earliness in 32nds of a step event, and the flag [`PART`].
    bits: u8,
}

/// Set in a part of a step event.
const PART: u8 = 0x80;

impl Early {
    /// Not early: for step events in parts, in which each motor steps exactly when it is due.
    pub const NOT: Self = Self { bits: 0 };

    /// Early by half a tick of `smoothing`.
    pub const fn half_a_tick(smoothing: Smoothing) -> Self {
        Self {
            bits: 1 << (MAX_SMOOTHING_LEVEL - smoothing.level()),
        }
    }

    /// The same earliness, for a segment that is a part of a step event.
    #[must_use]
    pub const fn of_a_part(self) -> Self {
        Self {
            bits: self.bits | PART,
        }
    }

    /// Whether it belongs to a part of a step event.
    pub const fn is_of_a_part(self) -> bool {
        self.bits & PART != 0
    }

    /// The same earliness, for a segment of whole step events.
    #[must_use]
    pub(crate) const fn in_whole_events(self) -> Self {
        Self {
            bits: self.bits & !PART,
        }
    }

    /// The byte: the earliness in 32nds of a step event in the lower seven bits, the flag of a part
    /// in the highest.
    pub const fn bits(self) -> u8 {
        self.bits
    }

    /// The distance that a motor with `steps` in the line advances in that time, in the tracer's
    /// units: a sixteenth of a step, divided by the line's step events.
    #[inline]
    pub(crate) const fn of(self, steps: u32) -> u32 {
        (steps * self.bits as u32) >> 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_levels_are_the_logarithms_of_the_ticks_to_a_step() {
        let all = [
            Smoothing::None,
            Smoothing::Twofold,
            Smoothing::Fourfold,
            Smoothing::Eightfold,
            Smoothing::Sixteenfold,
        ];
        assert_eq!(all.map(Smoothing::level), [0, 1, 2, 3, MAX_SMOOTHING_LEVEL]);
    }

    #[test]
    fn early_is_half_a_tick() {
        let of = |smoothing| Early::half_a_tick(smoothing).of(10);
        assert_eq!(of(Smoothing::None), 80);
        assert_eq!(of(Smoothing::Eightfold), 10);
        assert_eq!(of(Smoothing::Sixteenfold), 5);
        assert_eq!(Early::NOT.of(10), 0);
    }
}
