//! What `serve` shows its user and what the user presses; a terminal, plain text, or a test.

use super::note::Note;
use super::spool::Spool;
use leadscrew_machine::board::{CoolantOutput, SpindleOutput, Switches};
use leadscrew_sim::clock::Cycle;
use std::io::{self, Write};

/// Something that the user presses.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Key {
    /// Opens or shuts the safety door.
    Door,
    /// Presses the feed hold button.
    Hold,
    /// Presses the cycle start button.
    Start,
    /// Presses the reset button.
    Reset,
    /// Touches the probe, or lets go of it.
    Probe,
    /// Presses the limit switch of an axis, or lets go of it.
    Limit(usize),
    /// Presses the limit switch of the second motor, or lets go of it.
    SecondMotorLimit,
    /// Ends the server.
    Quit,
}

/// The machine at an instant.
#[derive(Clone, PartialEq, Debug)]
pub struct Snapshot {
    /// Simulated time since power-up.
    pub now: Cycle,
    /// The state, as status reports spell it.
    pub state: &'static str,
    /// Machine position, mm or degrees, axis by axis.
    pub position: Vec<f32>,
    /// Speed on the path, mm/min.
    pub feed: f32,
    /// Feed, rapid and spindle overrides, percent.
    pub overrides: [u8; 3],
    /// Where work zero is, machine position, axis by axis.
    pub work_offset: Vec<f32>,
    /// What turns the spindle.
    pub spindle: SpindleOutput,
    /// Its power, or the laser's, at this instant: share of full power.
    pub power: f32,
    /// The coolant valves.
    pub coolant: CoolantOutput,
    /// The number of motors.
    pub motors: usize,
    /// Levels of all switches.
    pub switches: Switches,
    /// Lines of the program taken since it began. How many are to come, nobody has told the machine.
    pub lines: u32,
    /// Time to finish what is queued, s.
    pub seconds_queued: f32,
}

/// Where messages and the machine's state are shown.
pub trait Panel {
    /// Shows a message.
    fn note(&mut self, note: &Note<'_>);
    /// Shows the machine.
    fn show(&mut self, machine: &Snapshot);
    /// What was pressed since it was asked last.
    fn key(&mut self) -> Option<Key>;
}

/// Messages that wait for a reader that is late.
const MESSAGES: usize = 1024;

/// Messages as lines of text, nothing else. Never waits: where nobody reads them, messages are lost and counted.
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
        writeln!(self.to, "{note}")?;
        self.to.flush()
    }
}

impl Panel for Plain {
    fn note(&mut self, note: &Note<'_>) {
        match self.write(note) {
            Ok(()) => self.lost = 0,
            // Said as soon as somebody reads again.
            Err(_) => self.lost += 1,
        }
    }

    fn show(&mut self, _machine: &Snapshot) {}

    fn key(&mut self) -> Option<Key> {
        None
    }
}
