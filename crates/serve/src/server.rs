//! The server loop. It passes clients' bytes to the simulation and its answers back, and ties
//! simulated time to real time.
//!
//! ```text
//!   Lines --events--> Wires <--Host--> Simulation <--pins-- keys, glitches
//!                       |                  |
//!                    WireLog             Panel
//! ```
//!
//! A turn takes about a millisecond: first events, then the simulation up to the present, then
//! output. Other threads do whatever takes longer.

use super::bench::Bench;
use super::line::{Event, LineSpec, What};
use super::lines::Lines;
use super::note::Note;
use super::panel::Panel;
use super::remembered::Remembered;
use super::web::Allowed;
use super::wire_log::{Way, WireLog};
use leadscrew_page::{Buttons, Desk, Errand, Glitches, Key, Pace, Pages, Wires};
use leadscrew_sim::clock::{cycles_of_micros, Cycle};
use serde_json::Value;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The time that the loop waits for a client's bytes before it lets the machine go on.
const TICK: Duration = Duration::from_millis(1);

/// The time after which the machine is shown again.
const SHOW: Duration = Duration::from_millis(100);

/// Simulated time between two checks for the clients' bytes, cycles.
const SLICE: u64 = cycles_of_micros(2_000);

/// Simulated time in which a machine starts and prints its banner before clients are heard, cycles.
/// Otherwise a client that comes early would take this banner for the answer to its 0x18. It is
/// eight times a banner's duration at 115200 baud.
const START: u64 = cycles_of_micros(20_000);

/// Events that are handled before the simulation goes on.
const EVENTS: usize = 64;

/// The reason why the server loop ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum End {
    /// The user has ended the server.
    Stopped,
    /// The machine is to be reset.
    Restart,
}

/// The things that the server needs from its caller.
pub struct Surroundings<'s> {
    /// The wall clock: the time since any fixed instant.
    pub clock: &'s dyn Fn() -> Duration,
    /// Set when the server is to end.
    pub stop: &'s AtomicBool,
    /// The display for messages, which also gives the user's keys.
    pub panel: &'s mut dyn Panel,
}

/// Messages about a client that are sent only once.
#[derive(Clone, Copy, Default, Debug)]
struct Told {
    not_read: bool,
    bytes_lost: bool,
}

/// Lines and clients, whatever machine is behind them.
pub(super) struct Server<'s> {
    specs: Vec<LineSpec>,
    lines: Lines,
    wires: Wires,
    allowed: Allowed,
    pages: Pages,
    bench: Bench,
    /// True if each line has a client.
    taken: Vec<bool>,
    /// The messages already sent about each line's client.
    told: Vec<Told>,
    /// Bytes of each line that were lost and have been reported.
    lost: Vec<u32>,
    log: Option<WireLog>,
    buttons: Buttons,
    around: Surroundings<'s>,
    shown: Duration,
    speed: f64,
    told_slow: bool,
}

impl<'s> Server<'s> {
    /// Opens the lines of `specs`. Their machine runs `speed` times as fast as the wall clock.
    pub(super) fn new(
        specs: Vec<LineSpec>,
        allowed: Allowed,
        speed: f64,
        log: Option<WireLog>,
        pages: Pages,
        bench: Bench,
        around: Surroundings<'s>,
    ) -> Self {
        Self {
            lines: Lines::open(&specs, &allowed),
            wires: Wires::new(specs.len() + usize::from(pages.channel().is_some())),
            allowed,
            pages,
            bench,
            taken: vec![false; specs.len()],
            told: vec![Told::default(); specs.len()],
            lost: vec![0; specs.len()],
            specs,
            log,
            buttons: Buttons::default(),
            around,
            shown: Duration::ZERO,
            speed,
            told_slow: false,
        }
    }

    /// The number of lines, including the pages' one.
    pub(super) fn line_count(&self) -> usize {
        self.wires.count()
    }

