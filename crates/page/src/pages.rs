//! Pages that show what a machine does, and one of them that moves it.
//!
//! ```text
//!   pages <==frames== Pages <--- its owner: states, moves, bytes on the wire, findings about a job that was dropped
//!     |                 ^
//!     `---Said--> PageEvent
//! ```
//!
//! The page that came first has the machine, on a channel of its own, unless a sender is connected:
//! then all pages watch. A page that watches can still press the switches, hold and reset.

use crate::desk::Desk;
use crate::frames::{self, frame, Progress, Said, Tag};
use crate::key::Key;
use crate::outlet::Outlet;
use crate::trail::Trail;
use leadscrew_jobs::{Finding, Job};
use leadscrew_sim::powered::Snapshot;
use leadscrew_sim::profile::Profile;
use leadscrew_sim::scene::MOVE_BYTES;
use serde_json::{json, Value};
use std::time::Duration;

/// How often pages are told how the machine stands.
const SHOW: Duration = Duration::from_millis(45);

/// How often it is looked whether settings have changed.
const LOOK: Duration = Duration::from_millis(500);

/// Moves in one frame at most.
const AT_ONCE: usize = 20_000;

/// Bytes that a page which only watches may send to the machine: feed hold, soft reset, safety
/// door, jog cancel.
const ALWAYS: [u8; 4] = [b'!', 0x18, 0x84, 0x85];

/// Something that a page did.
#[derive(Debug)]
pub struct PageEvent {
    /// Which page: numbers are not used again.
    pub page: u64,
    /// The page's action.
    pub action: PageAction,
}

/// An action of a page.
#[derive(Debug)]
pub enum PageAction {
    /// It has come; frames go there.
    Opened(Outlet),
    /// It has sent something.
    Said(Said),
    /// It has gone.
    Closed,
}

/// A task of the server for a page.
#[derive(Clone, PartialEq, Debug)]
pub enum Errand {
    /// Bytes for the machine, on the pages' channel.
    Send(Vec<u8>),
    /// A switch is pressed.
    Press(Key),
    /// A job is looked at, for [`Pages::found`] to be told of it.
    Look(Job),
}

/// One page.
struct Page {
    number: u64,
    outlet: Outlet,
    /// Moves that it knows of.
    moves: u32,
    /// [`Trail::edition`] that it knows.
    edition: u32,
}

/// Lasting information: a new page gets it.
#[derive(Default)]
struct Known {
    hello: Vec<u8>,
    settings: Vec<u8>,
    /// Scene, check and profile of the job that was dropped last.
    job: Vec<Vec<u8>>,
}

/// All pages.
pub struct Pages {
    /// The channel that they move the machine on; none where the machine has none left.
    channel: Option<usize>,
    all: Vec<Page>,
    known: Known,
    /// Answers of the machine on all lines since power-up.
    answers: u32,
    /// The beginning of a line that the machine has not finished, by channel.
    begun: Vec<Vec<u8>>,
    /// The page that has the machine.
    holder: Option<u64>,
    senders: Vec<String>,
    normally_closed: bool,
    shown: Duration,
    looked: Duration,
}

impl Pages {
    /// No page yet. They use `channel`, the last of `lines` lines.
    pub fn new(channel: Option<usize>, lines: usize, normally_closed: bool) -> Self {
        Self {
            channel,
            all: Vec::new(),
            known: Known::default(),
            answers: 0,
            begun: vec![Vec::new(); lines],
            holder: None,
            senders: Vec::new(),
            normally_closed,
            shown: Duration::ZERO,
            looked: Duration::ZERO,
        }
    }

    /// A machine is powered up that has these parts.
    pub fn begin(&mut self, hello: &Value) {
        self.answers = 0;
        self.begun.iter_mut().for_each(Vec::clear);
        self.known.hello = frames::text(Tag::Hello, hello);
        self.known.settings.clear();
        for page in &mut self.all {
            (page.moves, page.edition) = (0, 0);
        }
        self.tell(&self.known.hello.clone());
        self.tell_roles();
    }

    /// Takes an action of a page; answers the task that follows.
    pub fn handle(&mut self, event: PageEvent, desk: &mut Desk<'_>) -> Option<Errand> {
        let number = event.page;
        match event.action {
            PageAction::Opened(outlet) => self.open(number, outlet),
            PageAction::Closed => self.all.retain(|page| page.number != number),
            PageAction::Said(Said::Wire(bytes)) => return self.wire_said(number, bytes),
            PageAction::Said(Said::Key(key)) => return key_of(key).map(Errand::Press),
            PageAction::Said(Said::Job(job)) => return Some(Errand::Look(self.job(&job, desk))),
            PageAction::Said(Said::Clear) => {
                desk.trail().clear();
            }
        }
        None
    }

