//! Reading and writing lines of G-code.

use leadscrew_gcode::{Letter, Word};

/// Sets mm, absolute coordinates, mm/min and the XY plane: a job must not depend on the modes
/// before it.
pub(crate) const ABSOLUTE_MM: &str = "G21 G90 G94 G17";

/// A comment in parentheses. Senders and Grbl take `!`, `?`, `~` and bytes above 0x7F for commands
/// even inside comments, so they are replaced.
pub(crate) fn comment(text: &str) -> String {
    let harmless = |c: char| match c {
        '(' => '[',
        ')' => ']',
        '!' | '?' | '~' => '.',
        c if c.is_ascii() && !c.is_ascii_control() => c,
        _ => '_',
    };
    let text: String = text.trim().chars().map(harmless).collect();
    format!("({text})")
}

/// The mistake in a line that has a letter twice, and its column, from 1: only one of the two would
/// count. A line may have several G and M words.
///
/// # Errors
/// The first word that stands a second time.
pub(crate) fn each_once(words: &[Word]) -> Result<(), (usize, String)> {
    for (index, word) in words.iter().enumerate() {
        let is_same = |before: &Word| before.letter() == word.letter();
        let may_repeat = matches!(word.letter(), Letter::G | Letter::M);
        if !may_repeat && words.iter().take(index).any(is_same) {
            let letter = word.letter();
            return Err((
                word.column() + 1,
                format!("{word}: {letter} stands twice in this line"),
            ));
        }
    }
    Ok(())
}

/// The comments of a line: in parentheses, or after a semicolon.
pub(crate) fn comments(line: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut rest = line;
    while let Some(start) = rest.find(['(', ';']) {
        let behind = &rest[start..];
        let end = match behind.find(')') {
            Some(end) if behind.starts_with('(') => end + 1,
            Some(_) | None => behind.len(),
        };
        found.push(&behind[..end]);
        rest = &behind[end..];
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_commands_nothing() {
        assert_eq!(comment(" Done! (ok?) µm\t~"), "(Done. [ok.] _m_.)");
    }
}
