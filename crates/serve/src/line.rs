//! One serial line as the server sees it, whatever carries it: opened, bytes in, bytes out, closed.
//!
//! ```text
//!   client <--- socket or pty ---> reader thread --- Event ---> server loop
//!                              `-- writer thread <--- Outlet ------'
//! ```
//!
//! A line has one client at a time. Its threads may wait; the server loop never does: events come through a bounded
//! channel, and what a client does not read is thrown away once its outlet is full.

use super::browser::PageEvent;
use super::web::{Allowed, Foreign};
use super::{listener, tcp, websocket};
use std::fmt;
use std::io;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{self, SyncSender};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

/// Events that may wait for the server loop; then reading waits, and the operating system holds the client back.
const EVENTS: usize = 64;

/// Bytes from one client that may wait for the machine before reading waits too.
const BACKLOG: usize = 64 * 1024;

/// Bytes that are read from a client at a time.
pub(super) const CHUNK: usize = 4096;

/// Pieces of output that may wait for a client that does not read.
const OUTLET: usize = 1024;

/// How often a line that is not available is tried again.
pub(super) const RETRY: Duration = Duration::from_secs(1);

/// Where programs can connect.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum LineSpec {
    /// A pseudo-terminal behind a symbolic link: a serial port for local programs. Unix only.
    Pty {
        /// The link, which must not exist.
        link: PathBuf,
        /// Whether opening it resets the machine, as it resets an Arduino.
        reset_on_open: bool,
    },
    /// Bytes as they are over TCP, at a host and port.
    Tcp(String),
    /// A WebSocket at a host and port, any path.
    WebSocket(String),
}

impl fmt::Display for LineSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pty { link, .. } => write!(f, "pty {}", link.display()),
            Self::Tcp(address) => write!(f, "tcp {address}"),
            Self::WebSocket(address) => write!(f, "ws {address}"),
        }
    }
}

/// Why a line is not available.
#[derive(Debug)]
pub enum LineError {
    /// The address cannot be listened on: in use, not this machine's, not allowed.
    Listen(io::Error),
    /// There is something at the link's path already.
    LinkExists,
    /// The link cannot be made.
    Link(io::Error),
    /// The operating system gives no pseudo-terminal.
    NoPty(io::Error),
}

impl fmt::Display for LineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Listen(error) if error.kind() == io::ErrorKind::AddrInUse => {
                write!(f, "another program listens there already")
            }
            Self::Listen(error) => write!(f, "cannot listen there: {error}"),
            Self::LinkExists => write!(f, "the path exists already: remove it or choose another"),
            Self::Link(error) => write!(f, "the link cannot be made: {error}"),
            Self::NoPty(error) => write!(f, "no pseudo-terminal: {error}"),
        }
    }
}

impl std::error::Error for LineError {}

/// An event on a line.
#[derive(Debug)]
pub enum What {
    /// Programs can connect now, at this address or device.
    Ready(String),
    /// Programs cannot connect; it is tried again quietly.
    Unavailable(LineError),
    /// A client has come.
    Opened {
        /// Who it is, as far as is known.
        peer: String,
        /// Where its bytes go.
        outlet: Outlet,
    },
    /// The client has sent bytes; never empty.
    Bytes(Vec<u8>),
    /// The client has gone.
    Closed,
    /// A second client has come and was sent away.
    TurnedAway(String),
    /// A client was sent away for another reason.
    Refused(String, Refusal),
}

/// Why a client is not let in.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Refusal {
    /// A web page that may not.
    Foreign(Foreign),
    /// A browser's request on a port for raw bytes.
    Request,
    /// It does not speak WebSocket, or takes too long over it.
    NoWebSocket,
    /// A page without the token that was printed.
    NoToken,
    /// It has gone again.
    Gone,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Foreign(foreign) => foreign.fmt(f),
            Self::Request => f.write_str("the request of a web browser, on a port for G-code"),
            Self::NoWebSocket => f.write_str("no WebSocket client"),
            Self::NoToken => f.write_str("a page without the token that leadscrew has printed"),
            Self::Gone => f.write_str("it has gone again"),
        }
    }
}

/// Something that happened on a line.
#[derive(Debug)]
pub(super) struct Event {
    /// The line, counted from 0.
    pub(super) line: usize,
    /// The event.
    pub(super) what: What,
}

/// Takes bytes for one client; once the client has gone, nothing.
#[derive(Debug)]
pub struct Outlet(SyncSender<Vec<u8>>);

impl Outlet {
    /// Makes an outlet and its writer thread's end.
    pub(super) fn new() -> (Self, mpsc::Receiver<Vec<u8>>) {
        let (sender, receiver) = mpsc::sync_channel(OUTLET);
        (Self(sender), receiver)
    }

    /// Sends `bytes`; answers whether there was room for them. Never waits.
    pub(super) fn send(&self, bytes: Vec<u8>) -> bool {
        !matches!(self.0.try_send(bytes), Err(mpsc::TrySendError::Full(_)))
    }
}

/// The server, as the threads of a line see it.
#[derive(Clone)]
pub(super) struct Uplink {
    line: usize,
    events: SyncSender<Event>,
    pages: SyncSender<PageEvent>,
    /// Pages that have come.
    page_count: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
    backlog: Arc<AtomicUsize>,
    busy: Arc<AtomicBool>,
}

impl Uplink {
    /// Whether the machine has a job that is not finished, as the server says at each of its turns.
    pub(super) fn busy(&self) -> Arc<AtomicBool> {
        self.busy.clone()
    }

    /// Passes a client's bytes on. Waits while the machine has not taken the bytes before: the
    /// operating system then holds back a client that floods, and the other lines go on.
    pub(super) fn pass(&self, bytes: &[u8]) {
        while self.backlog.load(Ordering::Relaxed) > BACKLOG && !self.stopped() {
            std::thread::sleep(Duration::from_millis(1));
        }
        self.backlog.fetch_add(bytes.len(), Ordering::Relaxed);
        self.tell(What::Bytes(bytes.to_vec()));
    }

    /// Tells the server; waits while it is busy. Nobody is left to hear it once the server has gone.
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

    /// A number for a page that has come.
    pub(super) fn number_page(&self) -> u64 {
        self.page_count.fetch_add(1, Ordering::Relaxed)
    }

    /// Whether the threads are to end.
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

/// All lines of a server. Dropping them disconnects the clients, frees the ports and removes the links.
pub(super) struct Lines {
    // First: a thread that waits for room among the events must wake before it is joined.
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
    /// Opens lines, for senders and the web pages that are `allowed`; the first has number 0. The
    /// first event of each line tells whether it could be opened.
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

    /// Notes whether the machine has a job that is not finished: no client loses its line until it is.
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

    /// The next action of a page, where one waits.
    pub(super) fn next_of_page(&self) -> Option<PageEvent> {
        self.pages.try_recv().ok()
    }

    /// Notes that the machine has taken `count` bytes of a line's events.
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
            // A thread that has panicked has nothing left to free.
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