    /// The channel on which pages move the machine.
    pub(super) fn pages_channel(&self) -> Option<usize> {
        self.pages.channel()
    }

    /// Describes the machine to pages.
    pub(super) fn greet(&mut self, hello: &Value) {
        self.pages.begin(hello);
    }

    /// Shows the user a message.
    pub(super) fn note(&mut self, note: &Note<'_>) {
        self.pages.note(&note.to_string());
        self.around.panel.note(note);
    }

    /// Runs a machine until the user ends the server or the machine is to be reset.
    pub(super) fn run(
        &mut self,
        desk: &mut Desk<'_>,
        mut glitches: Glitches,
        remembered: &mut Remembered,
    ) -> End {
        self.buttons.hold_on(desk);
        desk.run_until(&mut self.wires, desk.now() + START);
        self.deliver(desk.now());
        let mut pace = Pace::new(self.speed, (self.around.clock)(), desk.now());
        while !self.around.stop.load(Ordering::Relaxed) {
            if self.wait(desk) {
                return End::Restart;
            }
            self.serve_pages(desk);
            self.advance(desk, &mut pace, &mut glitches);
            while let Some(key) = self.around.panel.key() {
                if key == Key::Quit {
                    return End::Stopped;
                }
                self.buttons.press(key, desk);
            }
            self.buttons.release(desk);
            if let Some(note) = remembered.save(desk, (self.around.clock)()) {
                self.note(&note);
            }
            self.show(desk);
        }
        End::Stopped
    }

    /// Runs the simulation up to the present.
    fn advance(&mut self, desk: &mut Desk<'_>, pace: &mut Pace, glitches: &mut Glitches) {
        let due = pace.due((self.around.clock)());
        let end = due.min(desk.now() + SLICE.max(pace.cycles(TICK)));
        glitches.run_until(desk, &mut self.wires, end);
        self.deliver(desk.now());
        self.lines.set_busy(!desk.is_quiet() || self.wires.wait());
        self.tell_of_lost_bytes(desk);
        if pace.give_up((self.around.clock)(), desk.now()) && !self.told_slow {
            self.told_slow = true;
            self.around.panel.note(&Note::TooSlow);
        }
    }

    /// Takes the clients' bytes, and waits a moment for them. Returns whether the machine is to be
    /// reset.
    fn wait(&mut self, desk: &mut Desk<'_>) -> bool {
        let mut patience = TICK;
        for _ in 0..EVENTS {
            let Some(event) = self.lines.next(patience) else {
                break;
            };
            patience = Duration::ZERO;
            if self.handle(desk, event) {
                return true;
            }
        }
        false
    }

    fn handle(&mut self, desk: &mut Desk<'_>, event: Event) -> bool {
        let (now, line) = (desk.now(), event.line);
        if let What::Bytes(bytes) = &event.what {
            self.log(|log| log.bytes(now, line, Way::ToMachine, bytes));
            self.pages.wire(line, false, bytes);
            self.wires.push(line, bytes);
            return false;
        }
        let note = Note::Line(&self.specs[line], &event.what);
        self.around.panel.note(&note);
        self.pages.note(&note.to_string());
        self.log(|log| log.event(now, line, &event.what));
        match event.what {
            What::Opened { outlet, .. } => {
                self.told[line] = Told::default();
                self.taken[line] = true;
                self.wires.open(line, outlet);
                desk.open_line(line);
                return self.resets(line);
            }
            What::Closed => {
                self.taken[line] = false;
                self.wires.close(line);
            }
            What::Ready(at) => self.tell_of_page(line, &at),
            What::Unavailable(_) | What::Bytes(_) | What::TurnedAway(_) | What::Refused(..) => {}
        }
        false
    }

