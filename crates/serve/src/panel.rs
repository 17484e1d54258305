//! The display of `serve` and the keys of its user: a terminal, plain text, or a test.

use super::note::Note;
use super::spool::Spool;
use leadscrew_files::plain;
pub use leadscrew_page::Key;
pub use leadscrew_sim::powered::Snapshot;
use std::io::{self, Write};

/// The display of messages and of the machine's state.
pub trait Panel {
    /// Shows a message.
    fn note(&mut self, note: &Note<'_>);
    /// Shows the machine.
    fn show(&mut self, machine: &Snapshot);
    /// The next key since the last call.
    fn key(&mut self) -> Option<Key>;
}

/// Messages that may wait for a slow reader.
const MESSAGES: usize = 1024;

/// Shows messages as lines of text, and nothing else. It never waits: messages that nobody reads
/// are lost and counted.
pub struct Plain {
    to: Spool,
    lost: u32,
}

impl Plain {
    /// Shows messages on `to`.
    pub fn new(to: impl Write + Send + 'static) -> Self {
        Self {
            to: Spool::new(to, MESSAGES),
            lost: 0,
        }
    }

    fn write(&mut self, note: &Note<'_>) -> io::Result<()> {
        if self.lost > 0 {
            writeln!(
                self.to,
                "({} messages are lost: nobody read them)",
                self.lost
            )?;
        }
        writeln!(self.to, "{}", plain(&note.to_string()))?;
        self.to.flush()
    }
}

impl Panel for Plain {
    fn note(&mut self, note: &Note<'_>) {
        match self.write(note) {
            Ok(()) => self.lost = 0,
            // The count is reported as soon as somebody reads again.
            Err(_) => self.lost += 1,
        }
    }

    fn show(&mut self, _machine: &Snapshot) {}

    fn key(&mut self) -> Option<Key> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn what_a_stranger_has_written_does_nothing_to_the_terminal() {
        let (mut read, write) = io::pipe().unwrap();
        let mut plain = Plain::new(write);
        plain.note(&Note::Page("\u{1b}[2J\u{9b}31m".into()));
        drop(plain);
        let mut text = String::new();
        read.read_to_string(&mut text).unwrap();
        assert_eq!(text, "page: \\u{1b}[2J\\u{9b}31m\n");
    }
}
