//! All lines of a server, each with its thread.

use super::line::{Event, LineSpec};
use super::uplink::Uplink;
use super::web::Allowed;
use super::{listener, tcp, websocket};
use leadscrew_page::PageEvent;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

/// Events that may wait for the server loop. When they are full, the threads stop reading, and the
/// operating system holds the clients back.
const EVENTS: usize = 64;

/// All lines of a server. Dropping them disconnects the clients, frees the ports and removes the
/// links.
pub(super) struct Lines {
    // This field is dropped first: a thread that waits for room among the events must wake before
    // it is joined.
    events: mpsc::Receiver<Event>,
    pages: mpsc::Receiver<PageEvent>,
    threads: Vec<LineThread>,
    busy: Arc<AtomicBool>,
}

struct LineThread {
    stop: Arc<AtomicBool>,
    backlog: Arc<AtomicUsize>,
    thread: Option<JoinHandle<()>>,
}

impl Lines {
    /// Opens lines for senders and for the web pages in `allowed`. The first line has number 0.
    /// Each line's first event tells whether the line could be opened.
    pub(super) fn open(specs: &[LineSpec], allowed: &Allowed) -> Self {
        let (events, heard) = mpsc::sync_channel(EVENTS);
        let (pages, pages_heard) = mpsc::sync_channel(EVENTS);
        let page_count = Arc::new(AtomicU64::new(1));
        let busy = Arc::new(AtomicBool::new(false));
        let start = |(line, spec): (usize, &LineSpec)| {
            let uplink = Uplink {
                line,
                events: events.clone(),
                pages: pages.clone(),
                page_count: page_count.clone(),
                stop: Arc::default(),
                backlog: Arc::default(),
                busy: busy.clone(),
            };
            LineThread::start(spec.clone(), allowed.clone(), uplink)
        };
        Self {
            threads: specs.iter().enumerate().map(start).collect(),
            events: heard,
            pages: pages_heard,
            busy,
        }
    }

    /// Notes whether the machine has an unfinished job: until it is finished, no client can take
    /// the line from another.
    pub(super) fn set_busy(&self, busy: bool) {
        self.busy.store(busy, Ordering::Relaxed);
    }

    /// Waits for the next event, at most for `time`.
    pub(super) fn next(&self, time: Duration) -> Option<Event> {
        match self.events.recv_timeout(time) {
            Ok(event) => Some(event),
            Err(mpsc::RecvTimeoutError::Timeout) => None,
            Err(mpsc::RecvTimeoutError::Disconnected) => {
                std::thread::sleep(time);
                None
            }
        }
    }

    /// The next action of a page, if one waits.
    pub(super) fn next_of_page(&self) -> Option<PageEvent> {
        self.pages.try_recv().ok()
    }

    /// Notes that the machine has taken `count` bytes that were passed on from a line.
    pub(super) fn taken(&self, line: usize, count: usize) {
        if let Some(thread) = self.threads.get(line) {
            thread.backlog.fetch_sub(count, Ordering::Relaxed);
        }
    }
}

impl LineThread {
    fn start(spec: LineSpec, allowed: Allowed, uplink: Uplink) -> Self {
        Self {
            stop: uplink.stop.clone(),
            backlog: uplink.backlog.clone(),
            thread: Some(std::thread::spawn(move || run(&spec, &allowed, &uplink))),
        }
    }
}

impl Drop for LineThread {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // If the thread has panicked, it has already freed everything.
            let _ = thread.join();
        }
    }
}

fn run(spec: &LineSpec, allowed: &Allowed, uplink: &Uplink) {
    match spec {
        LineSpec::Tcp(address) => listener::run(address, allowed, uplink, tcp::PROTOCOL),
        LineSpec::WebSocket(address) => {
            listener::run(address, allowed, uplink, websocket::PROTOCOL);
        }
        LineSpec::Pty { link, .. } => super::pty::run(link, uplink),
    }
}
