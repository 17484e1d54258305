//! Writing lines of G-code.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_commands_nothing() {
        assert_eq!(comment(" Done! (ok?) µm\t~"), "(Done. [ok.] _m_.)");
    }
}
