//! The text of the terminal's screen, as lines that fit a window.
//!
//! ```text
//!   leadscrew router   12.3 s         the machine's state; then the keys, then as many of the latest messages as
//!                                     there is room for. A low window leaves out the empty rows, a narrow one
//!   state     Run                     breaks the lines between words.
//! ```

use super::panel::Snapshot;
use leadscrew_sim::profile::Profile;
use std::borrow::Cow;

/// The number of rows from which empty rows are shown.
const ROOMY: usize = 16;

/// The machine's parts and their names.
pub(super) struct Page {
    title: String,
    /// Letters of the axes, in order.
    axes: Vec<char>,
    /// The axis that the second motor belongs to.
    second_motor: Option<usize>,
    /// True if a limit input is high while its switch is pressed.
    normally_closed: bool,
}

impl Page {
    /// A page for a machine.
    pub(super) fn new(profile: &Profile) -> Self {
        Self {
            title: format!("leadscrew {}", profile.name),
            axes: profile.letters(),
            second_motor: profile.second_motor.map(|second| second.axis.number()),
            normally_closed: profile.switches.normally_closed,
        }
    }

    /// The lines for a window of the given columns and rows.
    pub(super) fn lines<'n>(
        &self,
        machine: &Snapshot,
        notes: impl DoubleEndedIterator<Item = &'n String>,
        (columns, rows): (usize, usize),
    ) -> Vec<String> {
        let gap = (rows >= ROOMY).then(String::new);
        let mut lines = vec![format!("{}   {:.1} s", self.title, machine.now.seconds())];
        lines.extend(gap.clone());
        lines.extend(wrapped(&self.state(machine), columns));
        lines.extend(gap.clone());
        lines.extend(wrapped(&[self.keys()], columns));
        lines.extend(gap);
        let room = rows.saturating_sub(lines.len());
        lines.extend(latest(notes, columns, room));
        lines.truncate(rows);
        lines
    }

    fn state(&self, machine: &Snapshot) -> Vec<String> {
        let place = |(place, axis): (&f32, &char)| format!("{axis} {place:10.3}");
        let position = machine.position.iter().zip(&self.axes);
        let position: Vec<_> = position.map(place).collect();
        let [feed, rapid, spindle] = machine.overrides;
        vec![
            format!("state     {}", machine.state),
            format!("position  {}", position.join("  ")),
            format!(
                "feed      {:.0} mm/min   {} lines taken, {:.1} s queued",
                machine.feed, machine.lines, machine.seconds_queued
            ),
            format!("override  feed {feed} %   rapid {rapid} %   spindle {spindle} %"),
            format!("switches  {}", self.switches(machine)),
        ]
    }

    fn keys(&self) -> String {
        let axes: Vec<_> = self
            .axes
            .iter()
            .map(|letter| letter.to_ascii_lowercase().to_string())
            .collect();
        let second = self.second_motor.map_or("", |_| " 2");
        let limits = axes.join(" ");
        format!(
            "d door   h hold   s start   r reset   p probe   {limits}{second} limit switches   q quit"
        )
    }

    /// Switches and buttons that are pressed.
    fn switches(&self, machine: &Snapshot) -> String {
        let levels = &machine.switches;
        let second = self
            .second_motor
            .map(|axis| format!("{}2", self.axes[axis]));
        let motors = self.axes.iter().map(char::to_string).chain(second);
        let limits = motors
            .enumerate()
            .filter(|(motor, _)| levels.limits.contains(*motor) == self.normally_closed)
            .map(|(_, name)| format!("limit {name}"));
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
        let pressed: Vec<String> = limits.chain(buttons).collect();
        if pressed.is_empty() {
            "none pressed".to_owned()
        } else {
            pressed.join(", ")
        }
    }
}

/// The latest messages, as many as there is room for, in their order.
fn latest<'n>(
    notes: impl DoubleEndedIterator<Item = &'n String>,
    columns: usize,
    room: usize,
) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for note in notes.rev() {
        let mut note = wrapped(&[note], columns);
        if lines.len() + note.len() > room {
            break;
        }
        note.append(&mut lines);
        lines = note;
    }
    lines
}

