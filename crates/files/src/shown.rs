//! Names and other foreign text in messages: nothing of them acts on a terminal, ends a line, breaks
//! a picture or forges a command of a workflow.

use std::borrow::Cow;
use std::path::Path;

/// Returns the text of a path for messages. It stays on its line, and no line that begins with it
/// is a workflow command of GitHub's.
pub fn shown(path: impl AsRef<Path>) -> String {
    let name = path.as_ref().display().to_string();
    let name: String = name.chars().map(|one| spelled(one, false)).collect();
    // Both notations: `::error::` at the begin of a line, `##[error]` anywhere.
    let name = name.replace("##[", "#\\u{23}[");
    match name.trim_start().starts_with("::") {
        true => format!("./{name}"),
        false => name,
    }
}

/// Returns a text in which control characters are spelled, and with them all that XML 1.0 forbids;
/// lines stay lines.
pub fn plain(text: &str) -> Cow<'_, str> {
    match text.chars().any(|one| is_harmful(one, true)) {
        true => text.chars().map(|one| spelled(one, true)).collect(),
        false => text.into(),
    }
}

/// Returns a text of JSON in which harmful characters are escaped as JSON escapes them. (Those
/// below a blank are already.)
pub fn plain_json(text: &str) -> String {
    let escaped = |one: char| match is_harmful(one, true) {
        true => format!("\\u{:04x}", u32::from(one)),
        false => one.to_string(),
    };
    text.chars().map(escaped).collect()
}

fn spelled(one: char, has_lines: bool) -> String {
    match is_harmful(one, has_lines) {
        true => one.escape_unicode().to_string(),
        false => one.to_string(),
    }
}

fn is_harmful(one: char, has_lines: bool) -> bool {
    match one {
        '\n' | '\t' => !has_lines,
        // The end of a line, and of a paragraph; and what turns the direction of the text around.
        '\u{2028}' | '\u{2029}' | '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}' => true,
        '\u{FFFE}' | '\u{FFFF}' => true,
        one => one.is_control(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_acts_nowhere() {
        for (name, expected) in [
            ("a job.nc", "a job.nc"),
            ("Fräse ☃.nc", "Fräse ☃.nc"),
            ("\u{1b}[2J.nc", "\\u{1b}[2J.nc"),
            ("a\n::error::b", "a\\u{a}::error::b"),
            ("a\rb\tc", "a\\u{d}b\\u{9}c"),
            ("\u{9b}31m", "\\u{9b}31m"),
            ("::error::x", "./::error::x"),
            (" ::error::x", "./ ::error::x"),
            ("a##[error]x", "a#\\u{23}[error]x"),
            ("a\u{202e}cn.b", "a\\u{202e}cn.b"),
        ] {
            assert_eq!(shown(name), expected);
        }
        assert_eq!(plain("a\n\tb\u{7}"), "a\n\tb\\u{7}");
        assert_eq!(plain("\u{ffff}"), "\\u{ffff}");
        assert_eq!(
            plain_json("[\"\u{7f}é\u{9b}\"]\n"),
            "[\"\\u007fé\\u009b\"]\n"
        );
    }
}
