//! The server, as the threads of one line see it.

use super::line::{Event, What};
use leadscrew_page::PageEvent;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::Arc;
use std::time::Duration;

/// Bytes from one client that may wait for the machine before the server stops reading from the
/// client.
const BACKLOG: usize = 64 * 1024;

/// The server, as the threads of a line see it.
#[derive(Clone)]
pub(super) struct Uplink {
    pub(super) line: usize,
    pub(super) events: SyncSender<Event>,
    pub(super) pages: SyncSender<PageEvent>,
    /// The number of pages that have connected.
    pub(super) page_count: Arc<AtomicU64>,
    pub(super) stop: Arc<AtomicBool>,
    pub(super) backlog: Arc<AtomicUsize>,
    pub(super) busy: Arc<AtomicBool>,
}

impl Uplink {
    /// Returns the flag that is true while the machine has an unfinished job; the server updates it
    /// at each of its turns.
    pub(super) fn busy(&self) -> Arc<AtomicBool> {
        self.busy.clone()
    }

    /// Passes a client's bytes on. Waits while the machine has not taken the bytes before them. So
    /// the operating system holds back a client that floods the line, and the other lines go on.
    pub(super) fn pass(&self, bytes: &[u8]) {
        while self.backlog.load(Ordering::Relaxed) > BACKLOG && !self.stopped() {
            std::thread::sleep(Duration::from_millis(1));
        }
        self.backlog.fetch_add(bytes.len(), Ordering::Relaxed);
        self.tell(What::Bytes(bytes.to_vec()));
    }

    /// Sends the server an event; waits while the server is busy. Once the server has ended,
    /// nothing receives the event.
    pub(super) fn tell(&self, what: What) {
        let line = self.line;
        if self.events.send(Event { line, what }).is_err() {
            self.stop.store(true, Ordering::Relaxed);
        }
    }

    /// Tells the server of a page's action; waits while it is busy.
    pub(super) fn tell_of_page(&self, event: PageEvent) {
        if self.pages.send(event).is_err() {
            self.stop.store(true, Ordering::Relaxed);
        }
    }

    /// The number of a page that has connected.
    pub(super) fn number_page(&self) -> u64 {
        self.page_count.fetch_add(1, Ordering::Relaxed)
    }

    /// Returns true if the threads are to end.
    pub(super) fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Waits for `time`, or until the threads are to end.
    pub(super) fn pause(&self, time: Duration) {
        const STEP: Duration = Duration::from_millis(20);
        let mut left = time;
        while !left.is_zero() && !self.stopped() {
            std::thread::sleep(left.min(STEP));
            left = left.saturating_sub(STEP);
        }
    }
}