    /// Brings a page up to date; the moves follow with the next state.
    fn open(&mut self, number: u64, outlet: Outlet) {
        let known = &self.known;
        let frames = [&known.hello, &known.settings]
            .into_iter()
            .chain(&known.job);
        for frame in frames.filter(|frame| !frame.is_empty()) {
            outlet.send(frame.clone());
        }
        outlet.send(frames::role(false, &self.senders));
        self.all.push(Page {
            number,
            outlet,
            moves: 0,
            edition: 0,
        });
    }

    fn wire_said(&self, page: u64, mut bytes: Vec<u8>) -> Option<Errand> {
        if self.holder != Some(page) {
            bytes.retain(|byte| ALWAYS.contains(byte));
        }
        (self.channel.is_some() && !bytes.is_empty()).then_some(Errand::Send(bytes))
    }

    /// A job to be looked at, of its name, a line end, its text.
    fn job(&mut self, job: &[u8], desk: &Desk<'_>) -> Job {
        let end = job.iter().position(|byte| *byte == b'\n').unwrap_or(0);
        let (name, text) = (&job[..end], job.get(end + 1..).unwrap_or_default());
        self.known.job.clear();
        Job {
            name: String::from_utf8_lossy(name).into_owned(),
            text: text.to_vec(),
            settings: desk.settings_text(),
            origin: desk.snapshot().work_offset,
        }
    }

    /// Bytes have gone over a line of the machine's.
    pub fn wire(&mut self, line: usize, from_machine: bool, bytes: &[u8]) {
        if !self.all.is_empty() {
            self.tell(&frames::wire(line, from_machine, self.answers, bytes));
        }
        if let (true, Some(begun)) = (from_machine, self.begun.get_mut(line)) {
            self.answers += count_answers(begun, bytes);
        }
    }

    /// Who has a line of the machine's beside the pages; the machine is `busy` or not. Answers
    /// whether its channel is now open that was shut (`true`), or the other way round.
    pub fn agree_who_moves(&mut self, senders: &[String], busy: bool) -> Option<bool> {
        let holds = |page: &u64| self.all.iter().any(|other| other.number == *page);
        let before = self.holder;
        let stays = before.filter(|page| holds(page) && (busy || senders.is_empty()));
        let first = self.all.first().map(|page| page.number);
        let next = first.filter(|_| senders.is_empty() && self.channel.is_some());
        self.holder = stays.or(next);
        if self.holder != before || self.senders != senders {
            self.senders = senders.to_vec();
            self.tell_roles();
        }
        match (before, self.holder) {
            (Some(_), None) => Some(false),
            (None, Some(_)) => Some(true),
            (Some(_), Some(_)) | (None, None) => None,
        }
    }

    /// The channel that pages move the machine on.
    pub fn channel(&self) -> Option<usize> {
        self.channel
    }

    fn tell_roles(&self) {
        for page in &self.all {
            let controls = self.holder == Some(page.number);
            page.outlet.send(frames::role(controls, &self.senders));
        }
    }

    /// Tells pages a message.
    pub fn note(&mut self, text: &str) {
        self.tell(&frame(Tag::Note, text.as_bytes()));
    }

    /// Shows pages how the machine stands, where it is time.
    pub fn show(&mut self, desk: &mut Desk<'_>, now: Duration) {
        if self.all.is_empty() || now.saturating_sub(self.shown) < SHOW {
            return;
        }
        self.shown = now;
        if now.saturating_sub(self.looked) >= LOOK || self.known.settings.is_empty() {
            self.looked = now;
            self.tell_settings(desk);
        }
        let machine = desk.snapshot();
        let quiet = desk.is_quiet();
        if quiet {
            self.answers = desk.lines_begun();
        }
        let progress = self.tell_moves(&mut desk.trail(), &machine, quiet);
        self.tell(&frames::state(&machine, progress, self.normally_closed));
    }

    /// Tells pages a finding about the job that was dropped last.
    pub fn found(&mut self, finding: &Finding) {
        let frame = frames::finding(finding);
        self.tell(&frame);
        if !matches!(finding, Finding::Progress(_)) {
            self.known.job.push(frame);
        }
    }

    fn tell_settings(&mut self, desk: &Desk<'_>) {
        let settings = frames::text(Tag::Settings, &desk.settings_table());
        if settings != self.known.settings {
            self.tell(&settings);
            self.known.settings = settings;
        }
    }

