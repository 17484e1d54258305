//! The machine on a terminal: state, position, feed, overrides, switches, messages, and keys to press.

use super::note::Note;
use super::panel::{Key, Panel, Snapshot};
use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use crossterm::style::{Attribute, Print, SetAttribute};
use crossterm::terminal::{self, Clear, ClearType, EnterAlternateScreen, LeaveAlternateScreen};
use crossterm::{cursor, queue};
use std::collections::VecDeque;
use std::io::{self, Stdout, Write};
use std::time::Duration;

/// Messages that stay on the screen.
const NOTES: usize = 10;

const AXES: [char; 4] = ['X', 'Y', 'Z', 'A'];

const HELP: &str =
    "d door   h hold   s start   r reset   p probe   x y z a limit switches   q quit";

/// A terminal that is in use; dropped, it is as before.
pub struct Screen {
    to: Stdout,
    title: String,
    notes: VecDeque<String>,
}

impl Screen {
    /// Takes the terminal.
    ///
    /// # Errors
    /// Those of the terminal.
    pub fn new(title: String) -> io::Result<Self> {
        terminal::enable_raw_mode()?;
        let mut screen = Self {
            to: io::stdout(),
            title,
            notes: VecDeque::new(),
        };
        queue!(screen.to, EnterAlternateScreen, cursor::Hide)?;
        screen.to.flush()?;
        Ok(screen)
    }

    fn draw(&mut self, machine: &Snapshot) -> io::Result<()> {
        let (columns, rows) = terminal::size()?;
        queue!(self.to, cursor::MoveTo(0, 0))?;
        let text = page(&self.title, machine, self.notes.iter());
        for (row, line) in text.iter().take(usize::from(rows)).enumerate() {
            let line: String = line.chars().take(usize::from(columns)).collect();
            let weight = if row == 0 {
                Attribute::Bold
            } else {
                Attribute::Reset
            };
            queue!(
                self.to,
                SetAttribute(weight),
                Print(line),
                Clear(ClearType::UntilNewLine)
            )?;
            queue!(self.to, cursor::MoveToNextLine(1))?;
        }
        queue!(
            self.to,
            SetAttribute(Attribute::Reset),
            Clear(ClearType::FromCursorDown)
        )?;
        self.to.flush()
    }
}

impl Panel for Screen {
    fn note(&mut self, note: &Note<'_>) {
        self.notes.push_back(note.to_string());
        if self.notes.len() > NOTES {
            self.notes.pop_front();
        }
    }

    fn show(&mut self, machine: &Snapshot) {
        // A terminal that cannot be written to shows nothing; clients do not mind.
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
        // There is nobody left to tell.
        let _ = queue!(self.to, LeaveAlternateScreen, cursor::Show).and_then(|()| self.to.flush());
        let _ = terminal::disable_raw_mode();
    }
}

fn key_of(pressed: &KeyEvent) -> Option<Key> {
    if pressed.kind == KeyEventKind::Release {
        return None;
    }
    let control = pressed.modifiers.contains(KeyModifiers::CONTROL);
    match pressed.code {
        // In raw mode the terminal makes no signal of it.
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
        'q' => Some(Key::Quit),
        axis => AXES
            .iter()
            .position(|name| name.to_ascii_lowercase() == axis)
            .map(Key::Limit),
    }
}

/// The screen's lines.
fn page<'n>(
    title: &str,
    machine: &Snapshot,
    notes: impl Iterator<Item = &'n String>,
) -> Vec<String> {
    let position = machine
        .position
        .iter()
        .zip(AXES)
        .map(|(place, axis)| format!("{axis} {place:10.3}"));
    let [feed, rapid, spindle] = machine.overrides;
    let mut lines = vec![
        format!("{title}   {:.1} s", machine.now.seconds()),
        String::new(),
        format!("state     {}", machine.state),
        format!("position  {}", position.collect::<Vec<_>>().join("  ")),
        format!("feed      {:.0} mm/min", machine.feed),
        format!("override  feed {feed} %   rapid {rapid} %   spindle {spindle} %"),
        format!("switches  {}", switches(machine)),
        String::new(),
        HELP.to_owned(),
        String::new(),
    ];
    lines.extend(notes.cloned());
    lines
}

/// The inputs that are low: closed switches, pressed buttons.
fn switches(machine: &Snapshot) -> String {
    let levels = &machine.switches;
    let limits = (0..machine.position.len()).filter(|motor| !levels.limits.contains(*motor));
    let limits = limits.filter_map(|motor| AXES.get(motor).map(|axis| format!("limit {axis}")));
    let buttons = [
        (levels.probe, "probe"),
        (levels.door, "door"),
        (levels.hold, "hold"),
        (levels.start, "start"),
        (levels.reset, "reset"),
    ];
    let buttons = buttons
        .iter()
        .filter(|(high, _)| !high)
        .map(|(_, name)| (*name).to_owned());
    let closed: Vec<String> = limits.chain(buttons).collect();
    if closed.is_empty() {
        "all open".to_owned()
    } else {
        closed.join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::Cycle;
    use leadscrew_machine::board::Switches;
    use leadscrew_stepper::MotorMask;

    #[test]
    fn the_page_shows_what_the_machine_does() {
        let machine = Snapshot {
            now: Cycle::from_micros(12_340_000),
            state: "Run",
            position: vec![1.5, -2.0, 0.0],
            feed: 599.6,
            overrides: [110, 50, 100],
            switches: Switches {
                limits: MotorMask::from_bits(0b1111_1101),
                probe: false,
                ..Switches::OPEN
            },
        };
        let notes = ["tcp: ready".to_owned()];
        let page = page("router", &machine, notes.iter());
        assert_eq!(page[0], "router   12.3 s");
        assert_eq!(page[2], "state     Run");
        assert_eq!(
            page[3],
            "position  X      1.500  Y     -2.000  Z      0.000"
        );
        assert_eq!(page[4], "feed      600 mm/min");
        assert_eq!(page[5], "override  feed 110 %   rapid 50 %   spindle 100 %");
        assert_eq!(page[6], "switches  limit Y, probe");
        assert_eq!(page.last(), Some(&notes[0]));
    }

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
            press(KeyCode::Char('c'), KeyModifiers::CONTROL),
            Some(Key::Quit)
        );
        assert_eq!(press(KeyCode::Char('c'), plain), None);
        assert_eq!(press(KeyCode::Esc, plain), None);
    }
}
