//! Pages that show what a machine does. One of them can move it.
//!
//! ```text
//!   pages <==frames== Pages <--- its owner: states, moves, bytes on the wire, findings about a job that was dropped
//!     |                 ^
//!     `---Said--> PageEvent
//! ```
//!
//! The page that came first controls the machine, on a channel of its own. While a sender is
//! connected, all pages only watch. A page that watches can still press the switches, hold and
//! reset.

use crate::desk::Desk;
use crate::frames::{self, frame, Progress, Said, Tag};
use crate::key::Key;
use crate::outlet::Outlet;
use crate::trail::Trail;
use leadscrew_jobs::{faults, work, Finding, Job};
use leadscrew_sim::powered::Snapshot;
use leadscrew_sim::profile::Profile;
use leadscrew_sim::scene::MOVE_BYTES;
use serde_json::{json, Value};
use std::time::Duration;

/// The time after which pages get the machine's state again.
const SHOW: Duration = Duration::from_millis(45);

/// The time between two checks of the settings for changes.
const LOOK: Duration = Duration::from_millis(500);

/// Moves in one frame at most.
const AT_ONCE: usize = 20_000;

/// Bytes that a page which only watches may send to the machine: feed hold, soft reset, safety door
/// and jog cancel.
const ALWAYS: [u8; 4] = [b'!', 0x18, 0x84, 0x85];

/// Something that a page did.
#[derive(Debug)]
pub struct PageEvent {
    /// The page's number; numbers are not used again.
    pub page: u64,
    /// The page's action.
    pub action: PageAction,
}

/// An action of a page.
#[derive(Debug)]
pub enum PageAction {
    /// The page has connected; frames for it go to this outlet.
    Opened(Outlet),
    /// The page has sent a message.
    Said(Said),
    /// The page has disconnected.
    Closed,
}

/// A task of the server on behalf of a page.
#[derive(Clone, PartialEq, Debug)]
pub enum Errand {
    /// Bytes to be sent to the machine on the pages' channel.
    Send(Vec<u8>),
    /// A switch to be pressed.
    Press(Key),
    /// A job to be analysed; its findings go to [`Pages::found`].
    Look(Job),
}

/// One page.
struct Page {
    number: u64,
    outlet: Outlet,
    /// The number of moves that it has received.
    moves: u32,
    /// The [`Trail::edition`] of the moves that it has received.
    edition: u32,
}

/// Information that stays valid: every new page gets it.
#[derive(Default)]
struct Known {
    hello: Vec<u8>,
    settings: Vec<u8>,
    /// Scene, check and profile of the job that was dropped last.
    job: Vec<Vec<u8>>,
}

/// All pages.
pub struct Pages {
    /// The channel on which pages move the machine; `None` if the machine has none left.
    channel: Option<usize>,
    all: Vec<Page>,
    known: Known,
    /// Answers of the machine on all lines since power-up.
    answers: u32,
    /// For each channel, the beginning of a line that the machine has not finished yet.
    begun: Vec<Vec<u8>>,
    heard: Heard,
    /// The page that controls the machine.
    holder: Option<u64>,
    senders: Vec<String>,
    normally_closed: bool,
    shown: Duration,
    looked: Duration,
}

impl Pages {
    /// Makes the pages of a machine, none at first. They use `channel`, the last of `lines` lines.
    pub fn new(channel: Option<usize>, lines: usize, normally_closed: bool) -> Self {
        Self {
            channel,
            all: Vec::new(),
            known: Known::default(),
            answers: 0,
            begun: vec![Vec::new(); lines],
            heard: Heard::default(),
            holder: None,
            senders: Vec::new(),
            normally_closed,
            shown: Duration::ZERO,
            looked: Duration::ZERO,
        }
    }

    /// Notes that a machine with these parts was powered up.
    pub fn begin(&mut self, hello: &Value) {
        self.answers = 0;
        self.begun.iter_mut().for_each(Vec::clear);
        self.heard = Heard::default();
        self.known.hello = frames::text(Tag::Hello, hello);
        self.known.settings.clear();
        for page in &mut self.all {
            (page.moves, page.edition) = (0, 0);
        }
        self.tell(&self.known.hello.clone());
        self.tell_roles();
    }

    /// Takes an action of a page; returns the task that follows from it.
    pub fn handle(&mut self, event: PageEvent, desk: &mut Desk<'_>) -> Option<Errand> {
        let number = event.page;
        match event.action {
            PageAction::Opened(outlet) => self.open(number, outlet),
            PageAction::Closed => self.all.retain(|page| page.number != number),
            PageAction::Said(Said::Wire(bytes)) => return self.wire_said(number, bytes),
            PageAction::Said(Said::Key(key)) => return key_of(key).map(Errand::Press),
            PageAction::Said(Said::Job(job)) => return self.job(&job, desk).map(Errand::Look),
            PageAction::Said(Said::Clear) => {
                desk.trail().clear();
            }
        }
        None
    }

    /// Sends a new page everything but the moves, which follow with the next state.
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

    /// The job in a page's message: if it has no settings, it is for this machine.
    fn job(&mut self, job: &[u8], desk: &Desk<'_>) -> Option<Job> {
        let mut job = Job::unpacked(job)?;
        if job.resume.is_none() {
            self.known.job.clear();
        }
        if job.settings.is_empty() {
            job.settings = desk.settings_text();
            job.origin = desk.snapshot().work_offset;
        }
        Some(job)
    }

