//! A word: its letter and its exact number.

use core::fmt;

/// A letter with its number, and where it was found.
///
/// Words are equal when they say the same, wherever they stand and however they were spelled.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Word {
    pub(crate) letter: Letter,
    pub(crate) value: Number,
    pub(crate) column: usize,
}

impl Word {
    /// Returns the letter.
    #[inline]
    pub const fn letter(&self) -> Letter {
        self.letter
    }

    /// Returns the number after the letter.
    #[inline]
    pub const fn value(&self) -> Number {
        self.value
    }

    /// Returns the offset of the letter in its line, in bytes from 0.
    #[inline]
    pub const fn column(&self) -> usize {
        self.column
    }
}

impl PartialEq for Word {
    fn eq(&self, other: &Self) -> bool {
        (self.letter, self.value) == (other.letter, other.value)
    }
}

impl Eq for Word {}

impl fmt::Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.letter, self.value)
    }
}

macro_rules! letters {
    ($($letter:ident $capital:literal)*) => {
        /// The letter of a word. Small letters count as capitals.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[repr(u8)]
        #[allow(missing_docs, reason = "the letters speak for themselves")]
        pub enum Letter { $($letter),* }

        impl Letter {
            /// All letters in order: `ALL[letter as usize] == letter`.
            pub const ALL: [Self; 26] = [$(Self::$letter),*];

            /// Returns the letter that this byte is in ASCII, capital or small.
            #[inline]
            pub const fn from_byte(byte: u8) -> Option<Self> {
                // The bit in which ASCII capitals and small letters differ.
                match byte & !0x20 {
                    $($capital => Some(Self::$letter),)*
                    _ => None,
                }
            }
        }
    };
}

letters! {
    A b'A' B b'B' C b'C' D b'D' E b'E' F b'F' G b'G' H b'H' I b'I' J b'J' K b'K' L b'L' M b'M'
    N b'N' O b'O' P b'P' Q b'Q' R b'R' S b'S' T b'T' U b'U' V b'V' W b'W' X b'X' Y b'Y' Z b'Z'
}

impl Letter {
    /// Returns the capital letter.
    pub const fn as_char(self) -> char {
        (b'A' + self as u8) as char
    }
}

impl fmt::Display for Letter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.as_char(), f)
    }
}

/// The number of 10⁻⁹ in 1.
const ONE: u64 = 1_000_000_000;
/// 10⁹ = 2⁹ · 5⁹: a shift by [`TWOS`] leaves a divisor that 32-bit hardware division can handle.
const FIVES: u32 = 1_953_125;
/// See [`FIVES`].
const TWOS: u32 = 9;

/// An exact decimal number in fixed point: a whole count of 10⁻⁹, without rounding.
///
/// `0.1` has no exact binary form, so a sum of a million floats drifts. Here `0.1` is 100 000 000
/// and stays so: sums are exact, equality means equality, and whoever wants a float rounds once, at
/// the very end.
///
/// Its range is ±9 223 372 036.854 775 807, the same to both sides, so that every number has its
/// negative.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(transparent)]
pub struct Number(i64);

impl Number {
    /// The largest number, 9 223 372 036.854 775 807. The smallest is its negative.
    pub const MAX: Self = Self(i64::MAX);

    /// Makes a number of a count of 10⁻⁹. `i64::MIN`, which has no negative, becomes `-i64::MAX`.
    #[inline]
    pub const fn from_nanos(nanos: i64) -> Self {
        if nanos == i64::MIN {
            Self(-i64::MAX)
        } else {
            Self(nanos)
        }
    }

    /// Makes a number of a count of `unit` · 10⁻⁹. The product of two factors of 32 bits is always
    /// within the range.
    #[inline]
    pub(crate) const fn product(count: i32, unit: i32) -> Self {
        Self(count as i64 * unit as i64)
    }

    /// Makes a number of an integer, exactly.
    pub const fn from_int(int: i32) -> Self {
        Self(int as i64 * ONE as i64)
    }

    /// Returns the number as a count of 10⁻⁹, exactly.
    #[inline]
    pub const fn nanos(self) -> i64 {
        self.0
    }

    /// Returns the whole part: rounded toward zero.
    ///
    /// From 0 to 2198, which is every G, M or T word that exists, this is one hardware division.
    #[inline]
    pub fn trunc(self) -> i64 {
        // ⌊n / 10⁹⌋ = ⌊⌊n / 2⁹⌋ / 5⁹⌋
        match u32::try_from(self.0 >> TWOS) {
            Ok(shifted) => i64::from(shifted / FIVES),
            Err(_) => wide_trunc(self.0),
        }
    }

