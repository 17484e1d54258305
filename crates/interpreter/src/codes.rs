//! The shape of a table of numbered codes: one row gives the variant, its number and its texts.

/// Makes an enum of one table: name and number, short text, long explanation. One more variant has
/// the numbers of extensions.
///
/// Texts go over the wire in `[MSG:…]` lines and into the documents. Some senders look for `ok` and
/// `error` *anywhere* in a line. So neither word may occur in a text, in any case, and nor may
/// `alarm`; the tests of `leadscrew-machine` see to it.
#[doc(hidden)] // for the alarms of `leadscrew-machine`, which are such a table, too
#[macro_export]
macro_rules! codes {
    ($(#[$meta:meta])* $name:ident { $($variant:ident = $number:literal, $text:literal, $explanation:literal;)* }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub enum $name {
            $(#[doc = concat!($text, ". ", $explanation)] $variant,)*
            /// A number of an extension, which has the texts for it.
            Own(u8),
        }

        impl $name {
            /// All codes but the codes of extensions, by rising number.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// Returns the number that is sent.
            pub const fn number(self) -> u8 {
                match self {
                    $(Self::$variant => $number,)*
                    Self::Own(number) => number,
                }
            }

            /// Finds the code of a number, if it is none of an extension's.
            pub fn from_number(number: u8) -> Option<Self> {
                Self::ALL.iter().copied().find(|code| code.number() == number)
            }

            /// Returns the event, in a few words without a full stop; nothing for an extension's.
            #[inline(never)] // inlined, a record of four motors takes 212 bytes more
            pub const fn text(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)*
                    Self::Own(_) => "",
                }
            }

            /// Returns the cause and the remedy, in whole sentences; nothing for an extension's.
            pub const fn explanation(self) -> &'static str {
                match self {
                    $(Self::$variant => $explanation,)*
                    Self::Own(_) => "",
                }
            }
        }
    };
}
