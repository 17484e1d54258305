//! A pin as a byte.
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// A pin and one property of it ([`Self::high`]), or no pin.
#[derive(Clone, Copy, PartialEq, Eq, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(transparent)]
pub struct PinCode(u8);

impl PinCode {
    /// No pin.
    pub const NONE: Self = Self(0xFF);

    /// Makes pin `number`, 0 to 15, of a port from A (0) to G (6). For an output, `high` means that
    /// a high level switches it on. For an input, it means that a closed switch makes the pin high.
    /// `None` if there is no such pin.
    #[must_use]
    pub const fn new(port: u8, number: u8, high: bool) -> Option<Self> {
        if port < 7 && number < 16 {
            Some(Self((high as u8) << 7 | port << 4 | number))
        } else {
            None
        }
    }

    /// Returns port and number; `None` if there is no pin.
    #[must_use]
    pub const fn pin(self) -> Option<(u8, u8)> {
        match self.0 >> 4 & 7 {
            7 => None,
            port => Some((port, self.0 & 0xF)),
        }
    }

    /// Returns true if high is on, or closed: see [`Self::new`].
    #[must_use]
    pub const fn high(self) -> bool {
        self.0 >> 7 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pin_has_a_byte_of_its_own() {
        let mut seen = [false; 256];
        for port in 0..7 {
            for number in 0..16 {
                for high in [false, true] {
                    let code = PinCode::new(port, number, high).unwrap();
                    assert_eq!((code.pin(), code.high()), (Some((port, number)), high));
                    assert!(!core::mem::replace(&mut seen[usize::from(code.0)], true));
                }
            }
        }
        assert_eq!(PinCode::NONE.pin(), None);
        assert_eq!(
            (PinCode::new(7, 0, false), PinCode::new(0, 16, false)),
            (None, None)
        );
    }
}
