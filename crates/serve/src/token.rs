//! The secret that a page needs to connect. It is printed when the server starts.

use std::fmt;
use tungstenite::handshake::client::generate_key;

/// A secret of 128 random bits, as text that an address can hold.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

impl Token {
    /// Makes a new token from the operating system's randomness.
    pub(super) fn draw() -> Self {
        let key = generate_key();
        let safe = |letter| match letter {
            '+' => '-',
            '/' => '_',
            other => other,
        };
        Self(key.trim_end_matches('=').chars().map(safe).collect())
    }

    /// Takes a token that the user has chosen: 16 to 128 letters, digits, `-` and `_`. `None` for
    /// other texts.
    pub fn chosen(text: &str) -> Option<Self> {
        let safe = |byte: u8| byte.is_ascii_alphanumeric() || b"-_".contains(&byte);
        let fits = (16..=128).contains(&text.len()) && text.bytes().all(safe);
        fits.then(|| Self(text.to_owned()))
    }

    /// Returns true if the query of an address, such as `token=...`, contains the token. The time
    /// does not depend on where a guess differs.
    pub(super) fn is_in(&self, query: &str) -> bool {
        let guesses = query
            .split('&')
            .filter_map(|part| part.strip_prefix("token="));
        guesses.fold(false, |found, guess| found | self.is(guess))
    }

    fn is(&self, guess: &str) -> bool {
        let pairs = self.0.bytes().zip(guess.bytes());
        let differences = pairs.fold(0, |sum, (own, theirs)| sum | (own ^ theirs));
        guess.len() == self.0.len() && differences == 0
    }
}

impl fmt::Display for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chosen_token_is_long_and_needs_no_quoting() {
        let good = "bench-in_the-workshop-7";
        assert_eq!(Token::chosen(good).unwrap().to_string(), good);
        for bad in [
            "",
            "short",
            "with space in the middle",
            "with&token=another-one",
        ] {
            assert_eq!(Token::chosen(bad), None, "{bad}");
        }
    }

    #[test]
    fn a_token_is_found_in_a_query_and_no_other_passes() {
        let token = Token::draw();
        let text = token.to_string();
        assert!(
            text.len() == 22
                && text
                    .bytes()
                    .all(|byte| byte.is_ascii_alphanumeric() || b"-_".contains(&byte))
        );
        assert!(token.is_in(&format!("token={text}")));
        assert!(token.is_in(&format!("a=b&token={text}")));
        let wrong = [
            "",
            "token=",
            &format!("token={}", &text[1..]),
            &format!("token={text}x"),
            &text,
        ];
        assert!(wrong.iter().all(|query| !token.is_in(query)));
        assert!(!Token::draw().is_in(&format!("token={text}")));
    }
}