    /// Returns the nearest `f32`, ties to even, as `str::parse::<f32>` does for the same digits.
    ///
    /// Uses neither 64-bit division nor double precision: an n of 63 bits is divided by 5⁹ as on
    /// paper, in three digits of 11, 11 and 8 bits, which gives more bits than an `f32` holds. The
    /// remainder is only compared with zero. A whole number from 0 to 2198, as most S and F are, is
    /// one hardware division.
    pub fn to_f32(self) -> f32 {
        let whole = (self.0 >> TWOS) as u32 / FIVES;
        if self.0 == i64::from(whole) * ONE as i64 {
            return whole as f32;
        }
        let magnitude = self.0.unsigned_abs();
        // A number is at most i64::MAX, so bit 63 of its magnitude is 0.
        let shift = magnitude.leading_zeros() - 1;
        let normal = magnitude << shift;
        let (high, low) = ((normal >> 32) as u32, normal as u32);
        // Each remainder is below 5⁹ < 2²¹, so that 11 more bits fit in 32.
        let (first, rest) = (high / FIVES, high % FIVES);
        let dividend = rest << 11 | low >> 21;
        let (second, rest) = (dividend / FIVES, dividend % FIVES);
        let dividend = rest << 8 | low >> 13 & 0xff;
        let (third, rest) = (dividend / FIVES, dividend % FIVES);
        let inexact = u32::from(rest != 0 || low & 0x1fff != 0);
        // ⌊normal / 2¹³ / 5⁹⌋, at least 29 bits
        let quotient = first << 19 | second << 8 | third | inexact;
        // magnitude / 2⁹ / 5⁹ = quotient · 2^(13 − 9 − shift): a power of two, hence exact
        let scale = f32::from_bits((127 + 13 - TWOS - shift) << 23);
        let value = quotient as f32 * scale;
        if self.0 < 0 {
            -value
        } else {
            value
        }
    }
}

/// Divides numbers that are negative or too large for 32 bits. A function of its own: side by side
/// with the quick division the compiler would take the slow one for both.
#[cold]
#[inline(never)]
fn wide_trunc(nanos: i64) -> i64 {
    nanos / ONE as i64
}

impl fmt::Display for Number {
    /// Writes the shortest decimal that is exactly this number: `-0.5`, `12.345`, `1500`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0 { "-" } else { "" };
        let magnitude = self.0.unsigned_abs();
        let (whole, mut fraction, mut places) = (magnitude / ONE, magnitude % ONE, 9);
        write!(f, "{sign}{whole}")?;
        if fraction == 0 {
            return Ok(());
        }
        while fraction % 10 == 0 {
            (fraction, places) = (fraction / 10, places - 1);
        }
        write!(f, ".{fraction:0places$}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;

    /// All magnitudes alike, so that the small numbers of real programs are met as often as the
    /// huge ones.
    fn any_number() -> impl Strategy<Value = Number> {
        (any::<i64>(), 0..63u32).prop_map(|(nanos, shift)| Number::from_nanos(nanos >> shift))
    }

    #[test]
    fn prints_no_more_digits_than_needed() {
        let cases = [
            (0, "0"),
            (1, "0.000000001"),
            (-500_000_000, "-0.5"),
            (12_345_000_000, "12.345"),
            (1_500_000_000_000, "1500"),
            (i64::MAX, "9223372036.854775807"),
            (i64::MIN, "-9223372036.854775807"),
        ];
        for (nanos, text) in cases {
            assert_eq!(Number::from_nanos(nanos).to_string(), text);
        }
    }

    #[test]
    fn integers_are_exact_to_the_ends_of_i32() {
        assert_eq!(Number::from_int(i32::MIN).trunc(), i64::from(i32::MIN));
        assert_eq!(Number::from_int(i32::MAX).to_string(), "2147483647");
    }

    proptest! {
        #[test]
        fn trunc_is_the_division_it_replaces(n in any_number()) {
            prop_assert_eq!(n.trunc(), n.nanos() / 1_000_000_000);
        }

        #[test]
        fn to_f32_rounds_as_the_standard_library_reads(n in any_number()) {
            prop_assert_eq!(n.to_f32(), n.to_string().parse::<f32>().unwrap());
        }

        #[test]
        fn to_f32_is_exact_for_integers_that_fit(int in -(1 << 24)..=1 << 24) {
            prop_assert_eq!(Number::from_int(int).to_f32(), int as f32);
        }
    }
}
