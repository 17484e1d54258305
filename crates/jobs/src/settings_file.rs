//! Settings from a file or the command line: lines as `$$` prints them.
//!
//! ```text
//! $100=250.000
//! $110=500.000 (x max rate, mm/min)
//! ```
//!
//! Text in parentheses after the value is a description, as old versions of Grbl printed it. Empty
//! lines are skipped. So is an `ok` at the end, which a terminal's log has.

use leadscrew_files::WRITTEN_BY_HAND;
use std::fmt;
use std::path::Path;

/// One line `$n=v`, ready to be sent, and its source.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SettingLine {
    /// The line without description: `$n=v`.
    pub text: String,
    /// Its origin for messages: file and line, or the option.
    pub origin: String,
}

/// A line that is no setting or that the machine refuses, or a file that cannot be read.
#[derive(Debug)]
pub struct SettingsError(pub(crate) String);

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for SettingsError {}

/// Reads a settings file.
///
/// # Errors
/// The first line that is no setting, with its number, or why the file cannot be read.
pub fn read(path: &Path) -> Result<Vec<SettingLine>, SettingsError> {
    let name = leadscrew_files::shown(path);
    let bytes = leadscrew_files::read(path, WRITTEN_BY_HAND)
        .map_err(|e| SettingsError(format!("{name}: cannot be read: {e}")))?;
    let text = String::from_utf8(bytes)
        .map_err(|_| SettingsError(format!("{name}: is not a text file of settings")))?;
    let mut settings = Vec::new();
    for (index, line) in text.trim_start_matches('\u{FEFF}').lines().enumerate() {
        let origin = format!("{name}:{}", index + 1);
        match line.trim() {
            "" | "ok" => {}
            line => settings.push(setting(line, origin)?),
        }
    }
    Ok(settings)
}

/// Reads the value of a `--set` option.
///
/// # Errors
/// If it is no setting.
pub fn option(text: &str) -> Result<SettingLine, SettingsError> {
    setting(text.trim(), format!("--set '{text}'"))
}

fn setting(line: &str, origin: String) -> Result<SettingLine, SettingsError> {
    let bare = line.split('(').next().unwrap_or_default().trim();
    let number = bare.strip_prefix('$').and_then(|rest| rest.split_once('='));
    match number {
        Some((number, value)) if is_number(number) && !value.trim().is_empty() => Ok(SettingLine {
            text: bare.to_owned(),
            origin,
        }),
        Some(_) | None => {
            let shown: String = line.chars().filter(|c| !c.is_control()).take(60).collect();
            Err(SettingsError(format!(
                "{origin}: expected a setting such as $110=6000, found `{shown}`"
            )))
        }
    }
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_loses_its_description() {
        let line = option("$110=500.000 (x max rate, mm/min)").unwrap();
        assert_eq!(line.text, "$110=500.000");
    }

    #[test]
    fn nonsense_is_shown_with_its_place() {
        for bad in ["110=5", "$=5", "$110", "$x=5", "$110=", "hello", "$N0=G21"] {
            let message = option(bad).unwrap_err().to_string();
            assert!(
                message.contains("--set") && message.contains("$110=6000"),
                "{message}"
            );
        }
    }
}