    /// Brings each page the moves that it does not know.
    fn tell_moves(&mut self, trail: &mut Trail, machine: &Snapshot, quiet: bool) -> Progress {
        let place = |axis: usize| machine.position.get(axis).copied().unwrap_or(0.0);
        let position = [place(0), place(1), place(2)];
        if quiet {
            trail.rest(position);
        }
        let (done, line) = trail.progress(position);
        let planned = trail.planned();
        for page in &mut self.all {
            if page.edition != trail.edition {
                page.edition = trail.edition;
                page.moves = page.moves.min(done.saturating_sub(1));
            }
            let from = page.moves.max(trail.first());
            if from < planned {
                let bytes = trail.bytes(from, AT_ONCE);
                page.moves = from + (bytes.len() / MOVE_BYTES) as u32;
                page.outlet.send(frames::moves(from, &bytes));
            }
        }
        Progress {
            answers: self.answers,
            line,
            planned,
            done,
        }
    }

    /// Sends a frame to all pages; one that does not read is sent away.
    fn tell(&mut self, frame: &[u8]) {
        self.all.retain(|page| page.outlet.send(frame.to_vec()));
    }
}

/// Counts the answers that end in `bytes`; `begun` is the beginning of the line under way.
fn count_answers(begun: &mut Vec<u8>, bytes: &[u8]) -> u32 {
    let mut count = 0;
    for byte in bytes {
        if *byte != b'\n' {
            begun.push(*byte);
            continue;
        }
        count += u32::from(begun.starts_with(b"ok") || begun.starts_with(b"error:"));
        begun.clear();
    }
    count
}

/// The key of a number that a page sends.
fn key_of(number: u8) -> Option<Key> {
    match number {
        0 => Some(Key::Door),
        1 => Some(Key::Hold),
        2 => Some(Key::Start),
        3 => Some(Key::Reset),
        4 => Some(Key::Probe),
        5 => Some(Key::SecondMotorLimit),
        16..=31 => Some(Key::Limit(usize::from(number - 16))),
        _ => None,
    }
}

/// The first message to a page: the description of the machine.
pub fn hello(profile: &Profile, channel: Option<usize>) -> Value {
    let axes: Vec<String> = profile.letters().iter().map(char::to_string).collect();
    let second = profile
        .second_motor
        .map(|second| &axes[second.axis.number()]);
    json!({
        "name": profile.name,
        "version": env!("CARGO_PKG_VERSION"),
        "axes": axes,
        "motors": profile.motor_count(),
        "second": second,
        "receive_buffer": profile.receive_buffer(),
        "channel": channel,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(pages: &mut Pages, number: u64) -> std::sync::mpsc::Receiver<Vec<u8>> {
        let (outlet, frames) = Outlet::new();
        pages.open(number, outlet);
        frames
    }

    /// Whether the last role that a page was told is that it moves the machine.
    fn controls(frames: &std::sync::mpsc::Receiver<Vec<u8>>) -> bool {
        let roles = frames
            .try_iter()
            .filter(|frame| frame[0] == Tag::Role as u8);
        let last = roles.last().expect("a role");
        String::from_utf8_lossy(&last).contains("\"controls\":true")
    }

    #[test]
    fn the_first_page_has_the_machine_until_a_sender_comes() {
        let mut pages = Pages::new(Some(1), 2, false);
        let (first, second) = (page(&mut pages, 1), page(&mut pages, 2));
        assert_eq!(pages.agree_who_moves(&[], false), Some(true));
        assert!(controls(&first) && !controls(&second));
        let sender = ["tcp 127.0.0.1:2323".to_owned()];
        assert_eq!(pages.agree_who_moves(&sender, true), None);
        assert!(controls(&first), "a job of the page's is finished first");
        assert_eq!(pages.agree_who_moves(&sender, false), Some(false));
        assert!(!controls(&first) && !controls(&second));
        assert_eq!(pages.agree_who_moves(&[], false), Some(true));
        assert!(controls(&first));
    }

    #[test]
    fn a_page_that_watches_can_hold_and_reset_and_nothing_else() {
        let mut pages = Pages::new(Some(1), 2, false);
        let _frames = (page(&mut pages, 1), page(&mut pages, 2));
        pages.agree_who_moves(&[], false);
        let bytes = b"G0X1\n!\x18~?".to_vec();
        assert_eq!(
            pages.wire_said(1, bytes.clone()),
            Some(Errand::Send(bytes.clone()))
        );
        assert_eq!(
            pages.wire_said(2, bytes),
            Some(Errand::Send(b"!\x18".to_vec()))
        );
        assert_eq!(pages.wire_said(2, b"$X\n".to_vec()), None);
    }

    #[test]
    fn answers_are_counted_over_all_lines_however_they_are_cut() {
        let mut pages = Pages::new(None, 2, false);
        pages.wire(0, true, b"ok\r\nerr");
        pages.wire(1, true, b"<Idle>\r\nok\r\n");
        pages.wire(0, true, b"or:20\r\n[MSG:ok]\r\n");
        pages.wire(0, false, b"ok\n");
        assert_eq!(pages.answers, 3);
    }
}