    /// Tells the user the address of the page that a port serves.
    fn tell_of_page(&mut self, line: usize, at: &str) {
        if matches!(self.specs[line], LineSpec::WebSocket(_)) {
            // A port that listens on all addresses is reached from this computer as localhost.
            let at = at
                .replace("0.0.0.0", "localhost")
                .replace("[::]", "localhost");
            let address = format!("http://{at}/?token={}", self.allowed.token());
            self.note(&Note::Page(address));
        }
    }

    /// Carries out the requests of pages, and shows them the machine.
    fn serve_pages(&mut self, desk: &mut Desk<'_>) {
        for _ in 0..EVENTS {
            let Some(event) = self.lines.next_of_page() else {
                break;
            };
            match (self.pages.handle(event, desk), self.pages.channel()) {
                (Some(Errand::Send(bytes)), Some(channel)) => {
                    self.pages.wire(channel, false, &bytes);
                    self.wires.push(channel, &bytes);
                }
                (Some(Errand::Press(key)), _) => self.buttons.press(key, desk),
                (Some(Errand::Look(job)), _) => self.bench.begin(job),
                (Some(Errand::Send(_)), None) | (None, _) => {}
            }
        }
        let senders = self
            .specs
            .iter()
            .zip(&self.taken)
            .filter(|(_, taken)| **taken);
        let senders: Vec<String> = senders.map(|(spec, _)| spec.to_string()).collect();
        let busy = !desk.is_quiet() || self.wires.wait();
        match (
            self.pages.agree_who_moves(&senders, busy),
            self.pages.channel(),
        ) {
            (Some(true), Some(channel)) => desk.open_line(channel),
            (Some(false), Some(channel)) => self.wires.close(channel),
            (_, _) => {}
        }
        while let Some(finding) = self.bench.next() {
            self.pages.found(&finding);
        }
        self.pages.show(desk, (self.around.clock)());
    }

    /// Returns true if opening a line resets the machine. If so, bytes that wait to go in are lost,
    /// as in a real reset.
    fn resets(&mut self, line: usize) -> bool {
        let resets = match &self.specs[line] {
            LineSpec::Pty { reset_on_open, .. } => *reset_on_open,
            LineSpec::Tcp(_) | LineSpec::WebSocket(_) => false,
        };
        if resets {
            (0..self.wires.count()).for_each(|line| self.wires.clear(line));
        }
        resets
    }

    /// Sends the machine's output to the clients.
    fn deliver(&mut self, now: Cycle) {
        for line in 0..self.wires.count() {
            self.lines.taken(line, self.wires.taken(line));
            let bytes = self.wires.written(line);
            if bytes.is_empty() {
                continue;
            }
            self.log(|log| log.bytes(now, line, Way::FromMachine, &bytes));
            self.pages.wire(line, true, &bytes);
            if !self.wires.send(line, bytes)
                && !std::mem::replace(&mut self.told[line].not_read, true)
            {
                self.around.panel.note(&Note::NotRead(&self.specs[line]));
            }
        }
    }

    fn tell_of_lost_bytes(&mut self, desk: &Desk<'_>) {
        for (line, spec) in self.specs.iter().enumerate() {
            let lost = desk.lost_bytes(line);
            let more = std::mem::replace(&mut self.lost[line], lost) < lost;
            if more && !std::mem::replace(&mut self.told[line].bytes_lost, true) {
                self.around.panel.note(&Note::BytesLost(spec));
            }
        }
    }

    fn show(&mut self, desk: &Desk<'_>) {
        let now = (self.around.clock)();
        if now.saturating_sub(self.shown) >= SHOW {
            self.shown = now;
            self.around.panel.show(&desk.snapshot());
            self.log(WireLog::flush);
        }
    }

    /// Writes to the log. If that fails, reports it and stops logging.
    fn log(&mut self, write: impl FnOnce(&mut WireLog) -> io::Result<()>) {
        let Some(log) = &mut self.log else {
            return;
        };
        if let Err(error) = write(log) {
            self.log = None;
            self.around.panel.note(&Note::NoLog(error));
        }
    }
}
