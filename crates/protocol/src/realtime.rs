//! Realtime commands: single bytes that act at once, wherever they stand in the stream.

/// One step of an override.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum OverrideStep {
    /// Back to 100 %.
    Reset,
    /// 10 % more.
    CoarseUp,
    /// 10 % less.
    CoarseDown,
    /// 1 % more.
    FineUp,
    /// 1 % less.
    FineDown,
}

impl OverrideStep {
    /// Returns the override in percent after this step, kept within 10 to 200.
    pub fn apply(self, percent: u8) -> u8 {
        let stepped = match self {
            Self::Reset => 100,
            Self::CoarseUp => percent.saturating_add(10),
            Self::CoarseDown => percent.saturating_sub(10),
            Self::FineUp => percent.saturating_add(1),
            Self::FineDown => percent.saturating_sub(1),
        };
        stepped.clamp(10, 200)
    }
}

/// The three values of the rapid override.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum RapidOverride {
    /// 100 %.
    Full = 100,
    /// 50 %.
    Half = 50,
    /// 25 %.
    Quarter = 25,
}

impl RapidOverride {
    /// Returns the override in percent.
    pub const fn percent(self) -> u8 {
        self as u8
    }
}

/// A realtime command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Realtime {
    /// Soft reset, 0x18.
    Reset,
    /// Status report, `?`.
    Report,
    /// Feed hold, `!`.
    Hold,
    /// Cycle start and resume, `~`.
    Resume,
    /// Safety door, 0x84.
    Door,
    /// Jog cancel, 0x85.
    JogCancel,
    /// Feed override, 0x90 to 0x94.
    Feed(OverrideStep),
    /// Rapid override, 0x95 to 0x97.
    Rapid(RapidOverride),
    /// Spindle override, 0x99 to 0x9D.
    Spindle(OverrideStep),
    /// Spindle off in a hold, and on again, 0x9E.
    SpindleStop,
    /// Flood coolant on and off, 0xA0.
    Flood,
    /// Mist coolant on and off, 0xA1.
    Mist,
    /// A realtime byte of an extension, 0xF8 to 0xFF: no UTF-8 text has these bytes.
    Own(u8),
}

/// The meaning of a received byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Byte {
    /// Part of a line.
    Ordinary(u8),
    /// A realtime command.
    Realtime(Realtime),
    /// A byte of 0x80 to 0xF7 without a meaning: it is dropped. Senders that write UTF-8 put 0xC2
    /// before each override byte.
    Unknown,
}

impl Byte {
    /// Sorts a received byte. Serial interrupt: a few instructions.
    #[inline]
    pub const fn sort(byte: u8) -> Self {
        use OverrideStep::{CoarseDown, CoarseUp, FineDown, FineUp, Reset};
        Self::Realtime(match byte {
            0x18 => Realtime::Reset,
            b'?' => Realtime::Report,
            b'!' => Realtime::Hold,
            b'~' => Realtime::Resume,
            0x00..=0x7f => return Self::Ordinary(byte),
            0x84 => Realtime::Door,
            0x85 => Realtime::JogCancel,
            0x90 => Realtime::Feed(Reset),
            0x91 => Realtime::Feed(CoarseUp),
            0x92 => Realtime::Feed(CoarseDown),
            0x93 => Realtime::Feed(FineUp),
            0x94 => Realtime::Feed(FineDown),
            0x95 => Realtime::Rapid(RapidOverride::Full),
            0x96 => Realtime::Rapid(RapidOverride::Half),
            0x97 => Realtime::Rapid(RapidOverride::Quarter),
            0x99 => Realtime::Spindle(Reset),
            0x9a => Realtime::Spindle(CoarseUp),
            0x9b => Realtime::Spindle(CoarseDown),
            0x9c => Realtime::Spindle(FineUp),
            0x9d => Realtime::Spindle(FineDown),
            0x9e => Realtime::SpindleStop,
            0xa0 => Realtime::Flood,
            0xa1 => Realtime::Mist,
            0xf8..=0xff => Realtime::Own(byte),
            _ => return Self::Unknown,
        })
    }
}

impl Realtime {
    /// Returns the realtime command that a byte stands for, if it does. Any context.
    pub const fn from_byte(byte: u8) -> Option<Self> {
        match Byte::sort(byte) {
            Byte::Realtime(realtime) => Some(realtime),
            Byte::Ordinary(_) | Byte::Unknown => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn these_bytes_and_no_others_are_realtime_commands() {
        let found: Vec<u8> = (0..=255)
            .filter(|byte| Realtime::from_byte(*byte).is_some())
            .collect();
        let mut expected = b"\x18!?~\x84\x85".to_vec();
        expected.extend((0x90..=0x97).chain(0x99..=0x9e).chain(0xa0..=0xa1));
        expected.extend(0xf8..=0xff); // an extension's
        assert_eq!(found, expected);
    }

    #[test]
    fn all_other_bytes_above_0x7f_vanish() {
        for byte in 0..=255 {
            match Byte::sort(byte) {
                Byte::Ordinary(same) => assert!(same == byte && byte < 0x80),
                Byte::Unknown => assert!(byte >= 0x80),
                Byte::Realtime(_) => {}
            }
        }
    }

    #[test]
    fn overrides_stay_between_10_and_200_percent() {
        use OverrideStep::*;
        let cases = [
            (195, CoarseUp, 200),
            (200, FineUp, 200),
            (15, CoarseDown, 10),
            (10, FineDown, 10),
            (100, CoarseUp, 110),
            (100, CoarseDown, 90),
            (100, FineUp, 101),
            (100, FineDown, 99),
            (10, Reset, 100),
            (255, CoarseUp, 200),
            (0, CoarseDown, 10),
        ];
        for (before, step, after) in cases {
            assert_eq!(step.apply(before), after, "{before} {step:?}");
        }
    }
}