    /// Notes bytes that have gone over a serial line of the machine, and sends them to the pages.
    pub fn wire(&mut self, line: usize, from_machine: bool, bytes: &[u8]) {
        if !self.all.is_empty() {
            self.tell(&frames::wire(line, from_machine, self.answers, bytes));
        }
        if let (true, Some(begun)) = (from_machine, self.begun.get_mut(line)) {
            for line in lines(begun, bytes) {
                self.answers += u32::from(line.starts_with("ok") || line.starts_with("error:"));
                self.heard.note(&line);
            }
        }
    }

    /// Decides which page controls the machine. `senders` are the clients of the other lines;
    /// `busy`: a job is unfinished. Returns `true` if the pages' channel has now been opened,
    /// `false` if it has been closed, and `None` if neither.
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

    /// Returns the channel on which pages move the machine.
    pub fn channel(&self) -> Option<usize> {
        self.channel
    }

    fn tell_roles(&self) {
        for page in &self.all {
            let controls = self.holder == Some(page.number);
            page.outlet.send(frames::role(controls, &self.senders));
        }
    }

    /// Sends pages a message for the user.
    pub fn note(&mut self, text: &str) {
        self.tell(&frame(Tag::Note, text.as_bytes()));
    }

    /// Sends pages the machine's state, if 45 ms have passed since the last time.
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
        let bits = (quiet, self.normally_closed);
        let last = self.heard.in_force(machine.state);
        let frame = frames::state(&machine, progress, bits, last);
        self.tell(&frame);
    }

    /// Sends pages a finding about the job that was dropped last.
    pub fn found(&mut self, finding: &Finding) {
        let frame = frames::finding(finding);
        self.tell(&frame);
        if !matches!(finding, Finding::Progress(_) | Finding::Rest(_)) {
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

    /// Sends each page the moves that it has not received.
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

    /// Sends a frame to all pages. A page that does not read is disconnected.
    fn tell(&mut self, frame: &[u8]) {
        self.all.retain(|page| page.outlet.send(frame.to_vec()));
    }
}

/// The lines that end in `bytes`; `begun` holds the beginning of the line under way.
fn lines(begun: &mut Vec<u8>, bytes: &[u8]) -> Vec<String> {
    let mut ended = Vec::new();
    for byte in bytes {
        match byte {
            b'\n' => {
                let line = std::mem::take(begun);
                ended.push(String::from_utf8_lossy(&line).trim_end().to_owned());
            }
            byte => begun.push(*byte),
        }
    }
    ended
}

/// The words of the machine about its state: for pages that come later, too.
#[derive(Default)]
struct Heard {
    /// `ALARM:1`, as long as the machine is locked.
    alarm: String,
    /// The text of the message that came with the state, such as `Reset to continue`.
    message: String,
    /// True if the message has come since the last look at the state.
    is_new: bool,
    /// The state of the last look, without its phase.
    state: &'static str,
}

impl Heard {
    /// Notes a line of the machine's.
    fn note(&mut self, line: &str) {
        if line.starts_with("ALARM:") {
            line.clone_into(&mut self.alarm);
        }
        if let Some(text) = line.strip_prefix("[MSG:") {
            text.trim_end_matches(']').clone_into(&mut self.message);
            self.is_new = true;
        }
    }

    /// The alarm and the message that belong to a state.
    fn in_force(&mut self, state: &'static str) -> [&str; 2] {
        let name = state.split(':').next().unwrap_or(state);
        if name != self.state && !self.is_new {
            self.message.clear();
        }
        if name != "Alarm" {
            self.alarm.clear();
        }
        (self.state, self.is_new) = (name, false);
        [&self.alarm, &self.message]
    }
}

/// The key that a page names by this number.
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

/// Returns the first message to a page: the description of the machine.
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
        "work": work(profile),
        "faults": faults(),
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

    /// Returns true if the last role that was sent to a page lets it move the machine.
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

    #[test]
    fn an_alarm_is_told_while_it_lasts_and_a_message_while_its_state_does() {
        let mut pages = Pages::new(None, 1, false);
        pages.wire(0, true, b"[MSG:Tool 2: 0.8 mm, then ~]\r\n");
        assert_eq!(
            pages.heard.in_force("Hold:0"),
            ["", "Tool 2: 0.8 mm, then ~"]
        );
        assert_eq!(
            pages.heard.in_force("Hold:0"),
            ["", "Tool 2: 0.8 mm, then ~"]
        );
        assert_eq!(pages.heard.in_force("Run"), ["", ""]);
        pages.wire(0, true, b"ALARM:1\r\n[MSG:Reset to continue]\r\n");
        assert_eq!(
            pages.heard.in_force("Alarm"),
            ["ALARM:1", "Reset to continue"]
        );
        pages.wire(0, true, b"[MSG:'$H'|'$X' to unlock]\r\n");
        assert_eq!(
            pages.heard.in_force("Alarm"),
            ["ALARM:1", "'$H'|'$X' to unlock"]
        );
        assert_eq!(pages.heard.in_force("Idle"), ["", ""]);
    }
}
