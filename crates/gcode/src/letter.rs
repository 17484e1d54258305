//! Letters of words.

use core::fmt;

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

            /// Answers the letter that this byte is in ASCII, capital or small.
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
    /// Answers the capital letter.
    pub const fn as_char(self) -> char {
        (b'A' + self as u8) as char
    }
}

impl fmt::Display for Letter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.as_char(), f)
    }
}
