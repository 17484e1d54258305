//! Startup lines and the text of `$I`, which outlast power.

use crate::protocol::system_command::{MAX_STORED_TEXT, STARTUP_LINES};
use heapless::Vec;

/// A filtered line, as it was stored.
pub(crate) type Text = Vec<u8, MAX_STORED_TEXT>;

/// Stored texts.
#[derive(Clone, Debug, Default)]
pub(crate) struct Memory {
    startup: [Text; STARTUP_LINES as usize],
    build: Text,
}

impl Memory {
    /// The startup line `index`; empty if there is none.
    pub(crate) fn startup(&self, index: u8) -> &[u8] {
        self.startup
            .get(usize::from(index))
            .map_or(&[], Text::as_slice)
    }

    /// The text that `$I=` stored.
    pub(crate) fn build(&self) -> &[u8] {
        &self.build
    }

    /// Replaces a startup line.
    pub(crate) fn set_startup(&mut self, index: u8, line: &[u8]) {
        if let Some(text) = self.startup.get_mut(usize::from(index)) {
            replace(text, line);
        }
    }

    /// Replaces the text of `$I`.
    pub(crate) fn set_build(&mut self, line: &[u8]) {
        replace(&mut self.build, line);
    }

    /// Forgets everything: `$RST=*`.
    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }
}

fn replace(text: &mut Text, line: &[u8]) {
    text.clear();
    // Lines that do not fit were refused when they were read.
    let _ = text.extend_from_slice(line.get(..MAX_STORED_TEXT).unwrap_or(line));
}
