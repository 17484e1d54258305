//! The shape of a table of numbered codes: one row gives the variant, its number and its texts.

/// An error or alarm number of an extension, with its texts. Numbers 220 to 254 are free for
/// extensions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OwnCode {
    /// The number that is sent.
    pub number: u8,
    /// The event in a few words without a full stop, 60 characters at most; neither `ok`, `error`
    /// nor `alarm` in it.
    pub text: &'static str,
    /// The cause and the remedy, in whole sentences.
    pub explanation: &'static str,
}

/// Makes an enum of one table: name and number, short text, long explanation. One more variant has
/// the numbers of extensions.
///
/// Texts go over the wire in `[MSG:…]` lines and into the documents. Some senders look for `ok` and
/// `error` *anywhere* in a line. So neither word may occur in a text, in any case, and nor may
/// `alarm`; `texts_are_safe_to_send` in each table's tests sees to it.
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

            /// Answers the number that is sent.
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

            /// Answers the event, in a few words without a full stop; nothing for an extension's.
            pub const fn text(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)*
                    Self::Own(_) => "",
                }
            }

            /// Answers the cause and the remedy, in whole sentences; nothing for an extension's.
            pub const fn explanation(self) -> &'static str {
                match self {
                    $(Self::$variant => $explanation,)*
                    Self::Own(_) => "",
                }
            }
        }
    };
}

pub(crate) use codes;

/// Checks a table: numbers rise, texts fit a message line and hold no word that a sender takes for
/// an answer.
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
