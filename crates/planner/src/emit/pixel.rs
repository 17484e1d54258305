//! Changes of power within a planned move: the pixels of a raster's row.
//!
//! A row is planned as one move (see [`crate::path::row`]). Its changes of power wait in a pool
//! that all moves share, oldest first, eight bytes a pixel:
//!
//! ```text
//!   bit 63      40 39       17 16       0
//!      | line     | power     | after    |
//! ```
//!
//! `after` counts the steps of the dominant motor since the change before.

use fixed::types::U1F31;
use heapless::deque::DequeView;
use leadscrew_stepper::Power;

/// A change of power within a planned move.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Pixel {
    /// Steps of the dominant motor from the last change, or the move's start, to this one.
    pub(crate) after: u32,
    /// Power from here on, at the programmed feed.
    pub(crate) power: Power,
    /// The `N` word of the line that asked for it.
    pub(crate) line_number: Option<u32>,
}

/// Bits of a line number; all of them set stand for none.
const LINE_BITS: u32 = 24;
const NO_LINE: u32 = (1 << LINE_BITS) - 1;
/// Bits of a power, in units of 2⁻²² of full power.
const POWER_BITS: u32 = 23;
/// Bits of [`Power::share`] that are rounded away.
const ROUNDED: u32 = 9;
/// Bits of `after`: 131 071 steps, half a metre at 250 steps/mm.
const AFTER_BITS: u32 = 64 - LINE_BITS - POWER_BITS;

/// A [`Pixel`] in eight bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Packed(u64);

impl Pixel {
    /// Packs it; `None` if the steps or the line number do not fit.
    pub(crate) fn packed(&self) -> Option<Packed> {
        let line = match self.line_number {
            Some(number) => Some(number).filter(|number| *number < NO_LINE)?,
            None => NO_LINE,
        };
        let after = Some(self.after).filter(|after| after >> AFTER_BITS == 0)?;
        // Rounded up, because a power was rounded down when it was made from a decimal, and the
        // power output rounds down again.
        let share = self.power.share().to_bits();
        let power = (share + ((1 << ROUNDED) - 1)) >> ROUNDED;
        let high = u64::from(line) << POWER_BITS | u64::from(power);
        Some(Packed(high << AFTER_BITS | u64::from(after)))
    }
}

impl Packed {
    /// The pixel that was packed.
    fn unpacked(self) -> Pixel {
        let field = |low: u32, bits: u32| (self.0 >> low) as u32 & ((1 << bits) - 1);
        let line = field(AFTER_BITS + POWER_BITS, LINE_BITS);
        let power = field(AFTER_BITS, POWER_BITS) << ROUNDED;
        Pixel {
            after: field(0, AFTER_BITS),
            power: Power::from_share(U1F31::from_bits(power)),
            line_number: (line != NO_LINE).then_some(line),
        }
    }
}

/// The pixels of all planned moves, in the order in which they are made.
#[derive(Debug)]
pub(crate) struct Pixels<'q>(&'q mut DequeView<Packed>);

impl<'q> Pixels<'q> {
    /// An empty pool in `room`.
    pub(crate) fn new(room: &'q mut DequeView<Packed>) -> Self {
        room.clear();
        Self(room)
    }

    /// The most pixels that the pool holds.
    pub(crate) fn capacity(&self) -> usize {
        self.0.storage_capacity()
    }

    /// Returns how many pixels wait.
    pub(crate) fn len(&self) -> usize {
        self.0.storage_len()
    }

    /// Appends a pixel; the caller has seen that there is room.
    pub(crate) fn push(&mut self, pixel: Packed) {
        let _ = self.0.push_back(pixel);
    }

    /// Takes out the pixel that comes next.
    pub(crate) fn pop(&mut self) -> Option<Pixel> {
        self.0.pop_front().map(Packed::unpacked)
    }

    /// Forgets all pixels.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_pixel_takes_eight_bytes() {
        assert_eq!(core::mem::size_of::<Packed>(), 8);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let pixel = Pixel {
            after: (1 << 17) - 1,
            power: Power::FULL,
            line_number: None,
        };
        assert!(pixel.packed().is_some());
        let (longer, later) = (
            Pixel {
                after: 1 << 17,
                ..pixel
            },
            Pixel {
                line_number: Some(NO_LINE),
                ..pixel
            },
        );
        assert_eq!((longer.packed(), later.packed()), (None, None));
    }

    proptest! {
        #[test]
        fn what_comes_out_is_what_went_in(
            after in 0u32..1 << 17, share in 0u32..=1 << 31, number in prop::option::of(0u32..10_000_000),
        ) {
            let power = Power::from_share(U1F31::from_bits(share));
            let mut room = heapless::Deque::<_, 2>::new();
            let mut pixels = Pixels::new(room.as_mut_view());
            pixels.push(Pixel { after, power, line_number: number }.packed().unwrap());
            prop_assert_eq!(pixels.len(), 1);
            let pixel = pixels.pop().unwrap();
            prop_assert_eq!((pixel.after, pixel.line_number), (after, number));
            let more = pixel.power.share().to_bits() - share;
            prop_assert!(more < 1 << ROUNDED);
            prop_assert_eq!(pixel.power == Power::OFF, share == 0);
        }
    }
}
