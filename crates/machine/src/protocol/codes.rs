//! The shape of a table of numbered codes: one row gives the variant, its number and its texts.

/// Makes an enum of one table: name and number, short text, long explanation.
///
/// Texts go over the wire in `[MSG:…]` lines and into the documents. Some senders look for the two answers *anywhere* in
/// a line, so that neither word may occur in a text, in any case; `texts_are_safe_to_send` in each table's tests sees
/// to it.
macro_rules! codes {
    ($(#[$meta:meta])* $name:ident { $($variant:ident = $number:literal, $text:literal, $explanation:literal;)* }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[repr(u8)]
        pub enum $name {
            $(#[doc = concat!($text, ". ", $explanation)] $variant = $number,)*
        }

        impl $name {
            /// All codes, by rising number.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// Answers the number that is sent.
            pub const fn number(self) -> u8 {
                self as u8
            }

            /// Finds the code of a number.
            pub fn from_number(number: u8) -> Option<Self> {
                Self::ALL.iter().copied().find(|code| code.number() == number)
            }

            /// Answers what happened, in a few words without a full stop.
            pub const fn text(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)*
                }
            }

            /// Answers why it happens and what to do about it, in whole sentences.
            pub const fn explanation(self) -> &'static str {
                match self {
                    $(Self::$variant => $explanation,)*
                }
            }
        }
    };
}

pub(crate) use codes;

/// Checks a table: numbers rise, texts fit a message line and hold no word that a sender takes for an answer.
#[cfg(test)]
pub(crate) fn assert_is_a_good_table(rows: &[(u8, &str, &str)]) {
    for pair in rows.windows(2) {
        assert!(pair[0].0 < pair[1].0, "{} is out of order", pair[1].0);
    }
    for (number, text, explanation) in rows {
        assert!(text.len() <= 60, "{number}: too long for a message");
        assert!(
            !text.ends_with('.') && explanation.ends_with('.'),
            "{number}"
        );
        for words in [text, explanation] {
            let words = words.to_ascii_lowercase();
            for answer in ["ok", "error", "alarm"] {
                assert!(!words.contains(answer), "{number} contains {answer}");
            }
        }
    }
}
