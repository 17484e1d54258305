//! The machine on a terminal: state, position, feed, overrides, switches, messages, and keys to
//! press.

use super::note::Note;
use super::page::Page;
use super::panel::{Key, Panel, Snapshot};
use super::spool::Spool;
use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use crossterm::style::{Attribute, Print, SetAttribute};
use crossterm::terminal::{self, Clear, ClearType, EnterAlternateScreen, LeaveAlternateScreen};
use crossterm::{cursor, queue};
use leadscrew_files::plain;
use leadscrew_sim::profile::Profile;
use std::collections::VecDeque;
use std::io::{self, Write};
use std::panic;
use std::time::Duration;

/// Messages that are kept for the screen.
const NOTES: usize = 50;

/// Pictures that may wait for a slow terminal. Each picture is complete, so that one that is left
/// out is not missed.
const PICTURES: usize = 2;

/// A terminal in use; dropping it restores the terminal.
pub struct Screen {
    to: Spool,
    page: Page,
    notes: VecDeque<String>,
}

impl Screen {
    /// Takes over the terminal for a machine.
    ///
    /// # Errors
    /// Errors of the terminal.
    pub fn new(profile: &Profile) -> io::Result<Self> {
        terminal::enable_raw_mode()?;
        give_back_before_a_panic_speaks();
        let mut screen = Self {
            to: Spool::new(io::stdout(), PICTURES),
            page: Page::new(profile),
            notes: VecDeque::new(),
        };
        queue!(screen.to, EnterAlternateScreen, cursor::Hide)?;
        screen.to.flush()?;
        Ok(screen)
    }

    fn draw(&mut self, machine: &Snapshot) -> io::Result<()> {
        let (columns, rows) = terminal::size()?;
        queue!(self.to, cursor::MoveTo(0, 0))?;
        let size = (usize::from(columns), usize::from(rows));
        let lines = self.page.lines(machine, self.notes.iter(), size);
        for (row, line) in lines.iter().enumerate() {
            if row > 0 {
                queue!(self.to, cursor::MoveToNextLine(1))?;
            }
            let line: String = line.chars().take(size.0).collect();
            let weight = if row == 0 {
                Attribute::Bold
            } else {
                Attribute::Reset
            };
            queue!(self.to, SetAttribute(weight), Print(&line))?;
            // After a full row the cursor still stands on the row's last character, which clearing
            // would remove.
            if line.chars().count() < size.0 {
                queue!(self.to, Clear(ClearType::UntilNewLine))?;
            }
        }
        queue!(self.to, SetAttribute(Attribute::Reset))?;
        if lines.len() < size.1 {
            queue!(self.to, cursor::MoveToNextLine(1))?;
            queue!(self.to, Clear(ClearType::FromCursorDown))?;
        }
        self.to.flush()
    }
}

impl Panel for Screen {
    fn note(&mut self, note: &Note<'_>) {
        self.notes.push_back(plain(&note.to_string()).into_owned());
        if self.notes.len() > NOTES {
            self.notes.pop_front();
        }
    }

    fn show(&mut self, machine: &Snapshot) {
        // If the terminal cannot be written to in time, it shows nothing; clients are not affected.
        let _ = self.draw(machine);
    }

    fn key(&mut self) -> Option<Key> {
        while event::poll(Duration::ZERO).ok()? {
            if let Event::Key(pressed) = event::read().ok()? {
                if let Some(key) = key_of(&pressed) {
                    return Some(key);
                }
            }
        }
        None
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // An error here has nobody to report it to.
        let _ = leave(&mut self.to);
        let _ = terminal::disable_raw_mode();
    }
}

fn leave(to: &mut impl Write) -> io::Result<()> {
    queue!(to, LeaveAlternateScreen, cursor::Show)?;
    to.flush()
}

/// Leaves the screen before a panic prints its message, which would vanish with the screen.
fn give_back_before_a_panic_speaks() {
    let speak = panic::take_hook();
    panic::set_hook(Box::new(move |what| {
        let _ = leave(&mut io::stdout());
        let _ = terminal::disable_raw_mode();
        speak(what);
    }));
}

fn key_of(pressed: &KeyEvent) -> Option<Key> {
    if pressed.kind == KeyEventKind::Release {
        return None;
    }
    let control = pressed.modifiers.contains(KeyModifiers::CONTROL);
    match pressed.code {
        // In raw mode Ctrl-C is a key: the terminal makes no signal of it.
        KeyCode::Char('c') if control => Some(Key::Quit),
        KeyCode::Char(letter) if !control => key_of_letter(letter),
        _ => None,
    }
}

fn key_of_letter(letter: char) -> Option<Key> {
    match letter.to_ascii_lowercase() {
        'd' => Some(Key::Door),
        'h' | '!' => Some(Key::Hold),
        's' | '~' => Some(Key::Start),
        'r' => Some(Key::Reset),
        'p' => Some(Key::Probe),
        'x' => Some(Key::Limit(0)),
        'y' => Some(Key::Limit(1)),
        'z' => Some(Key::Limit(2)),
        'a' => Some(Key::Limit(3)),
        '2' => Some(Key::SecondMotorLimit),
        'q' => Some(Key::Quit),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_press_what_the_help_line_says() {
        let press = |code, modifiers| key_of(&KeyEvent::new(code, modifiers));
        let plain = KeyModifiers::NONE;
        assert_eq!(press(KeyCode::Char('d'), plain), Some(Key::Door));
        assert_eq!(
            press(KeyCode::Char('Z'), KeyModifiers::SHIFT),
            Some(Key::Limit(2))
        );
        assert_eq!(
            press(KeyCode::Char('2'), plain),
            Some(Key::SecondMotorLimit)
        );
        assert_eq!(
            press(KeyCode::Char('c'), KeyModifiers::CONTROL),
            Some(Key::Quit)
        );
        assert_eq!(press(KeyCode::Char('c'), plain), None);
        assert_eq!(press(KeyCode::Esc, plain), None);
    }
}