/// Breaks texts into lines that fit the columns.
fn wrapped<S: AsRef<str>>(texts: &[S], columns: usize) -> Vec<String> {
    let options = textwrap::Options::new(columns.max(1)).subsequent_indent("  ");
    let lines = texts
        .iter()
        .flat_map(|text| textwrap::wrap(text.as_ref(), &options));
    lines.map(Cow::into_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use leadscrew_machine::board::{CoolantOutput, SpindleOutput, Switches};
    use leadscrew_sim::clock::Cycle;
    use leadscrew_stepper::MotorMask;
    use std::path::Path;

    const WIDE: (usize, usize) = (100, 30);

    fn page(profile: &str) -> Page {
        Page::new(&Profile::parse(Path::new("test.toml"), profile).unwrap())
    }

    fn machine() -> Snapshot {
        Snapshot {
            own: String::new(),
            now: Cycle::from_micros(12_340_000),
            state: "Run",
            position: vec![1.5, -2.0, 0.0],
            feed: 599.6,
            overrides: [110, 50, 100],
            work_offset: vec![0.0; 3],
            spindle: SpindleOutput::Off,
            power: 0.0,
            coolant: CoolantOutput::default(),
            switches: Switches {
                limits: MotorMask::from_bits(0b1111_0101),
                probe: false,
                ..Switches::OPEN
            },
            lines: 120,
            seconds_queued: 4.25,
        }
    }

    #[test]
    fn the_page_shows_what_the_machine_does() {
        let notes = ["tcp: ready".to_owned()];
        let lines = page("name = \"router\"").lines(&machine(), notes.iter(), WIDE);
        assert_eq!(lines[0], "leadscrew router   12.3 s");
        assert_eq!(lines[2], "state     Run");
        assert_eq!(
            lines[3],
            "position  X      1.500  Y     -2.000  Z      0.000"
        );
        assert_eq!(
            lines[4],
            "feed      600 mm/min   120 lines taken, 4.2 s queued"
        );
        assert_eq!(
            lines[5],
            "override  feed 110 %   rapid 50 %   spindle 100 %"
        );
        assert_eq!(lines[6], "switches  limit Y, probe");
        assert_eq!(lines.last(), Some(&notes[0]));
    }

    #[test]
    fn a_second_motor_has_a_switch_and_a_key_of_its_own() {
        let page = page("[second_motor]\naxis = \"y\"\nstart = 0\n");
        let lines = page.lines(&machine(), [].iter(), WIDE);
        assert_eq!(lines[6], "switches  limit Y, limit Y2, probe");
        assert!(
            lines[8].contains(" x y z 2 limit switches "),
            "{}",
            lines[8]
        );
    }

    #[test]
    fn limit_switches_that_open_are_pressed_while_their_inputs_are_high() {
        let page = page("[switches]\nnormally_closed = true\n");
        let lines = page.lines(&machine(), [].iter(), WIDE);
        assert_eq!(lines[6], "switches  limit X, limit Z, probe");
    }

    #[test]
    fn a_fourth_axis_has_a_key_of_its_own() {
        let lines = page("[axes.a]\n").lines(&machine(), [].iter(), WIDE);
        assert!(
            lines[8].contains(" x y z a limit switches "),
            "{}",
            lines[8]
        );
    }

    #[test]
    fn a_small_window_shows_the_state_first_and_then_the_latest_message() {
        let notes = ["an old one".to_owned(), "the latest message".to_owned()];
        let lines = page("").lines(&machine(), notes.iter(), (200, 8));
        assert_eq!(lines.len(), 8);
        assert_eq!(lines[1], "state     Run");
        assert_eq!(lines[7], notes[1]);
        let lines = page("").lines(&machine(), notes.iter(), (200, 2));
        assert_eq!(lines.len(), 2);
    }

    #[test]
    fn no_line_is_longer_than_the_window_and_no_word_is_lost() {
        let note = "a message that is longer than the window is wide".to_owned();
        let lines = page("").lines(&machine(), [&note].into_iter(), (24, 40));
        let shown = lines.join(" ");
        assert!(lines[1..].iter().all(|line| line.len() <= 24), "{lines:#?}");
        for word in note.split(' ').chain(["quit", "switches", "spindle"]) {
            assert!(shown.contains(word), "{word}: {lines:#?}");
        }
    }
}
